// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// An empty list of detections means that nothing is there; otherwise a flag or a counter tells the reason: ego poses
// off the map, gates, capacities, no ego pose. And no public number is NaN or infinite, for any input.
#include <doctest/doctest.h>

#include <cmath>
#include <cstring>
#include <limits>
#include <random>
#include <set>
#include <vector>

#include "pipeline/clock_watch.h"
#include "tests/support/frame_rules.h"
#include "tests/support/one_sensor_detector.h"
#include "tests/support/small_scene.h"

using namespace overtake::test;

namespace {

constexpr int64_t kMs = 1'000'000;
constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
constexpr double kInfinity = std::numeric_limits<double>::infinity();

struct Seen {
  ovt_frame_info info;
  const char* broken;  // the broken rule, null if none
  std::vector<float> heading_ref, map_s;
  std::vector<uint64_t> confirmed;
};

// A straight of 4 km along x, 8 m to either side, open at both ends; one sensor 1.2 m above the road, and frames with
// the rear of a car.
struct Straight {
  explicit Straight(bool with_map = true) {
    for (int32_t i = 0; i <= 40; ++i) x.push_back(-2000.0 + 100.0 * i);
    y.assign(x.size(), 0.0);
    width.assign(x.size(), 8.0);
    map = ovt_default_map_def();
    map.count = int32_t(x.size());
    map.x_m = x.data(), map.y_m = y.data(), map.width_left_m = map.width_right_m = width.data();
    small.sensor.z_m = 1.2;
    params = ovt_default_params();
    params.tracker_confirm_hits = 3;
    params.tracker_keep_hits = 2;
    small.def.params = &params;
    if (with_map) small.def.map = &map;
    small.def.user = this;
    small.def.on_frame = [](ovt_reader* reader, void* user) {
      auto& bench = *static_cast<Straight*>(user);
      Seen s;
      ovt_detections d;
      ovt_tracks t;
      ovt_read_info(reader, &s.info);
      s.broken = find_broken_rule(reader, bench.small.def.sensor_count, bench.small.def.map != nullptr,
                                  {OVT_AT_FRAME_STAMP, overtake::later_ns(s.info.stamp_ns, 500 * kMs)});
      ovt_read_detections(reader, &d);
      ovt_read_tracks(reader, OVT_AT_FRAME_STAMP, &t);
      s.heading_ref.assign(d.heading_ref_rad, d.heading_ref_rad + d.count);
      s.map_s.assign(d.map_s_m, d.map_s_m + d.count);
      for (int32_t i = 0; i < t.count; ++i)
        if (t.state[i] == OVT_CONFIRMED) s.confirmed.push_back(t.id[i]);
      bench.seen.push_back(s);
    };
  }
  ovt_ego_pose pose(int64_t stamp_ns, double x_m, double y_m) const {
    ovt_ego_pose out;
    ovt_ego_pose_init(&out, sizeof out);
    out.stamp_ns = stamp_ns, out.x_m = x_m, out.y_m = y_m;
    return out;
  }
  void push_pose(int64_t stamp_ns, double x_m, double y_m) {
    const ovt_ego_pose p = pose(stamp_ns, x_m, y_m);
    REQUIRE(ovt_push_ego_pose(small.detector, &p) == OVT_OK);
  }
  // The points' times run from the stamp to late_s after it.
  void push_car(int64_t stamp_ns, double ahead_m = 20.0, double late_s = 0.0) {
    const int32_t count = look(ahead_m);
    std::vector<float> time_s(std::size_t(count), 0.0f);
    for (int32_t i = 0; i < count; ++i) time_s[std::size_t(i)] = float(late_s);
    ovt_points p;
    ovt_points_init(&p, sizeof p);
    p.count = count;
    p.stamp_ns = stamp_ns;
    const auto field = [&](const void* at, int32_t type) {
      const auto offset = std::size_t(static_cast<const char*>(at) - reinterpret_cast<const char*>(cloud));
      return ovt_column{at, sizeof cloud - offset, sizeof cloud[0], type};
    };
    p.x = field(&cloud[0].x, OVT_F32), p.y = field(&cloud[0].y, OVT_F32), p.z = field(&cloud[0].z, OVT_F32);
    p.layer = field(&cloud[0].layer, OVT_U16);
    p.time = column_of(time_s, OVT_F32);
    p.time_unit_ns = 1e9;
    REQUIRE(ovt_push_scan(small.detector, &p) == OVT_OK);
  }
  const Seen& last() const { return seen.back(); }

