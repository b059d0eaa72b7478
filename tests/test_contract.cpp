// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// Guarantees under faults of time and of the ego pose, end to end through the C API. tests/README.md lists the test of
// each guarantee.
#include <doctest/doctest.h>

#include <cmath>
#include <cstring>
#include <vector>

#include "tests/support/detector_bench.h"
#include "tests/support/test_method.h"

using namespace overtake::test;

namespace {

constexpr int64_t kMs = 1'000'000;

struct Seen {
  ovt_frame_info info{};
  std::vector<uint64_t> ids, detection_tracks;
  std::vector<double> x, y, speed, var_x;
  std::vector<uint32_t> flags;
  std::vector<int32_t> age;
};

struct Watched : DetectorBench {
  explicit Watched(const Options& options) : DetectorBench(options) {
    def.user = this;
    def.on_frame = [](ovt_reader* reader, void* user) {
      Seen s;
      ovt_tracks t;
      ovt_detections d;
      ovt_read_info(reader, &s.info);
      ovt_read_tracks(reader, OVT_AT_FRAME_STAMP, &t);
      ovt_read_detections(reader, &d);
      s.ids.assign(t.id, t.id + t.count);
      s.detection_tracks.assign(d.track, d.track + d.count);
      s.x.assign(t.x_m, t.x_m + t.count);
      s.y.assign(t.y_m, t.y_m + t.count);
      s.speed.assign(t.speed_mps, t.speed_mps + t.count);
      s.var_x.assign(t.covariance[0], t.covariance[0] + t.count);
      s.flags.assign(t.flags, t.flags + t.count);
      s.age.assign(t.age, t.age + t.count);
      static_cast<Watched*>(user)->seen.push_back(std::move(s));
    };
  }
  // One detection from another detector.
  void push_place(int64_t stamp_ns, double x, double y, int32_t reference = OVT_REFERENCE_MAP) {
    ovt_external_detections d;
    ovt_external_detections_init(&d, sizeof d);
    d.stamp_ns = stamp_ns;
    d.count = 1;
    d.reference = reference;
    d.x_m = &x;
    d.y_m = &y;
    REQUIRE(ovt_push_detections(detector, &d) == OVT_OK);
  }
  const Seen& last() const { return seen.back(); }
  std::vector<Seen> seen;
};

}  // namespace

TEST_CASE("contract: over a gap of 0.2 to 1 s a track is predicted in steps of at most 50 ms, and continues") {
  for (const int64_t gap_ms : {200, 500, 1000}) {
    CAPTURE(gap_ms);
    Watched gap({.workers = 1, .map = false}), stepped({.workers = 1, .map = false});  // it follows no lane
    for (Watched* bench : {&gap, &stepped}) {
      bench->create();
      for (int64_t k = 0; k < 20; ++k) bench->push_place(k * 50 * kMs, 100 + 0.5 * double(k), 50);
    }
    const int64_t last_ns = 19 * 50 * kMs, after_ns = last_ns + gap_ms * kMs;
    const uint64_t id = gap.last().ids.at(0);
    for (int64_t t = last_ns + 50 * kMs; t < after_ns; t += 50 * kMs) ovt_advance(stepped.detector, t);
    for (Watched* bench : {&gap, &stepped}) {
      bench->push_place(after_ns, 100 + 10 * double(after_ns) * 1e-9, 50);
      REQUIRE(bench->last().ids.size() == 1);
      CHECK(bench->last().ids[0] == id);
      CHECK((bench->last().info.flags & OVT_FLAG_CLOCK_JUMP) == 0);
      CHECK(bench->last().age[0] == 21);  // no misses in between: no sensor could see it
    }
    // A call of ovt_advance changes nothing, and the covariance grew as in steps.
    CHECK(gap.last().x == stepped.last().x);
    CHECK(gap.last().var_x == stepped.last().var_x);
    CHECK(std::fabs(gap.last().speed[0] - 10) < 5);
  }
}

// The compared run gets the frames that the gap lacks, 50 ms apart, in which no sensor saw the car.
TEST_CASE("contract: the covariance after a gap equals that after as many steps of 50 ms") {
  for (const int64_t gap_ms : {200, 500, 1000}) {
    CAPTURE(gap_ms);
    Watched gap({.workers = 1}), stepped({.workers = 1});
    for (Watched* bench : {&gap, &stepped}) {
      bench->params.tracker_keep_hits = 0;
      bench->create();
      for (int64_t k = 0; k < 20; ++k) bench->push_place(k * 50 * kMs, 100 + 0.5 * double(k), 50 + 0.05 * double(k));
    }
    const int64_t last_ns = 19 * 50 * kMs, after_ns = last_ns + gap_ms * kMs;
    ovt_external_detections none;
    ovt_external_detections_init(&none, sizeof none);
    none.reference = OVT_REFERENCE_MAP;
    for (none.stamp_ns = last_ns + 50 * kMs; none.stamp_ns < after_ns; none.stamp_ns += 50 * kMs)
      REQUIRE(ovt_push_detections(stepped.detector, &none) == OVT_OK);
    CHECK(stepped.seen.size() == 20 + std::size_t(gap_ms / 50) - 1);
    none.stamp_ns = after_ns;
    for (Watched* bench : {&gap, &stepped}) {
      REQUIRE(ovt_push_detections(bench->detector, &none) == OVT_OK);
      REQUIRE(bench->last().ids.size() == 1);
    }
    const Seen &a = gap.last(), &b = stepped.last();
    CHECK(a.x[0] == doctest::Approx(b.x[0]).epsilon(1e-9));
    CHECK(a.var_x[0] == doctest::Approx(b.var_x[0]).epsilon(1e-6));
    CHECK(a.var_x[0] > 1.05 * gap.seen[19].var_x[0]);
  }
}

