// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// Detections of another detector, pushed through the C API: both reference frames, covariances, counters.
#include <doctest/doctest.h>

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <limits>
#include <random>
#include <vector>

#include "tests/support/one_sensor_detector.h"

using namespace overtake::test;

namespace {

constexpr int64_t kMs = 1'000'000;

ovt_status push_places(Small& small, int64_t stamp_ns, const std::vector<double>& x, const std::vector<double>& y) {
  ovt_external_detections d;
  ovt_external_detections_init(&d, sizeof d);
  d.stamp_ns = stamp_ns;
  d.count = int32_t(x.size());
  d.reference = OVT_REFERENCE_MAP;
  d.x_m = x.data();
  d.y_m = y.data();
  return ovt_push_detections(small.detector, &d);
}

}  // namespace

TEST_CASE("detector: pushed rows up to the def's capacity are used, more are refused and counted") {
  for (const int32_t capacity : {1, 4, 16, 20}) {
    CAPTURE(capacity);
    Small small(0);
    small.def.candidate_capacity = capacity;
    small.create();
    std::vector<double> x(std::size_t(capacity) + 1), y(x.size());
    for (std::size_t i = 0; i < x.size(); ++i) x[i] = 30.0 * double(i);
    CHECK(push_places(small, 1, x, y) == OVT_TOO_MANY);
    CHECK(small.stats().external_dropped == 1);
    x.pop_back();
    CHECK(push_places(small, 1, x, y) == OVT_OK);  // the refused push's stamp is not used up
    const ovt_stats stats = small.stats();
    CHECK(stats.external == 1);
    CHECK(stats.external_dropped == 1);
    CHECK(stats.measurements == capacity);
    CHECK(stats.overflow_tracks == 0);
    CHECK(small.latest.info.track_count == capacity);
  }
}

TEST_CASE("detector: tracks have the length and width of the rows that were pushed, with every method") {
  constexpr double kNotThere = std::numeric_limits<double>::quiet_NaN();
  for (const char* method : {"paper", "best"}) {
    CAPTURE(method);
    Small small(0);
    small.create(method);
    const double x[] = {20, 50, 80}, y[] = {0, 0, 0};
    const double length[] = {4.6, kNotThere, 3.1}, width[] = {1.9, 1.7, kNotThere}, height[] = {1.2, 1.1, kNotThere};
    ovt_external_detections d;
    ovt_external_detections_init(&d, sizeof d);
    d.count = 3, d.reference = OVT_REFERENCE_MAP;
    d.x_m = x, d.y_m = y;
    for (const bool sized : {true, false}) {
      d.length_m = sized ? length : nullptr, d.width_m = sized ? width : nullptr, d.height_m = sized ? height : nullptr;
      d.stamp_ns += 50 * kMs;
      REQUIRE(ovt_push_detections(small.detector, &d) == OVT_OK);
      const ovt_tracks t = small.next_tracks();
      REQUIRE(t.count == 3);
      for (int32_t i = 0; i < 3; ++i) {  // the second push has none: those of the first stay
        CHECK(t.length_m[i] == (length[i] > 0 ? length[i] : 0));
        CHECK(t.width_m[i] == (width[i] > 0 ? width[i] : 0));
      }
    }
  }
}

TEST_CASE("detector: the score of pushed rows is that of a new track; a score that is none counts as not given") {
  Small small(0);
  small.create("best");
  const double x[] = {20, 40, 60, 80, 100, 120}, y[6] = {};
  const double score[] = {0.7, 0.3, 1.0, 1.5, -0.5, std::numeric_limits<double>::quiet_NaN()};
  const double existence[] = {0.7, 0.3, 0.8808, 0.73106, 0.73106, 0.73106};
  ovt_external_detections d;
  ovt_external_detections_init(&d, sizeof d);
  d.count = 6, d.reference = OVT_REFERENCE_MAP, d.x_m = x, d.y_m = y, d.score = score;
  REQUIRE(ovt_push_detections(small.detector, &d) == OVT_OK);
  const ovt_tracks t = small.next_tracks();
  REQUIRE(t.count == 6);
  for (int32_t i = 0; i < 6; ++i) CHECK(t.existence[i] == doctest::Approx(existence[i]).epsilon(1e-4));
}

