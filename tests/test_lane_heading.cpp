// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// The tracker of preset `best`: the headings of cars that spin, stand or turn round.
#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "core/math.h"
#include "tests/support/lane_bench.h"

namespace {

using namespace overtake;
using test::CircleRoad, test::kFrame_s, test::LaneBench, test::make_ring, test::ns_of, test::seen_car;

// A row, with its heading, of a car on a straight way through the origin. The errors of its place differ from
// row to row.
Measurement row_with_heading(double course_rad, double way_m, int32_t k) {
  const double wrong_m = 0.15 * std::sin(2.1 * k), aside_m = 0.15 * std::sin(1.3 * k + 1.0);
  const double c = std::cos(course_rad), s = std::sin(course_rad);
  return {.x_m = (way_m + wrong_m) * c - aside_m * s,
          .y_m = (way_m + wrong_m) * s + aside_m * c,
          .var_x = 0.04,
          .var_y = 0.04,
          .cov_xy = 0,
          .heading_rad = course_rad,
          .stamp_ns = ns_of(k),
          .free_heading = true,
          .front = 1};
}

}  // namespace

TEST_CASE("lane heading: the heading of a car that spins is measured, its course goes on") {
  LaneBench bench;
  constexpr double kSpin_rps = 3.0;
  double heading = 0;
  for (int32_t k = 0; k < 60; ++k) {
    bench.ego_at(30 * kFrame_s * k - 20);
    Measurement z = seen_car(30 * kFrame_s * k, 0, k);
    if (k >= 20) {
      heading = kSpin_rps * kFrame_s * (k - 20);
      z.heading_rad = wrap_angle(k % 3 == 0 ? heading : heading + kPi);  // a rectangle has no front
      z.free_heading = 1;
    }
    bench.step(k, {z});
    if (k == 19) CHECK(bench.rows.heading_rad[0] == bench.rows.course_rad[0]);
    if (k >= 30) CHECK(std::fabs(wrap_angle(bench.rows.heading_rad[0] - heading)) < 0.15);
  }
  CHECK(std::fabs(bench.rows.course_rad[0]) < 0.03);
  CHECK(bench.rows.speed_mps[0] == doctest::Approx(30).epsilon(0.03));
}

TEST_CASE("lane heading: three fronts in a row that point the other way turn a car round, and it stays so") {
  constexpr double kSpeed = 20;
  struct Step {
    int32_t frames;
    double heading_deg;
    int32_t front;  // of the detections
  };
  // The heading after the steps, deg. The car drives along x.
  const auto heading_after = [](const std::vector<Step>& steps) {
    LaneBench bench;
    int32_t k = 0;
    for (const Step& step : steps)
      for (int32_t i = 0; i < step.frames; ++i, ++k) {
        bench.ego_at(kSpeed * kFrame_s * k - 20);
        Measurement z = seen_car(kSpeed * kFrame_s * k, 0, k);
        z.heading_rad = wrap_angle(step.heading_deg * kPi / 180), z.front = step.front;
        bench.step(k, {z});
      }
    return std::fabs(bench.rows.heading_rad[0]) * 180 / kPi;
  };
  CHECK(heading_after({{10, 0, 0}, {2, 180, 1}}) < 10);
  CHECK(heading_after({{10, 0, 0}, {3, 180, 1}}) > 170);
  CHECK(heading_after({{10, 0, 0}, {3, 0, -1}}) > 170);
  CHECK(heading_after({{10, 0, 0}, {8, 180, -1}}) < 10);
  // One that points forward takes one back, and so does one without a front.
  CHECK(heading_after({{10, 0, 0}, {2, 180, 1}, {1, 0, 1}, {1, 180, 1}}) < 10);
  CHECK(heading_after({{10, 0, 0}, {2, 180, 1}, {1, 0, 0}, {1, 180, 1}}) < 10);
  CHECK(heading_after({{10, 0, 0}, {3, 180, 1}, {20, 0, 0}}) > 170);  // its course does not turn it
  CHECK(heading_after({{10, 0, 0}, {3, 180, 1}, {3, 0, 1}, {20, 0, 0}}) < 10);
  CHECK(heading_after({{10, 0, 0}, {8, 170, 1}}) > 170);
}