  Small small;
  std::vector<double> x, y, width;
  ovt_map_def map;
  ovt_params params;
  std::vector<Seen> seen;
};

bool is_off_map(const Seen& s) { return (s.info.flags & OVT_FLAG_EGO_OFF_MAP) != 0; }

}  // namespace

TEST_CASE("all clear: an ego pose that jumps off the map hides no car, and each such frame has a flag") {
  for (const double jump_m : {0.0, 5.0, 9.0, 10.0, 10.1, 13.0, -40.0, 1e4, 1e8}) {
    CAPTURE(jump_m);
    Straight bench;
    bench.small.create();
    const double off_m = std::max(std::fabs(jump_m) - 8.0, 0.0);
    for (int64_t k = 0; k < 40; ++k) {
      const bool jumped = k >= 10 && k < 35;
      bench.push_pose(k * 50 * kMs, 0.0, jumped ? jump_m : 0.0);
      bench.push_car(k * 50 * kMs);
      const Seen& s = bench.last();
      CAPTURE(k);
      CHECK(s.broken == nullptr);
      CHECK(s.info.candidate_count == 1);
      CHECK(s.info.detection_count == 1);
      CHECK(is_off_map(s) == (jumped && off_m > 2.0));
      CHECK(s.info.ego_off_map_m == doctest::Approx(jumped ? off_m : 0.0));
      if (is_off_map(s)) CHECK(s.heading_ref.at(0) == 0.0f);
      CHECK((s.map_s.at(0) != 0.0f) == !is_off_map(s));
      if (k >= 5 && k < 10) CHECK(s.confirmed.size() == 1);
      if (k >= 16 && jumped) CHECK(!s.confirmed.empty());  // at the jumped pose there is a new track
    }
    CHECK(find_broken_sum(bench.small.stats(), -1, 0) == nullptr);
    CHECK(bench.small.stats().gated_map == 0);
    CHECK(bench.small.stats().detections == 40);
  }
}

TEST_CASE("all clear: a pose that jumps in the middle of a scan counts as off the map for the whole frame") {
  for (const double late_s : {0.0, 0.01, 0.03, 0.04}) {
    CAPTURE(late_s);
    Straight bench;
    bench.small.create();
    for (int64_t i = 0; i <= 5; ++i) bench.push_pose(i * 10 * kMs, 0.0, i >= 3 ? 30.0 : 0.0);
    bench.push_car(0, 20.0, late_s);  // the frame's stamp is 0, where the pose is still good
    CHECK(bench.last().broken == nullptr);
    CHECK(bench.last().info.detection_count == 1);
    CHECK(bench.last().info.gated_map == 0);
    CHECK(is_off_map(bench.last()) == (late_s > 0.02));
  }
}

TEST_CASE("all clear: a single pose off the map, anywhere in the scan, counts for the whole frame") {
  // Poses every 10 ms from 90 to 150 ms; the scan's stamp is 100 ms, its points are measured at 140 ms.
  for (int64_t off = 9; off <= 15; ++off) {
    CAPTURE(off);
    Straight bench;
    bench.small.create();
    for (int64_t i = 9; i <= 15; ++i) bench.push_pose(i * 10 * kMs, 0.0, i == off ? 30.0 : 0.0);
    bench.push_car(100 * kMs, 20.0, 0.04);
    const bool in_sweep = off >= 10 && off <= 14;
    CHECK(bench.last().broken == nullptr);
    CHECK(is_off_map(bench.last()) == in_sweep);
    CHECK(bench.last().info.ego_off_map_m == doctest::Approx(in_sweep ? 22.0 : 0.0));
    CHECK(bench.last().info.detection_count == 1);
  }
}