TEST_CASE("detector: values of pushed rows that no car can have count as not measured, and are counted") {
  constexpr double kNan = std::numeric_limits<double>::quiet_NaN(), kInf = std::numeric_limits<double>::infinity();
  Small small(0);
  small.create();
  const double x[] = {20, 40, 60}, y[3] = {}, heading[] = {0.1, kNan, 100};
  int64_t stamp_ns = 0;
  const auto ignored = [&](void (*change)(ovt_external_detections&, double*), double a, double b, double c) {
    double values[] = {a, b, c};
    const double variance[] = {1, 1, 1};
    ovt_external_detections d;
    ovt_external_detections_init(&d, sizeof d);
    d.stamp_ns = stamp_ns += 50 * kMs;
    d.count = 3, d.reference = OVT_REFERENCE_MAP, d.x_m = x, d.y_m = y, d.heading_rad = heading;
    d.var_x = d.var_y = variance;
    change(d, values);
    const int64_t before = small.stats().row_values_ignored;
    REQUIRE(ovt_push_detections(small.detector, &d) == OVT_OK);
    REQUIRE(ovt_flush(small.detector) == OVT_OK);
    return small.stats().row_values_ignored - before;
  };
  using D = ovt_external_detections;
  CHECK(ignored([](D&, double*) {}, 0, 0, 0) == 0);
  CHECK(ignored([](D& d, double* v) { d.score = v; }, 0, kNan, 1) == 0);
  CHECK(ignored([](D& d, double* v) { d.score = v; }, -0.1, 95, kInf) == 3);
  CHECK(ignored([](D& d, double* v) { d.heading_rad = v; }, kInf, -2e6, 3) == 2);
  CHECK(ignored([](D& d, double* v) { d.length_m = v; }, -1, 0, 1e9) == 2);
  CHECK(ignored([](D& d, double* v) { d.width_m = v; }, kInf, 2, kNan) == 1);
  CHECK(ignored([](D& d, double* v) { d.height_m = v; }, -2e3, 1.5, 1e9) == 2);
  CHECK(ignored([](D& d, double* v) { d.var_x = v; }, 0, -1, 4) == 2);
  CHECK(ignored([](D& d, double* v) { d.cov_xy = v; }, 0.5, 2, kNan) == 1);
  CHECK(small.stats().measurements_rejected == 0);
}

namespace {

struct Axes {
  double course_rad = 0, heading_rad = 0;
};

// Of the one track of a car that drives along x, after `rows` rows of it; heading: of each row, null none.
Axes track_rows(const char* method, int32_t rows, double speed_mps, const double* heading) {
  Small small(0);
  small.create(method);
  const double y = 0, var = 0.04;
  ovt_tracks t;
  for (int32_t k = 0; k < rows; ++k) {
    const double x = 30 + speed_mps * 0.05 * k;
    ovt_external_detections d;
    ovt_external_detections_init(&d, sizeof d);
    d.stamp_ns = k * 50 * kMs, d.count = 1, d.reference = OVT_REFERENCE_MAP;
    d.x_m = &x, d.y_m = &y, d.var_x = d.var_y = &var, d.heading_rad = heading;
    REQUIRE(ovt_push_detections(small.detector, &d) == OVT_OK);
    t = small.next_tracks();
  }
  REQUIRE(t.count == 1);
  return {t.course_rad[0], t.heading_rad[0]};
}

}  // namespace

TEST_CASE("detector: with every method the track of a car that slides has the heading of its pushed rows") {
  const double heading = 0.4;
  for (const char* method : {"paper", "best"})
    for (const bool given : {true, false}) {
      CAPTURE(method);
      CAPTURE(given);
      const Axes axes = track_rows(method, 40, 30, given ? &heading : nullptr);
      CHECK(std::fabs(axes.course_rad) < 0.05);
      CHECK(axes.heading_rad == doctest::Approx(given ? heading : axes.course_rad).epsilon(0.05));
    }
}

TEST_CASE("detector: a car that stands has the heading of its pushed rows, whichever way it points") {
  for (const double heading : {0.0, 2.5, -3.0}) {
    CAPTURE(heading);
    CHECK(track_rows("best", 10, 0, &heading).heading_rad == doctest::Approx(heading).epsilon(0.05));
  }
}

TEST_CASE("detector: an older caller's pushed rows end before the length, which is not read") {
  Small small(0);
  small.create();
  const double place[] = {30};
  ovt_external_detections d;
  constexpr std::size_t kOlder = offsetof(ovt_external_detections, length_m);
  std::memset(static_cast<void*>(&d), 0x5a, sizeof d);
  CHECK(ovt_external_detections_init(&d, kOlder - 8) == OVT_BAD_VERSION);
  REQUIRE(ovt_external_detections_init(&d, kOlder) == OVT_OK);
  CHECK(d.struct_size == kOlder);
  CHECK(reinterpret_cast<std::uintptr_t>(d.length_m) == 0x5a5a5a5a5a5a5a5a);
  d.count = 1, d.x_m = d.y_m = place, d.reference = OVT_REFERENCE_MAP;
  CHECK(ovt_push_detections(small.detector, &d) == OVT_OK);
  CHECK(small.stats().measurements_used == 1);
  d.struct_size = sizeof d + 8;
  CHECK(ovt_push_detections(small.detector, &d) == OVT_BAD_VERSION);
}