TEST_CASE("lane heading: a measurement that is older than the state adds no noise to the heading") {
  const auto variance_after = [](int64_t late_ns) {
    LaneBench bench;
    for (int32_t k = 0; k < 12; ++k) {
      bench.ego_at(50 * kFrame_s * k - 30);
      Measurement z = seen_car(50 * kFrame_s * k, 0, k);
      z.free_heading = true, z.heading_rad = 0;
      bench.step(k, {z});
    }
    Measurement z = seen_car(50 * (kFrame_s * 11 - double(late_ns) * 1e-9), 0, 11);
    z.stamp_ns -= late_ns;
    z.heading_rad = kNotMeasured;
    bench.step(11, {z});
    return bench.state().heading_var;
  };
  CHECK(variance_after(40'000'000) == doctest::Approx(variance_after(0)).epsilon(1e-9));
}

TEST_CASE("lane heading: a car that stands backwards after a spin and turns round has its heading again") {
  LaneBench bench;
  double x_m = 200, y_m = 0, heading = 0, speed = 0;
  for (int32_t k = 0; k < 260; ++k) {
    const double t_s = kFrame_s * k;
    double course = 0;
    int32_t front = 1;
    if (t_s < 2)
      speed = 20;
    else if (t_s < 3)
      heading = (t_s - 2) * kPi, speed = 20 - 6 * (t_s - 2);
    else if (t_s < 4.5)
      heading = kPi, speed = std::max(0.0, 14 - 9.4 * (t_s - 3));
    else if (t_s < 5.5)
      speed = 0, front = 0;
    else if (t_s < 9.5)  // it turns at walking pace
      speed = 3, heading = course = kPi - (t_s - 5.5) / 4 * kPi, front = 0;
    else
      speed = std::min(25.0, 3 + 6 * (t_s - 9.5)), heading = 0, front = 0;
    x_m += speed * std::cos(course) * kFrame_s;
    y_m += speed * std::sin(course) * kFrame_s;
    bench.input.ego = {true, x_m - 25, y_m, 0, 10};
    Measurement z = seen_car(x_m, y_m, k);
    z.heading_rad = t_s > 9.7 ? 0 : wrap_angle(heading);
    z.free_heading = t_s <= 9.7, z.front = front;
    bench.step(k, {z});
  }
  CHECK(std::fabs(bench.state().heading_rad) < 0.3);
}

TEST_CASE("lane heading: that of pushed rows is the car's, also against the lane and where nothing tells its course") {
  const CircleRoad road = make_ring(2000.0);
  for (const bool has_map : {false, true})
    for (const double course_rad : {0.0, 2.0, kPi, -2.5}) {
      if (has_map && course_rad != 0.0 && course_rad != kPi) continue;
      CAPTURE(has_map);
      CAPTURE(course_rad);
      LaneBench bench(has_map ? &road.map : nullptr);
      bench.input.ego.known = has_map;
      for (int32_t k = 0; k < 40; ++k) {
        bench.step(k, {row_with_heading(course_rad, 30 * kFrame_s * (k - 20), k)});
        if (k < 8) continue;
        REQUIRE(bench.is_confirmed());
        CHECK(std::fabs(wrap_angle(bench.rows.heading_rad[0] - course_rad)) < 0.15);
        CHECK(std::fabs(wrap_angle(bench.rows.course_rad[0] - course_rad)) < 0.3);
      }
    }
}

TEST_CASE("lane heading: a measured heading does not turn the course of a car that stands") {
  for (const double heading_rad : {0.0, 1.2, kPi}) {
    CAPTURE(heading_rad);
    LaneBench bench;
    int32_t against = 0;
    for (int32_t k = 0; k < 200; ++k) {
      bench.ego_at(-40);
      bench.step(k, {row_with_heading(heading_rad, 0, k)});
      if (k < 60) continue;
      against += std::fabs(wrap_angle(bench.rows.course_rad[0] - bench.rows.heading_rad[0])) > kHalfPi;
    }
    CHECK(against == 0);
  }
}