TEST_CASE("all clear: the margin around the map is a parameter, and also holds beyond an open end") {
  struct Row {
    double ego_margin_m, map_margin_m, x_m, y_m;
    double off_m;
    bool off;
  };
  for (const Row& row :
       {Row{2, 0, 0, 9.9, 1.9, false}, Row{2, 0, 0, -10.1, 2.1, true}, Row{0, 0, 0, 8.1, 0.1, true},
        Row{5, 0, 0, 12.9, 4.9, false}, Row{5, 0, 0, 13.1, 5.1, true}, Row{2, 6, 0, 13.9, 5.9, false},
        Row{2, 6, 0, 14.1, 6.1, true}, Row{2, 0, 2001.9, 7.0, 1.9, false}, Row{2, 0, 2002.1, 7.0, 2.1, true},
        Row{2, 0, -2002.1, -7.0, 2.1, true}, Row{6, 0, 2003, 12.0, 5.0, false}, Row{4.9, 0, -2003, -12.0, 5.0, true}}) {
    CAPTURE(row.x_m);
    CAPTURE(row.y_m);
    Straight bench;
    bench.params.gate_ego_margin_m = row.ego_margin_m;
    bench.params.gate_map_margin_m = row.map_margin_m;
    bench.small.create();
    bench.push_pose(0, row.x_m, row.y_m);
    bench.push_car(0);
    CHECK(bench.last().broken == nullptr);
    CHECK(bench.last().info.ego_off_map_m == doctest::Approx(row.off_m));
    CHECK(is_off_map(bench.last()) == row.off);
    if (row.off || row.x_m == 0) CHECK(bench.last().info.detection_count == 1);  // otherwise it is beyond the map's end
    ovt_stats stats = bench.small.stats();
    CHECK(stats.gated_map == stats.clusters - stats.gated_points - stats.gated_size - stats.detections);
  }
}

TEST_CASE("all clear: off the map a new track takes the ego course, not the course of some other place of the line") {
  for (const bool off : {false, true}) {
    Straight bench;
    bench.small.def.sensor_count = 0;
    bench.small.def.sensors = nullptr;
    struct Course {
      double first = kNan;
    } course;
    bench.small.def.user = &course;
    bench.small.def.on_frame = [](ovt_reader* reader, void* user) {
      ovt_tracks t;
      ovt_read_tracks(reader, OVT_AT_FRAME_STAMP, &t);
      if (t.count > 0) static_cast<Course*>(user)->first = t.course_rad[0];
    };
    bench.small.create();
    ovt_ego_pose pose = bench.pose(0, 0.0, off ? 50.0 : 0.0);
    pose.yaw_rad = 1.0;
    REQUIRE(ovt_push_ego_pose(bench.small.detector, &pose) == OVT_OK);
    const double x = 30, y = 1;
    ovt_external_detections d;
    ovt_external_detections_init(&d, sizeof d);
    d.count = 1, d.reference = OVT_REFERENCE_MAP, d.x_m = &x, d.y_m = &y;
    REQUIRE(ovt_push_detections(bench.small.detector, &d) == OVT_OK);
    CHECK(course.first == doctest::Approx(off ? 1.0 : 0.0));
  }
}