TEST_CASE("detector: a late frame in dense clutter meets the work limit: flagged, counted, tracks unchanged") {
  for (const int32_t workers : {1, 2}) {
    Small small(0, workers);
    small.create();
    std::mt19937_64 random(3);
    std::vector<double> x(256), y(256);
    const auto push = [&](int64_t stamp_ns) {
      for (std::size_t i = 0; i < x.size(); ++i)
        x[i] = 6e-3 * double(random() % 1000), y[i] = 6e-3 * double(random() % 1000);
      REQUIRE(push_places(small, stamp_ns, x, y) == OVT_OK);
      REQUIRE(ovt_flush(small.detector) == OVT_OK);
    };
    for (int64_t k = 0; k < 12; ++k) push(k * 50 * kMs);
    CHECK((small.latest.info.flags & OVT_FLAG_WORK_LIMIT) == 0);
    CHECK(small.stats().work_limited == 0);
    push(151 * kMs);
    const ovt_frame_info info = small.latest.info;
    CHECK((info.flags & OVT_FLAG_OUT_OF_SEQUENCE) != 0);
    CHECK((info.flags & OVT_FLAG_WORK_LIMIT) != 0);
    CHECK(info.refiltered == 0);
    CHECK(info.track_count == 256);
    const ovt_stats stats = small.stats();
    CHECK(stats.work_limited == 1);
    CHECK(stats.refiltered == 0);
    CHECK(stats.measurements_late == 256);
    CHECK(stats.measurements == 13 * 256);
    CHECK(stats.measurements ==
          stats.measurements_used + stats.measurements_unborn + stats.measurements_rejected + stats.measurements_late);
    push(12 * 50 * kMs);
    CHECK((small.latest.info.flags & OVT_FLAG_WORK_LIMIT) == 0);
  }
}

TEST_CASE("detector: a frame whose association the work limit shortens is flagged and counted") {
  for (const double limit : {1e4, 1e7}) {
    CAPTURE(limit);
    const bool cut = limit < 1e7;
    ovt_params params = ovt_default_params();
    params.tracker_work_limit = limit;
    Small small(0);
    small.def.params = &params;
    small.create();
    std::mt19937_64 random(3);
    std::vector<double> x(100), y(100);
    for (int64_t k = 0; k < 6; ++k) {
      CAPTURE(k);
      for (std::size_t i = 0; i < x.size(); ++i)
        x[i] = 6e-3 * double(random() % 1000), y[i] = 6e-3 * double(random() % 1000);
      REQUIRE(push_places(small, k * 50 * kMs, x, y) == OVT_OK);
      CHECK((small.latest.info.flags & OVT_FLAG_OUT_OF_SEQUENCE) == 0);
      // The first frame has no track to associate with.
      CHECK(((small.latest.info.flags & OVT_FLAG_WORK_LIMIT) != 0) == (cut && k > 0));
      CHECK(small.stats().work_limited == (cut ? k : 0));
    }
    CHECK(small.stats().measurements_late == 0);
  }
}

TEST_CASE("detector: a push without a track's car is a miss, and enough misses delete the track") {
  Small small(0);
  small.create();
  ovt_tracks t;
  const auto push = [&](int64_t k, const std::vector<double>& x, const std::vector<double>& y) {
    REQUIRE(push_places(small, k * 50 * kMs, x, y) == OVT_OK);
    t = small.next_tracks();
  };
  push(0, {30.0}, {5.0});
  REQUIRE(t.count == 1);
  CHECK(t.flags[0] == 0);
  // A track with one hit can still reach six hits by age 20 at age 15, but not at age 16.
  for (int64_t k = 1; k < 15; ++k) {
    CAPTURE(k);
    push(k, {}, {});
    REQUIRE(t.count == 1);
    CHECK((t.flags[0] & (OVT_TRACK_COASTING | OVT_TRACK_UNOBSERVED)) == OVT_TRACK_COASTING);
    CHECK(t.age[0] == k + 1);
  }
  push(15, {}, {});
  CHECK(t.count == 0);
  CHECK(small.stats().tracks_missed == 1);
  CHECK(small.stats().tracks_silent == 0);
}

