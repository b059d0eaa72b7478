// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// The front of a car that is not along the track, and the error of psi_VAR.
#include <doctest/doctest.h>

#include <cmath>
#include <vector>

#include "core/math.h"
#include "pipeline/free_heading.h"
#include "tests/support/rules_bench.h"

namespace {

using namespace overtake;
using namespace overtake::test;

// The rear end of points at these places with these heights.
RearEnd rear_of(const std::vector<std::pair<float, float>>& at, float low_m, float high_m) {
  EndTops tops(low_m, high_m);
  for (const auto& [along_m, height_m] : at) tops.add(along_m, height_m);
  return tops.rear(0.1f);
}

// A race car of boxes that stands at an angle to x.
std::vector<Solid> turned_car(double x_m, double y_m, double yaw_deg) {
  const double c = std::cos(yaw_deg * kPi / 180), s = std::sin(yaw_deg * kPi / 180);
  std::vector<Solid> parts;
  const auto add = [&](double ahead_m, double length_m, double width_m, double low_m, double high_m) {
    parts.push_back({x_m + c * ahead_m, y_m + s * ahead_m, yaw_deg, length_m, width_m, low_m, high_m});
  };
  add(2.2, 0.5, 1.2, 0.1, 0.3);  // nose
  add(1.3, 0.66, 1.85, 0.05, 0.66);
  add(0.3, 1.2, 0.5, 0.3, 0.7);
  add(-0.5, 0.5, 0.4, 0.6, 1.0);  // air box
  add(-1.5, 0.66, 1.85, 0.05, 0.6);
  add(-2.3, 0.3, 1.2, 0.55, 0.75);  // rear wing
  return parts;
}

struct Seen {
  double heading_deg, off_m;
  int32_t source, front;
};
Seen see(double x_m, double yaw_deg, double car_m = 4.921, double smoke_m = 0.0) {
  ovt_params params;
  REQUIRE(ovt_params_init(&params, sizeof params, "best") == OVT_OK);
  params.vehicle_length_m = car_m;
  RulesBench bench(true, &params);
  std::vector<Solid> solids = turned_car(x_m, 1, yaw_deg);
  if (smoke_m > 0) solids.push_back({x_m, 2.5, 0, 1.0, smoke_m, 0.0, 1.0, -1});
  bench.look(solids);
  bench.run();
  REQUIRE(bench.frame.detections.count == 1);
  const DetectionTable& d = bench.frame.detections;
  return {double(d.heading_rad[0]) * 180 / kPi, std::hypot(double(d.x_m[0]) - x_m, double(d.y_m[0]) - 1),
          d.heading_source[0], bench.frame.views.front[0]};
}
double degrees_between(double a, double b) { return std::fabs(std::remainder(a - b, 360.0)); }

}  // namespace

TEST_CASE("free heading: the rear end is the higher one, if both ends are seen") {
  const auto rear = [](float low_top_m, float high_top_m, float length_m = 4.5f) {
    return rear_of({{10, low_top_m - 0.3f},
                    {10.6f, low_top_m},
                    {10.8f, 2.0f},
                    {12, 1.0f},
                    {10 + length_m - 0.5f, high_top_m},
                    {10 + length_m, high_top_m - 0.1f}},
                   10, 10 + length_m);
  };
  CHECK(rear(0.7f, 0.3f) == RearEnd::kLow);
  CHECK(rear(0.3f, 0.7f) == RearEnd::kHigh);
  CHECK(rear(0.7f, 0.62f) == RearEnd::kUnknown);
  CHECK(rear(0.62f, 0.7f) == RearEnd::kUnknown);
  CHECK(rear(0.7f, 0.3f, 2.9f) == RearEnd::kUnknown);
  CHECK(rear_of({{10, 0.7f}, {12, 0.3f}}, 10, 14) == RearEnd::kUnknown);  // none at the other end
  CHECK(rear_of({{12, 0.7f}, {14, 0.3f}}, 10, 14) == RearEnd::kUnknown);
}

TEST_CASE("free heading: psi_VAR turns away from the line of sight, to both sides alike") {
  const auto error_deg = [](double view_deg) { return psi_var_error(view_deg * kPi / 180) * 180 / kPi; };
  CHECK(error_deg(0) == 0);
  CHECK(error_deg(180) == doctest::Approx(0).scale(1));
  CHECK(error_deg(30) == doctest::Approx(19));
  CHECK(error_deg(45) == doctest::Approx(16));
  CHECK(error_deg(37.5) == doctest::Approx(17.5));
  CHECK(error_deg(150) == doctest::Approx(-7));
  for (double deg = 0; deg <= 180; deg += 7) CHECK(error_deg(-deg) == doctest::Approx(-error_deg(deg)));
}

TEST_CASE("free heading: a car that has turned round along the track shows its front, near and without smoke") {
  for (const double x_m : {12.0, 20.0, 30.0}) {
    CAPTURE(x_m);
    CHECK(see(x_m, 180).front == -1);
    CHECK(see(x_m, 0).front != -1);
    CHECK(degrees_between(see(x_m, 180).heading_deg, 0) < 1);  // psi_REF
  }
  CHECK(see(60, 180).front == 0);       // too far to be sure
  CHECK(see(20, 180, 4.4).front == 0);  // a car of another shape
  CHECK(see(20, 180, 4.921, 0.5).front == 0);
}

TEST_CASE("free heading: a car that stands at an angle has the heading of its front") {
  for (const double yaw_deg : {60.0, 90.0, 120.0, 240.0, 270.0, 300.0}) {
    CAPTURE(yaw_deg);
    const Seen seen = see(25, yaw_deg);
    CHECK(seen.source == int32_t(HeadingSource::kVar));
    CHECK(seen.front == 1);
    CHECK(degrees_between(seen.heading_deg, yaw_deg) < 12);
    CHECK(seen.off_m < 0.6);
  }
}