TEST_CASE("contract: a longer gap is a clock jump, and the earlier track does not return") {
  Watched bench({.workers = 1, .map = false});
  bench.def.sensor_count = 0;
  bench.def.sensors = nullptr;
  bench.create();
  for (int64_t k = 0; k < 20; ++k) bench.push_place(k * 50 * kMs, 100, 50);
  const uint64_t id = bench.last().ids.at(0);
  const std::size_t frames = bench.seen.size();
  for (int64_t k = 0; k < 3; ++k) bench.push_place(19 * 50 * kMs + 1001 * kMs + k * 50 * kMs, 100, 50);
  REQUIRE(bench.seen.size() == frames + 1);
  CHECK((bench.last().info.flags & OVT_FLAG_CLOCK_JUMP) != 0);
  REQUIRE(bench.last().ids.size() == 1);
  CHECK(bench.last().ids[0] != id);
  CHECK(bench.last().age[0] == 1);
}

TEST_CASE("contract: the use of an ego pose is reduced in steps with its age") {
  struct Row {
    int64_t age_ms;
    bool stale, map_gate, detections_tracked;
  };
  // A frame's scans, and the poses up to `age_ms` before it.
  for (const Row row : {Row{0, false, true, true}, Row{20, false, true, true}, Row{90, false, true, true},
                        Row{110, true, false, true}, Row{490, true, false, true}, Row{510, true, false, false}}) {
    CAPTURE(row.age_ms);
    Watched bench({.workers = 1});
    bench.create();
    for (int32_t i = 0; i < 5; ++i) {
      ovt_ego_pose pose;
      ovt_ego_pose_init(&pose, sizeof pose);
      pose.stamp_ns = demo_frame(0).stamp_ns - (row.age_ms + 40 - 10 * i) * kMs;
      const overtake::ScenePose p = demo_scene().ego_at(double(pose.stamp_ns) * 1e-9);
      pose.x_m = p.x_m, pose.y_m = p.y_m, pose.z_m = p.z_m;
      pose.roll_rad = p.roll_rad, pose.pitch_rad = p.pitch_rad, pose.yaw_rad = p.yaw_rad;
      pose.speed_mps = p.speed_mps, pose.yaw_rate_rps = p.yaw_rate_rps;
      REQUIRE(ovt_push_ego_pose(bench.detector, &pose) == OVT_OK);
    }
    // From here on the tracker works in the map: a first frame with poses in reach.
    bench.push_place(demo_frame(0).stamp_ns - (row.age_ms + 10) * kMs, -1e4, -1e4);
    bench.push_frame(0, {0, 1, 2}, false);
    const Seen& s = bench.last();
    CHECK(((s.info.flags & OVT_FLAG_EGO_STALE) != 0) == row.stale);
    CHECK(s.info.ego_known == (row.detections_tracked ? 1 : 0));
    CHECK(s.info.reference == OVT_REFERENCE_MAP);
    CHECK(s.info.candidate_count > 0);
    // Without the map, `best` still drops what it sees at a wall, and counts it as gated by the map.
    const int32_t at_walls = std::strcmp(overtake::test::test_method(), "best") == 0 ? s.info.gated_map : 0;
    if (!row.map_gate) CHECK(s.info.detection_count == s.info.candidate_count - s.info.gated_range - at_walls);
    bool tracked = false;
    for (const uint64_t track : s.detection_tracks) tracked |= track != 0;
    CHECK(tracked == row.detections_tracked);
  }
}

TEST_CASE("contract: beyond 20 ms the age of the ego pose adds to a new track's covariance") {
  double before = 0;
  for (const int64_t age_ms : {0, 20, 21, 60, 100}) {
    CAPTURE(age_ms);
    Watched bench({.workers = 1});
    bench.create();
    ovt_ego_pose pose;
    ovt_ego_pose_init(&pose, sizeof pose);
    const overtake::ScenePose p = demo_scene().ego_at(double(demo_frame(0).stamp_ns) * 1e-9);
    pose.stamp_ns = demo_frame(0).stamp_ns - age_ms * kMs;
    pose.x_m = p.x_m, pose.y_m = p.y_m, pose.z_m = p.z_m, pose.yaw_rad = p.yaw_rad;
    REQUIRE(ovt_push_ego_pose(bench.detector, &pose) == OVT_OK);
    bench.push_place(demo_frame(0).stamp_ns, 30, 2, OVT_REFERENCE_VEHICLE);
    REQUIRE(bench.last().var_x.size() == 1);
    const double variance = bench.last().var_x[0];
    if (age_ms <= 20)
      CHECK(variance == doctest::Approx(bench.params.tracker_r_x).epsilon(1e-12));
    else
      CHECK(variance > before);
    before = variance;
  }
}
