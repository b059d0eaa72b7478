// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// A driver that hangs publishes its last points again, with new stamps.
#include <doctest/doctest.h>

#include <algorithm>
#include <cstring>
#include <vector>

#include "tests/support/one_sensor_detector.h"

using namespace overtake::test;

namespace {

constexpr int64_t kPeriodNs = 50'000'000;

struct Story {
  const char* preset = "best";
  double speed_mps = 50.0;
  bool poses = true;
  int32_t from = 3;              // this scan is repeated
  int32_t sensors = 1;           // only the first one hangs
  bool changes_a_point = false;  // the repeats differ in one point
  int32_t piece = 0;             // pushed in pieces of so many points
};

struct Outcome {
  ovt_stats stats;
  ovt_frame_info last;
  int32_t warnings;
};

// Ten scans of each sensor, 50 ms apart, between poses of a vehicle that drives straight on.
Outcome run(const Story& story) {
  ovt_params params;
  REQUIRE(ovt_params_init(&params, sizeof params, story.preset) == OVT_OK);
  Small small;
  const std::vector<ovt_sensor_def> sensors(std::size_t(story.sensors), small.sensor);
  small.def.sensors = sensors.data();
  small.def.sensor_count = story.sensors;
  small.def.params = &params;
  static int32_t warnings;
  warnings = 0;
  small.def.log = [](ovt_log_level level, const char* text, void*) {
    warnings += level == OVT_LOG_WARNING && std::strstr(text, "points of its scan before") != nullptr;
  };
  small.create();
  for (int32_t k = 0; k < 10; ++k) {
    for (int64_t i = 0; story.poses && i < 5; ++i) {
      ovt_ego_pose pose;
      REQUIRE(ovt_ego_pose_init(&pose, sizeof pose) == OVT_OK);
      pose.stamp_ns = k * kPeriodNs + i * kPeriodNs / 5;
      pose.speed_mps = story.speed_mps;
      pose.x_m = story.speed_mps * double(pose.stamp_ns) * 1e-9;
      REQUIRE(ovt_push_ego_pose(small.detector, &pose) == OVT_OK);
    }
    for (int32_t s = 0; s < story.sensors; ++s) {
      Posts posts(4 + (s == 0 ? std::min(k, story.from) : k));
      if (story.changes_a_point) posts.x[posts.x.size() / 2 + 1] += 0.01f * float(k);
      ovt_points points = posts.points(k * kPeriodNs + s);
      points.sensor = s;
      if (story.piece == 0) {
        REQUIRE(ovt_push_scan(small.detector, &points) == OVT_OK);
        continue;
      }
      for (int32_t i = 0; i < int32_t(posts.x.size()); i += story.piece) {
        ovt_points piece = points;
        piece.count = std::min(story.piece, int32_t(posts.x.size()) - i);
        for (ovt_column* column : {&piece.x, &piece.y, &piece.z})
          column->data = static_cast<const float*>(column->data) + i;
        piece.layer.data = static_cast<const uint8_t*>(piece.layer.data) + i;
        REQUIRE(ovt_push_points(small.detector, &piece) == OVT_OK);
      }
      REQUIRE(ovt_end_scan(small.detector, s, k * kPeriodNs + s, int32_t(posts.x.size())) == OVT_OK);
    }
    REQUIRE(ovt_advance(small.detector, (k + 1) * kPeriodNs) == OVT_OK);
  }
  REQUIRE(ovt_flush(small.detector) == OVT_OK);
  return {small.stats(), small.latest.info, warnings};
}

}  // namespace

// The first repeat is used: a few points of a scan may be those of the scan before.
TEST_CASE("repeated scans: while the vehicle moves they count as duplicates, and the sensor becomes stale") {
  for (const double speed_mps : {50.0, -50.0})
    for (const int32_t piece : {0, 20}) {
      const Outcome out = run({.speed_mps = speed_mps, .piece = piece});
      CHECK(out.stats.pushed == 10);
      CHECK(out.stats.used == 5);
      CHECK(out.stats.dup == 5);
      CHECK((out.last.flags & OVT_FLAG_SENSOR_STALE) != 0);
      CHECK(out.warnings == 1);
    }
}

TEST_CASE("repeated scans: the other sensors go on") {
  const Outcome out = run({.sensors = 2});
  CHECK(out.stats.used == 15);
  CHECK(out.stats.dup == 5);
  CHECK(out.last.sensor_mask == 2);
  CHECK(out.last.stale_mask == 1);
}

TEST_CASE("repeated scans: one that differs in a point is none, nor is the only scan that a sensor ever had") {
  for (const Story& story : {Story{.changes_a_point = true}, Story{.from = 0}}) {
    const Outcome out = run(story);
    CHECK(out.stats.used == 10);
    CHECK(out.stats.dup == 0);
    CHECK(out.warnings == 0);
  }
}

TEST_CASE("repeated scans: a vehicle that stands, or whose speed is not known, may see the same again; so may paper") {
  for (const Story& story : {Story{.speed_mps = 0.5}, Story{.poses = false}, Story{.preset = "paper"}}) {
    const Outcome out = run(story);
    CHECK(out.stats.used == 10);
    CHECK(out.stats.dup == 0);
  }
}