TEST_CASE(
    "detector: a scan observes what is ahead of the sensor at any heading of the vehicle in the map, an empty one "
    "nothing") {
  for (const double yaw : {-2.5, -1.5707963267948966, 0.0, 0.7, 1.5707963267948966, 3.0})
    for (const bool is_empty : {false, true}) {
      CAPTURE(yaw);
      CAPTURE(is_empty);
      Small small;  // sees 60 degrees to either side
      small.create();
      const auto push_pose = [&](int64_t stamp_ns) {
        ovt_ego_pose pose;
        ovt_ego_pose_init(&pose, sizeof pose);
        pose.stamp_ns = stamp_ns;
        pose.x_m = 100, pose.y_m = -40, pose.yaw_rad = yaw;
        REQUIRE(ovt_push_ego_pose(small.detector, &pose) == OVT_OK);
      };
      // Two cars, 20 m ahead and 20 m to the right of the vehicle; then a scan that contains neither.
      const double c = 20 * std::cos(yaw), s = 20 * std::sin(yaw);
      const uint32_t coasting = OVT_TRACK_COASTING, unobserved = OVT_TRACK_UNOBSERVED;
      push_pose(0);
      REQUIRE(push_places(small, 0, {100 + c, 100 + s}, {-40 + s, -40 - c}) == OVT_OK);
      push_pose(50 * kMs);
      const float far_m = 60, level_m = 0;
      const uint8_t layer = 0;
      ovt_points point;
      ovt_points_init(&point, sizeof point);
      point.stamp_ns = 50 * kMs;
      point.count = is_empty ? 0 : 1;
      point.x = {&far_m, 4, 4, OVT_F32}, point.y = point.z = {&level_m, 4, 4, OVT_F32};
      point.layer = {&layer, 1, 1, OVT_U8};
      REQUIRE(ovt_push_scan(small.detector, &point) == OVT_OK);
      const ovt_tracks t = small.next_tracks();
      REQUIRE(t.count == 2);
      for (int32_t i = 0; i < 2; ++i) {
        const bool ahead = !is_empty && std::hypot(t.x_m[i] - (100 + c), t.y_m[i] - (-40 + s)) < 4;
        CAPTURE(ahead);
        CHECK(t.flags[i] == (ahead ? coasting : coasting | unobserved));
        CHECK(t.age[i] == (ahead ? 2 : 1));
      }
    }
}

TEST_CASE("detector: tracks read for an absurd time report the time that they are predicted to") {
  Small small(0);
  small.create();
  for (int64_t k = 0; k < 4; ++k) REQUIRE(push_places(small, k * 50 * kMs, {30.0 + 2.0 * double(k)}, {5.0}) == OVT_OK);
  ovt_reader* reader = nullptr;
  REQUIRE(ovt_create_reader(small.detector, &reader) == OVT_OK);
  REQUIRE(ovt_next_frame(reader, nullptr) == OVT_OK);
  const int64_t frame_ns = small.latest.info.tracks_stamp_ns, most_ns = 59'000 * kMs;
  ovt_tracks t;
  const auto x_at = [&](int64_t publish_ns, int64_t expected_ns) {
    REQUIRE(ovt_read_tracks(reader, publish_ns, &t) == OVT_OK);
    CHECK(t.publish_ns == expected_ns);
    REQUIRE(t.count == 1);
    return t.x_m[0];
  };
  const double farthest = x_at(frame_ns + most_ns, frame_ns + most_ns);
  CHECK(x_at(INT64_MAX, frame_ns + most_ns) == farthest);
  CHECK(x_at(frame_ns + most_ns + 1, frame_ns + most_ns) == farthest);
  CHECK(x_at(frame_ns + most_ns - kMs, frame_ns + most_ns - kMs) != farthest);
  const double earliest = x_at(frame_ns - most_ns, frame_ns - most_ns);
  CHECK(x_at(INT64_MIN + 1, frame_ns - most_ns) == earliest);
  x_at(OVT_AT_FRAME_STAMP, frame_ns);
  ovt_destroy_reader(reader);
}

