// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// The class of a detection: car, debris, or unknown where less than a car would show is seen.
#include <doctest/doctest.h>

#include <vector>

#include "tests/support/rules_bench.h"

namespace {

using namespace overtake;
using namespace overtake::test;

TEST_CASE("object class: a box or a tyre is debris where a car would show more, and nowhere else") {
  const auto class_of = [](const std::vector<Solid>& solids, double row_pitch_rad = 0.0035) {
    const Looked bench(solids, row_pitch_rad);
    REQUIRE(bench.frame.detections.count == 1);
    return bench.frame.views.object_class[0];
  };
  for (const double x_m : {8.0, 15.0, 25.0})
    for (const double size_m : {0.4, 0.6, 0.75}) {
      CAPTURE(x_m);
      CAPTURE(size_m);
      CHECK(class_of({{x_m, 0.5, 20, size_m, size_m, 0.0, size_m, 1}}) == OVT_CLASS_DEBRIS);
    }
  // At an angle to the circuit, 1 m is 1.4 m along it.
  for (const double yaw_deg : {0.0, 30.0, 45.0, 75.0}) {
    CAPTURE(yaw_deg);
    CHECK(class_of({{10, 0.5, yaw_deg, 0.95, 0.95, 0.0, 0.9, 1}}) == OVT_CLASS_DEBRIS);
    if (yaw_deg > 0) CHECK(class_of({{10, 0.5, yaw_deg, 1.5, 0.3, 0.0, 0.9, 1}}) == OVT_CLASS_CAR);
  }
  for (const double x_m : {8.0, 15.0, 25.0, 40.0, 60.0}) {
    CAPTURE(x_m);
    CHECK(class_of({car_at(x_m, 0.5)}) == OVT_CLASS_CAR);
    CHECK(class_of({car_at(x_m, 0.5, 90)}) == OVT_CLASS_CAR);
  }
  // Hidden by a nearer object but for 0.7 m.
  CHECK(class_of({car_at(25, 0), {12, -0.6, 0, 0.2, 1.6, 0.0, 1.5, 0}}) == OVT_CLASS_UNKNOWN);
  // It does not touch the road: the top of a car behind a crest.
  CHECK(class_of({{25, 0.5, 20, 0.6, 0.4, 0.75, 1.0, 1}}) == OVT_CLASS_UNKNOWN);
  // Farther away than the columns tell, with fine rows; and with too few rows.
  CHECK(class_of({{80, 0, 0, 0.75, 0.75, 0.0, 0.75, 1}}, 0.001) == OVT_CLASS_UNKNOWN);
  CHECK(class_of({{15, 0, 0, 0.75, 0.75, 0.0, 0.75, 1}}, 0.02) == OVT_CLASS_UNKNOWN);
  CHECK(class_of({{15, 0, 0, 0.75, 0.75, 0.0, 0.75, 1}}, 0.01) == OVT_CLASS_DEBRIS);
}

TEST_CASE("object class: what is left between pixels of smoke has no class") {
  const auto class_of = [](const Solid& beside, double x_m = 25.0) {
    const Looked bench({car_at(x_m, 0), beside});
    REQUIRE(bench.frame.detections.count == 1);
    return bench.frame.views.object_class[0];
  };
  // Smoke over the middle of a car, half as wide as the car; a fifth; and as much of a solid object.
  CHECK(class_of({22, 0, 0, 0.1, 0.9, 0.0, 1.5, -1}) == OVT_CLASS_UNKNOWN);
  CHECK(class_of({22, 0, 0, 0.1, 0.3, 0.0, 1.5, -1}) == OVT_CLASS_CAR);
  CHECK(class_of({22, 0, 0, 0.1, 0.9, 0.0, 1.5, 0}) == OVT_CLASS_CAR);
  // Smoke in front of the car, but not near it.
  CHECK(class_of({14, 0, 0, 0.1, 0.6, 0.0, 1.3, -1}) == OVT_CLASS_CAR);
  // All around a distant car; and farther behind it.
  CHECK(class_of({62.9, 0, 0, 0.1, 6.0, 0.0, 2.5, -1}, 60) == OVT_CLASS_UNKNOWN);
  CHECK(class_of({65.9, 0, 0, 0.1, 6.0, 0.0, 2.5, -1}, 60) == OVT_CLASS_CAR);
}

TEST_CASE("object class: rows that the ground beside them continues are road, whatever their size") {
  const auto class_of = [](const std::vector<Solid>& solids) {
    const Looked bench(solids);
    REQUIRE(bench.frame.detections.count == 1);
    return bench.frame.views.object_class[0];
  };
  // As large as a car, and no higher than the road; also where something nearer hides one side, but not both.
  const Solid road = {22, 0, 0, 2.0, 1.6, -0.5, 0.002, 1}, step = {22, 0, 0, 2.0, 1.6, -0.5, 0.2, 1};
  CHECK(class_of({road}) == OVT_CLASS_UNKNOWN);
  CHECK(class_of({road, {12, 0.83, 0, 0.1, 1.0, 0.0, 1.5, 0}}) == OVT_CLASS_UNKNOWN);
  CHECK(class_of({road, {12, -0.83, 0, 0.1, 1.0, 0.0, 1.5, 0}}) == OVT_CLASS_UNKNOWN);
  CHECK(class_of({road, {12, 0.88, 0, 0.1, 1.0, 0.0, 1.5, 0}, {12, -0.88, 0, 0.1, 1.0, 0.0, 1.5, 0}}) == OVT_CLASS_CAR);
  // A step over the road; and a car whose lowest row lies on it.
  CHECK(class_of({step}) == OVT_CLASS_CAR);
  CHECK(class_of({road, {23.5, 0, 0, 1.0, 1.6, 0.0, 0.35, 1}}) == OVT_CLASS_CAR);
  // A wall beside a wall is no road.
  CHECK(class_of({road, {22, 1.8, 0, 2.0, 2.0, -0.5, 0.002, 0}, {22, -1.8, 0, 2.0, 2.0, -0.5, 0.002, 0}}) ==
        OVT_CLASS_CAR);
}

TEST_CASE("object class: nothing in an incomplete scan is debris") {
  for (const uint32_t mask : {0u, 1u, 2u}) {
    RulesBench bench;
    bench.look({{15, 0.5, 20, 0.6, 0.6, 0.0, 0.6, 1}});
    bench.frame.incomplete_mask = mask;
    bench.run();
    REQUIRE(bench.frame.detections.count == 1);
    CHECK(bench.frame.views.object_class[0] == (mask == 1 ? OVT_CLASS_UNKNOWN : OVT_CLASS_DEBRIS));
  }
}

TEST_CASE("object class: what two sensors see is no debris if the scan of either is incomplete") {
  for (const uint32_t mask : {0u, 1u, 2u, 4u}) {
    RulesBench bench;
    bench.look({{15, 0.5, 20, 0.6, 0.6, 0.0, 0.6, 1}});
    bench.add({{14.8f, 0.5f, 0.3f}, {14.8f, 0.6f, 0.3f}, {14.8f, 0.5f, 0.4f}}, 1);
    bench.frame.incomplete_mask = mask;
    bench.run();
    REQUIRE(bench.frame.detections.count == 1);
    CHECK(bench.frame.merged.sensor_mask[0] == 3);
    CHECK(bench.frame.views.object_class[0] == (mask & 3u ? OVT_CLASS_UNKNOWN : OVT_CLASS_DEBRIS));
  }
}

TEST_CASE("object class: a distant car with three points in a row is never debris") {
  for (const double x_m : {60.0, 80.0, 95.0, 110.0})
    for (const double width_m : {0.5, 0.8, 1.886}) {
      CAPTURE(x_m);
      CAPTURE(width_m);
      RulesBench bench;
      bench.look({{x_m, 0, 0, 1.5, width_m, 0.9, 1.1, 1}});  // the cockpit alone
      bench.run();
      for (int32_t i = 0; i < bench.frame.detections.count; ++i)
        CHECK(bench.frame.views.object_class[i] != OVT_CLASS_DEBRIS);
    }
}

}  // namespace