TEST_CASE("all clear: every cluster that is not a detection is counted with its reason") {
  Straight bench;
  bench.small.def.candidate_capacity = 16;
  bench.params.gate_min_points = 30;
  bench.small.create();
  bench.push_pose(0, 0, 0);
  // Posts of 24 points (too few); wider ones of 48 points, 18 on the track and 2 off it; and a wall of 12 m.
  const double degree = 3.14159265358979323846 / 180.0;
  std::vector<float> x, y, z;
  std::vector<uint8_t> layer;
  const auto add_post = [&](double azimuth_deg, double range_m, int32_t columns) {
    for (int32_t c = 0; c < columns; ++c)
      for (int32_t l = 0; l < 8; ++l) {
        const double azimuth = (azimuth_deg + 0.14 * c) * degree;
        x.push_back(float(range_m * std::cos(azimuth)));
        y.push_back(float(range_m * std::sin(azimuth)));
        z.push_back(float(range_m * std::tan((4.0 - l) * degree)));
        layer.push_back(uint8_t(l));
      }
  };
  for (int32_t i = 0; i < 4; ++i) add_post(-50.0 + 2.2 * i, 14.0 + 2 * i, 3);         // too few points
  for (int32_t i = 0; i < 18; ++i) add_post(-20.0 + 2.2 * i, 14.0 + 3 * (i % 2), 6);  // candidates on the track
  for (int32_t i = 0; i < 2; ++i) add_post(50.0 + 3 * i, 24.0 + 2 * i, 6);            // off the track
  add_post(24.0, 30.0, 160);                                                          // 12 m long
  ovt_points p;
  ovt_points_init(&p, sizeof p);
  p.count = int32_t(x.size());
  p.x = column_of(x, OVT_F32), p.y = column_of(y, OVT_F32), p.z = column_of(z, OVT_F32);
  p.layer = column_of(layer, OVT_U8);
  REQUIRE(ovt_push_scan(bench.small.detector, &p) == OVT_OK);
  const ovt_frame_info& info = bench.last().info;
  CHECK(bench.last().broken == nullptr);
  CHECK(info.cluster_count == 25);
  CHECK(info.gated_points == 4);
  CHECK(info.gated_size == 1);
  CHECK(info.candidate_count == 20);
  CHECK(info.gated_map == 2);
  CHECK(info.overflow_candidates == 2);
  CHECK(info.detection_count == 16);
  const ovt_stats s = bench.small.stats();
  CHECK(find_broken_sum(s, -1, 0) == nullptr);
  CHECK(s.clusters == 25);
  CHECK(s.gated_points == 4);
  CHECK(s.gated_size == 1);
  CHECK(s.gated_map == 2);
  CHECK(s.overflow_candidates == 2);
  CHECK(s.detections == 16);
  CHECK(s.measurements == 16);
}

TEST_CASE("all clear: ground points are the points without a reason and without a cluster") {
  Straight bench;
  bench.small.create();
  bench.push_car(0);
  const ovt_stats s = bench.small.stats();
  CHECK(find_broken_sum(s, -1, 0) == nullptr);
  CHECK(s.points_clustered > 100);
  CHECK(s.points - s.points_clustered > 1000);  // the road
}

TEST_CASE(
    "all clear: detections of frames without an ego pose are counted, and so is the reason for each track's end") {
  Straight bench(false);
  bench.params.tracker_max_silence_s = 0.5;
  bench.params.tracker_window = 4;
  bench.params.tracker_keep_hits = 0;  // a confirmed track ends only by silence
  bench.small.create();
  int64_t k = 0;
  const auto go = [&](int32_t frames, bool pose, bool car) {
    for (int32_t i = 0; i < frames; ++i, ++k) {
      if (pose) bench.push_pose(k * 50 * kMs, 0, 0);
      bench.push_car(k * 50 * kMs, car ? 20.0 : 400.0);
    }
  };
  go(5, false, true);  // vehicle frame
  CHECK(bench.small.stats().tracks_born == 1);
  go(5, true, true);  // in the map: deleted, and initiated again
  CHECK(bench.small.stats().tracks_forgotten == 1);
  CHECK(bench.small.stats().tracks_born == 2);
  CHECK(bench.small.stats().measurements_lost == 0);
  go(14, false, true);  // the gap is bridged for 0.5 s, then the poses are lost
  const int64_t lost = bench.small.stats().measurements_lost;
  CHECK(lost == 4);
  CHECK((bench.last().info.flags & OVT_FLAG_EGO_STALE) != 0);
  go(12, true, false);  // an empty road: silent
  CHECK(bench.small.stats().tracks_silent == 1);
  go(1, true, true);
  go(6, true, false);  // a tentative track is deleted after misses
  const ovt_stats s = bench.small.stats();
  CHECK(s.tracks_born == 3);
  CHECK(s.tracks_missed == 1);
  CHECK(s.tracks_silent == 1);
  CHECK(s.tracks_unsound == 0);
  CHECK(find_broken_sum(s, 0, 0) == nullptr);
  for (const Seen& seen : bench.seen) CHECK(seen.broken == nullptr);
}