TEST_CASE("detector: pushed detections in the map and in the vehicle frame give the same tracks, without any LiDAR") {
  for (const int32_t workers : {1, 2}) {
    double x[2] = {}, y[2] = {}, speed[2] = {};
    for (const int32_t reference : {OVT_REFERENCE_MAP, OVT_REFERENCE_VEHICLE}) {
      Small small(0, workers);
      small.def.push_policy = OVT_PUSH_WAIT;
      small.create();
      for (int32_t k = 0; k < 30; ++k) {
        const int64_t stamp_ns = 1 + k * 50 * kMs;
        ovt_ego_pose pose;
        ovt_ego_pose_init(&pose, sizeof pose);
        pose.stamp_ns = stamp_ns;
        pose.x_m = 100 + 2.5 * k, pose.y_m = -30, pose.yaw_rad = 0.4, pose.speed_mps = 50;
        REQUIRE(ovt_push_ego_pose(small.detector, &pose) == OVT_OK);
        const double map_x = 120 + 2 * k, map_y = 10 + k;
        const double dx = map_x - pose.x_m, dy = map_y - pose.y_m, c = std::cos(0.4), s = std::sin(0.4);
        const bool in_map = reference == OVT_REFERENCE_MAP;
        const double px = in_map ? map_x : c * dx + s * dy, py = in_map ? map_y : -s * dx + c * dy;
        ovt_external_detections d;
        ovt_external_detections_init(&d, sizeof d);
        d.stamp_ns = stamp_ns;
        d.count = 1;
        d.reference = reference;
        d.x_m = &px;
        d.y_m = &py;
        CHECK(ovt_push_detections(small.detector, &d) == OVT_OK);
        CHECK(ovt_push_detections(small.detector, &d) == OVT_DUPLICATE);
      }
      CHECK(ovt_flush(small.detector) == OVT_OK);
      const ovt_tracks tracks = small.next_tracks();
      CHECK(small.latest.info.reference == OVT_REFERENCE_MAP);
      CHECK((small.latest.info.flags & OVT_FLAG_EXTERNAL) != 0);
      CHECK(small.latest.calls == 30);
      REQUIRE(tracks.count == 1);
      CHECK(tracks.state[0] == OVT_CONFIRMED);
      x[reference] = tracks.x_m[0], y[reference] = tracks.y_m[0], speed[reference] = tracks.speed_mps[0];
    }
    CHECK(x[0] == doctest::Approx(x[1]).epsilon(1e-9));
    CHECK(y[0] == doctest::Approx(y[1]).epsilon(1e-9));
    CHECK(x[1] == doctest::Approx(178).epsilon(0.01));
    CHECK(y[1] == doctest::Approx(39).epsilon(0.05));
    CHECK(speed[1] == doctest::Approx(20 * std::sqrt(5.0)).epsilon(0.03));
    CHECK(speed[0] == doctest::Approx(speed[1]).epsilon(1e-9));
  }
}

TEST_CASE("detector: variances of a pushed detection are enough, and rotate with the vehicle") {
  const double at = 5, var_x = 0.04, var_y = 1.0, quarter = 1.5707963267948966;
  for (const bool turned : {false, true}) {
    Small small(0);
    small.create();
    if (turned) {
      ovt_ego_pose pose;
      ovt_ego_pose_init(&pose, sizeof pose);
      pose.yaw_rad = quarter;
      REQUIRE(ovt_push_ego_pose(small.detector, &pose) == OVT_OK);
    }
    ovt_external_detections d;
    ovt_external_detections_init(&d, sizeof d);
    d.count = 1;
    d.x_m = d.y_m = &at;
    d.var_x = &var_x;
    d.var_y = &var_y;
    REQUIRE(ovt_push_detections(small.detector, &d) == OVT_OK);
    const ovt_tracks tracks = small.next_tracks();
    REQUIRE(tracks.count == 1);
    CHECK(tracks.covariance[0][0] == doctest::Approx(turned ? var_y : var_x));
    CHECK(tracks.covariance[2][0] == doctest::Approx(turned ? var_x : var_y));
  }
}

TEST_CASE("detector: every push of detections is counted as used or dropped") {
  Small small;
  small.create();
  const double at = 10.0;
  const auto push = [&](int64_t stamp_ns) {
    ovt_external_detections d;
    ovt_external_detections_init(&d, sizeof d);
    d.stamp_ns = stamp_ns;
    d.count = 1;
    d.x_m = d.y_m = &at;
    return ovt_push_detections(small.detector, &d);
  };
  CHECK(push(100) == OVT_OK);
  CHECK(push(100) == OVT_DUPLICATE);
  CHECK(push(50) == OVT_OK);               // out of sequence
  CHECK(push(50 - 1000 * kMs) == OVT_OK);  // too old: accepted, then dropped
  CHECK(push(200) == OVT_OK);
  ovt_stats stats = ovt_default_stats();
  REQUIRE(ovt_read_stats(small.detector, &stats) == OVT_OK);
  CHECK(stats.external == 3);
  CHECK(stats.external_dropped == 2);
}
