// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// The rule pose_by_view at the edges of all views: an end of a car that they cut off is not the car's.
#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>

#include "tests/support/rules_bench.h"

namespace {

using namespace overtake;
using namespace overtake::test;

TEST_CASE("cut ends: of a car at the edge of all fields of view the end that is seen counts") {
  // Sensor 0 sees 60 deg to both sides, sensor 1 what is to the left of that; to the right nothing does.
  struct Error {
    double x_m, y_m, sigma_x_m;
  };
  const auto look = [](double x_m, double y_m, bool others) {
    RulesBench bench(false);
    bench.look({car_at(x_m, y_m)});
    bench.frame.sensors[1].present = others;
    bench.run();
    REQUIRE(bench.frame.detections.count == 1);
    const DetectionTable& d = bench.frame.detections;
    return Error{double(d.x_m[0]) - x_m, double(d.y_m[0]) - y_m, std::sqrt(double(bench.frame.views.var_x[0]))};
  };
  for (const double x_m : {1.5, 2.5, 3.5, 4.5}) {
    CAPTURE(x_m);
    const Error right = look(x_m, -5, true), left = look(x_m, 5, false), covered = look(x_m, 5, true);
    for (const Error& e : {right, left}) {
      CHECK(std::fabs(e.x_m) < 0.1);
      CHECK(std::fabs(e.y_m) < 0.2);
      CHECK(e.sigma_x_m < 0.4);
    }
    CHECK(covered.x_m > 0.25);  // sensor 1 sees that nothing is there
  }
  CHECK(look(14, -26, true).x_m > 0.4);  // too far away
  const Error whole = look(9, -5, true);
  CHECK(std::fabs(whole.x_m) < 0.1);
  CHECK(whole.sigma_x_m < 0.1);
}

TEST_CASE("cut ends: of a car at a gap of all views the end that is seen counts") {
  // Dirt on the window of sensor 0 stops the light from from_deg to to_deg, on one side.
  const auto look = [](double side, double from_deg, double to_deg, bool others, bool all_are_dirty = false) {
    constexpr double kFar_m = 0.6;
    const double middle_deg = side * (from_deg + to_deg) / 2, half = std::tan((to_deg - from_deg) / 2 * kPi / 180);
    RulesBench bench(false);
    bench.look({car_at(7, 5 * side),
                {kFar_m * std::cos(middle_deg * kPi / 180), kFar_m * std::sin(middle_deg * kPi / 180), middle_deg,
                 0.002, 2 * kFar_m * half, 0, 2, -2}});
    if (others) {  // sensor 1 looks to the same place
      bench.context.sensors[1] = bench.context.sensors[0];
      bench.frame.sensors[1].present = true;
    } else {
      bench.frame.sensors[1].present = false;
    }
    for (const FrameRule& rule : bench.context.method->frame) {
      rule.run(bench.context, bench.frame);
      if (all_are_dirty && rule.run == &find_view_gaps) bench.frame.gaps[1] = bench.frame.gaps[0];
    }
    REQUIRE(bench.frame.gaps[0].count == 1);
    REQUIRE(bench.frame.detections.count == 1);
    return double(bench.frame.detections.x_m[0]) - 7;
  };
  for (const double side : {-1.0, 1.0}) {
    CAPTURE(side);
    CHECK(std::fabs(look(side, 32, 55, false)) < 0.15);  // its rear
    CHECK(std::fabs(look(side, 10, 27, false)) < 0.15);  // its nose
    CHECK(look(side, 32, 55, true) > 0.25);
    CHECK(std::fabs(look(side, 32, 55, true, true)) < 0.15);
    CHECK(std::fabs(look(side, 5, 15, false)) < 0.1);  // beside it
  }
}

TEST_CASE("cut ends: at the edge of all fields of view, an end that something nearer hides is not the car's") {
  struct Error {
    double x_m, sigma_x_m;
  };
  // Beside the car, nearer to the sensor, stands an object as long as the car, with its rear end at rear_m.
  const auto look = [](double x_m, double side, double rear_m) {
    RulesBench bench(false);
    bench.look({car_at(x_m, 5.8 * side), {rear_m + 2.45, 3.2 * side, 0, 4.9, 1.9, 0.05, 1.3, 2}});
    bench.frame.sensors[1].present = false;
    bench.run();
    REQUIRE(bench.frame.detections.count == 2);
    return Error{double(bench.frame.detections.x_m[0]) - x_m, std::sqrt(double(bench.frame.views.var_x[0]))};
  };
  for (const double side : {-1.0, 1.0}) {
    CAPTURE(side);
    CHECK(std::fabs(look(5.5, side, 4.4).x_m) < 0.15);  // the rear end begins inside of the view
    CHECK(std::fabs(look(5.5, side, 5.2).x_m) < 0.15);
    CHECK(look(4.5, side, 4.4).x_m < 0.1);     // it does not
    const Error flank = look(4.0, side, 2.9);  // the view begins at the flank: neither end is known
    CHECK(flank.sigma_x_m > 0.4);
    CHECK(std::fabs(flank.x_m) < 3.0 * flank.sigma_x_m);
    const Error seen = look(4.0, side, 8.0);
    CHECK(std::fabs(seen.x_m) < 0.1);
    CHECK(seen.sigma_x_m < 0.4);
  }
}

TEST_CASE("cut ends: on the other side of a sensor of more than half a turn is no edge of its view") {
  double worst_m = 0;
  for (double y_m = -9; y_m < -3; y_m += 0.05) {
    RulesBench bench(false);
    const double half =
        135 * kPi / 180;  // an edge of it looks back to the left, from the car that is ahead to the right
    bench.context.sensors[0] = make_sensor_model(RulesBench::kRows, RulesBench::kCols, half, -half, false, 0.5, 400);
    bench.context.sensors[0].T_vehicle_sensor = make_transform(0, 0, RulesBench::kSensorHeight_m, 0, 0, 0);
    bench.look({{7, y_m, 0, 4.9, 1.2, 0.1, 1.1, 1}});
    bench.frame.sensors[1].present = false;
    bench.run();
    REQUIRE(bench.frame.detections.count == 1);
    worst_m = std::max(worst_m, std::fabs(double(bench.frame.detections.y_m[0]) - y_m));
  }
  CHECK(worst_m < 0.15);
}

}  // namespace