TEST_CASE("all clear: a finite pose with values that no car's pose has is refused and changes nothing") {
  struct Row {
    double ovt_ego_pose::*field;
    double limit;
  };
  for (const Row& row :
       {Row{&ovt_ego_pose::x_m, 1e8}, Row{&ovt_ego_pose::y_m, 1e8}, Row{&ovt_ego_pose::z_m, 1e8},
        Row{&ovt_ego_pose::roll_rad, 1e6}, Row{&ovt_ego_pose::pitch_rad, 1e6}, Row{&ovt_ego_pose::yaw_rad, 1e6},
        Row{&ovt_ego_pose::speed_mps, 1e3}, Row{&ovt_ego_pose::yaw_rate_rps, 100}}) {
    CAPTURE(row.limit);
    for (const double sign : {-1.0, 1.0}) {
      Straight bench;
      bench.small.create();
      ovt_ego_pose pose = bench.pose(0, 0, 0);
      for (const double bad : {row.limit * 1.0001, 1e300, 1.7e308, kInfinity, kNan}) {
        CAPTURE(bad);
        pose.*row.field = sign * bad;
        CHECK(ovt_push_ego_pose(bench.small.detector, &pose) == OVT_BAD_ARGUMENT);
      }
      CHECK(bench.small.stats().ego_poses + bench.small.stats().ego_dropped == 0);
      pose.*row.field = sign * row.limit;
      CHECK(ovt_push_ego_pose(bench.small.detector, &pose) == OVT_OK);
      bench.push_car(450 * kMs);  // the farthest use of the last pose
      CHECK(bench.last().broken == nullptr);
      CHECK(bench.last().info.ego_known == 1);
    }
  }
}

TEST_CASE("all clear: maps with absurd numbers are refused") {
  for (const double bad : {1e9, 1e300, kInfinity, kNan}) {
    Straight bench;
    bench.width[3] = bad;
    ovt_detector* out = nullptr;
    CHECK(ovt_create_detector(&bench.small.def, &out) == OVT_BAD_ARGUMENT);
  }
}

namespace {

// Numbers of every kind: plausible, at a limit of the library, at an end of the type, NaN.
double draw_number(std::mt19937& random) {
  static constexpr double kOdd[] = {0.0,  -0.0, 1e-320, 1e-300, 1e8,  -1e8,     1.0001e8, 1e6,       1e3,       100,
                                    1e15, 1e18, 1e300,  -1e300, 3e38, 1.79e308, kNan,     kInfinity, -kInfinity};
  switch (random() % 4) {
    case 0: return kOdd[random() % std::size(kOdd)];
    case 1: return std::ldexp(double(random()) - 2147483648.0, int32_t(random() % 90) - 60);
    default: return (double(random() % 2001) - 1000) * 0.05;
  }
}
int64_t draw_stamp(std::mt19937& random, int64_t stamp_ns) {
  switch (random() % 24) {
    case 0: return INT64_MAX - int64_t(random() % 3);
    case 1: return INT64_MIN + int64_t(random() % 3);
    case 2: return overtake::later_ns(stamp_ns, -int64_t(random() % 700) * kMs);
    case 3: return stamp_ns;
    case 4: return 0;
    default: return int64_t(uint64_t(stamp_ns) + uint64_t(random() % 60) * uint64_t(kMs));  // wraps around at the end
  }
}

}  // namespace

