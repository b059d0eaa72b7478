// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// Capacities of the C API: what fits, what is left out, and its counters.
#include <doctest/doctest.h>

#include <cmath>

#include "tests/support/one_sensor_detector.h"

using namespace overtake::test;

TEST_CASE("detector: capacities keep the nearest, count the rest and set the flag") {
  const Posts posts(50);
  const ovt_points points = posts.points(0);
  for (const int32_t kind : {0, 1, 2}) {
    CAPTURE(kind);
    Small small;
    if (kind == 0) small.def.cluster_capacity = 16;
    if (kind == 1) small.def.candidate_capacity = 16;
    if (kind == 2) small.def.track_capacity = 16;
    small.create();
    REQUIRE(ovt_push_scan(small.detector, &points) == OVT_OK);
    const ovt_stats stats = small.stats();
    CHECK((small.latest.info.flags & OVT_FLAG_OVERFLOW) != 0);
    CHECK((stats.overflow_clusters > 0) == (kind == 0));
    CHECK(stats.overflow_candidates == (kind == 1 ? small.latest.info.candidate_count - 16 : 0));
    CHECK(stats.overflow_tracks == (kind == 2 ? small.latest.info.candidate_count - 16 : 0));
    CHECK((kind == 0 || small.latest.info.candidate_count > 32));
    CHECK(small.latest.info.track_count == 16);
    const ovt_tracks tracks = small.next_tracks();
    for (int32_t i = 0; i < tracks.count; ++i) CHECK(std::hypot(tracks.x_m[i], tracks.y_m[i]) < 29);
  }
}

TEST_CASE("detector: capacities that are not multiples of 16 hold exactly") {
  const Posts posts(50);
  const ovt_points points = posts.points(0);
  Small small;
  small.def.candidate_capacity = 5;
  small.create();
  REQUIRE(ovt_push_scan(small.detector, &points) == OVT_OK);
  CHECK(small.latest.info.detection_count == 5);
  CHECK(small.stats().overflow_candidates == small.latest.info.candidate_count - 5);
  CHECK(small.stats().overflow_tracks == 0);  // every detection finds a track
  CHECK(small.latest.info.track_count == 5);
}

TEST_CASE("detector: merged clusters beyond the capacity are counted, also when each sensor's clusters fit") {
  const Posts posts(12);
  const auto run = [&](int32_t capacity, int32_t& clusters) {
    Small small;
    ovt_sensor_def sensors[2] = {small.sensor, small.sensor};
    sensors[1].yaw_rad = 3.14159265358979323846;
    small.def.sensors = sensors;
    small.def.sensor_count = 2;
    small.def.cluster_capacity = capacity;
    small.create();
    for (int32_t s = 0; s < 2; ++s) {
      ovt_points points = posts.points(0);
      points.sensor = s;
      REQUIRE(ovt_push_scan(small.detector, &points) == OVT_OK);
    }
    REQUIRE(small.latest.calls == 1);
    clusters = small.latest.info.cluster_count;
    CHECK(((small.latest.info.flags & OVT_FLAG_OVERFLOW) != 0) == (small.stats().overflow_clusters > 0));
    return small.stats().overflow_clusters;
  };
  int32_t all = 0, kept = 0;
  CHECK(run(64, all) == 0);
  REQUIRE(all > 16);  // of both sensors
  REQUIRE(all / 2 <= 16);
  CHECK(run(16, kept) == all - 16);
  CHECK(kept == 16);
}

TEST_CASE("detector: a scan with one point too many is refused, and counted as pushed and dropped") {
  const Posts posts(4);
  const ovt_points points = posts.points(50);
  for (const int32_t workers : {1, 2}) {
    Small small(1, workers);
    small.sensor.point_capacity = points.count - 1;
    small.create();
    CHECK(ovt_push_scan(small.detector, &points) == OVT_TOO_MANY);
    ovt_stats stats = small.stats();
    CHECK(stats.pushed == 1);
    CHECK(stats.dropped == 1);
    ovt_points fits = points;
    fits.count -= 1;
    CHECK(ovt_push_scan(small.detector, &fits) == OVT_OK);  // the refused scan's stamp is not used up
    CHECK(ovt_flush(small.detector) == OVT_OK);
    stats = small.stats();
    CHECK(stats.used == 1);
    CHECK(adds_up(stats));
  }
}