TEST_CASE("all clear: for any input every public number is finite, and every loss has a count") {
  int64_t frames = 0, detections = 0, tracks = 0, off_map = 0, gated = 0;
  for (uint32_t seed = 1; seed <= 150; ++seed) {
    std::mt19937 random(seed);
    Straight bench(random() % 3 != 0);
    bench.small.sensor.rows = 1 + int32_t(random() % 8);
    bench.small.sensor.cols = 1 + int32_t(random() % 60);
    bench.small.sensor.wraps = random() % 4 == 0;
    if (random() % 8 == 0) bench.small.sensor.azimuth_right_rad = bench.small.sensor.wraps ? draw_number(random) : -1;
    bench.small.sensor.point_capacity = 400;
    bench.small.def.cluster_capacity = 1 + int32_t(random() % 20);
    bench.small.def.candidate_capacity = 1 + int32_t(random() % 6);
    bench.small.def.track_capacity = 1 + int32_t(random() % 6);
    bench.small.def.keep_images = random() % 2;
    if (random() % 2) bench.params.gate_ego_margin_m = double(random() % 30);
    bench.width.assign(bench.x.size(), 2.0 + 3.0 * double(random() % 3));
    bench.small.create();
    int64_t stamp_ns = random() % 4 ? 1000 * kMs : draw_stamp(random, 0);
    // Rows per push in this run. One push may still be pending, so only the number of used pushes is known.
    const auto push_rows = int32_t(random() % 5);
    const bool wild = random() % 2;
    for (int32_t step = 0; step < 60; ++step) {
      const uint32_t what = random() % 16;
      if (what < 8) {
        stamp_ns = draw_stamp(random, stamp_ns);
        std::vector<float> x, y, z;
        std::vector<uint8_t> layer;
        const auto rows = bench.small.sensor.rows;
        for (int32_t i = 0; i < 200; ++i) {
          const double azimuth = 1.0 - 2.0 * (i / rows) * double(rows) / 200, range = 12 + 8 * (i / rows / 4 % 4);
          x.push_back(float(range * std::cos(azimuth)));
          y.push_back(float(range * std::sin(azimuth)));
          z.push_back(float(range * 0.03 * (2 - i % rows)));
          layer.push_back(uint8_t(i % rows));
          if (wild && random() % 16 == 0) (random() % 2 ? x : z).back() = float(draw_number(random));
        }
        std::vector<double> time(x.size());
        for (double& t : time) t = wild ? draw_number(random) : 0.001 * double(random() % 50);
        ovt_points p;
        ovt_points_init(&p, sizeof p);
        p.count = int32_t(x.size());
        p.stamp_ns = stamp_ns;
        p.x = column_of(x, OVT_F32), p.y = column_of(y, OVT_F32), p.z = column_of(z, OVT_F32);
        p.intensity = column_of(z, OVT_F32);
        p.layer = column_of(layer, OVT_U8);
        p.time = column_of(time, OVT_F64);
        p.time_unit_ns = random() % 8 ? 1e9 : draw_number(random);
        ovt_push_scan(bench.small.detector, &p);
      } else if (what < 11) {
        ovt_ego_pose pose =
            bench.pose(draw_stamp(random, stamp_ns), double(random() % 60), double(random() % (random() % 2 ? 30 : 3)));
        if (wild)
          for (double* v : {&pose.x_m, &pose.y_m, &pose.z_m, &pose.roll_rad, &pose.pitch_rad, &pose.yaw_rad,
                            &pose.speed_mps, &pose.yaw_rate_rps})
            if (random() % 4 == 0) *v = draw_number(random);
        ovt_push_ego_pose(bench.small.detector, &pose);
      } else if (what < 14) {
        double column[6][4];
        for (auto& values : column)
          for (double& v : values) v = draw_number(random);
        ovt_external_detections d;
        ovt_external_detections_init(&d, sizeof d);
        d.count = push_rows;
        d.stamp_ns = draw_stamp(random, stamp_ns);
        d.reference = int32_t(random() % 2);
        d.x_m = column[0], d.y_m = column[1];
        if (random() % 2) d.heading_rad = column[2];
        if (random() % 2) d.var_x = column[3], d.var_y = column[4];
        if (random() % 2) d.cov_xy = column[5];
        ovt_push_detections(bench.small.detector, &d);
      } else {
        ovt_advance(bench.small.detector, draw_stamp(random, stamp_ns));
      }
    }
    REQUIRE(ovt_flush(bench.small.detector) == OVT_OK);
    CAPTURE(seed);
    for (const Seen& s : bench.seen) {
      CAPTURE(s.info.sequence);
      CHECK(std::string(s.broken ? s.broken : "") == "");
      detections += s.info.detection_count;
      tracks += s.info.track_count;
      off_map += is_off_map(s);
      gated += s.info.gated_map;
    }
    frames += int64_t(bench.seen.size());
    const char* broken = find_broken_sum(bench.small.stats(), -1, bench.small.stats().external * push_rows);
    CHECK(std::string(broken ? broken : "") == "");
  }
  CHECK(frames > 2000);  // else the test would check nothing
  CHECK(detections > 900);
  CHECK(tracks > 1000);
  CHECK(off_map > 100);
  CHECK(gated > 50);
}
