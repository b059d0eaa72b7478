// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// Range, elevation, column; dropped points and their reasons.
#include "kernels/project_points.h"

#include <doctest/doctest.h>

#include <cfloat>
#include <cmath>
#include <limits>
#include <random>

#include "core/math.h"
#include "tests/support/ray_scene.h"

namespace overtake {
namespace {

using test::kDegree;
using test::TestPoint;

constexpr float kNan = std::numeric_limits<float>::quiet_NaN();
constexpr float kInf = std::numeric_limits<float>::infinity();

SensorModel front_sensor(int32_t cols = 120) {
  return make_sensor_model(4, cols, 60 * kDegree, -60 * kDegree, false, 0.5, 200);
}

// Runs only loading and projection; the sums are those of project_points.
struct Projection {
  Projection(const SensorModel& sensor, const std::vector<TestPoint>& cloud)
      : chain(sensor, int32_t(cloud.size()) + 1) {
    ref::load_points(test::fields_of(cloud), int32_t(cloud.size()), chain.part.scan);
    ref::project_points(sensor, chain.part.scan, chain.views.points, chain.views.layer_sums);
  }
  test::SegmentChain chain;
};

Reason reason_of(const SensorModel& sensor, const TestPoint& point) {
  return Projection(sensor, {point}).chain.reason(0);
}

int32_t column_at(const SensorModel& sensor, double azimuth_deg) {
  const double a = azimuth_deg * kDegree;
  return Projection(sensor, {{float(10 * std::cos(a)), float(10 * std::sin(a)), 0}}).chain.views.points.column[0];
}

TEST_CASE("project_points: r = |p|, e = atan2(z, hypot(x, y)), column = floor((a_left - a) / pitch)") {
  const SensorModel sensor = front_sensor(857);
  std::mt19937 random(11);
  INFO("seed 11");
  std::uniform_real_distribution<double> azimuth(-59.9, 59.9), elevation(-40, 40), range(1, 190);
  for (int n = 0; n < 2000; ++n) {
    const double a = azimuth(random) * kDegree, e = elevation(random) * kDegree, r = range(random);
    const TestPoint p = {float(r * std::cos(e) * std::cos(a)), float(r * std::cos(e) * std::sin(a)),
                         float(r * std::sin(e))};
    const test::SegmentChain& chain = Projection(sensor, {p}).chain;
    REQUIRE(chain.reason(0) == Reason::kLabelled);
    CHECK(double(chain.views.points.range_m[0]) == doctest::Approx(r).epsilon(1e-6));
    CHECK(std::fabs(double(chain.views.points.elevation_rad[0]) - e) < 1e-6);
    const double position = (60 * kDegree - a) / (120 * kDegree / 857);
    if (std::fabs(position - std::round(position)) < 1e-3) continue;  // rounding may take either side
    CHECK(chain.views.points.column[0] == int32_t(std::floor(position)));
  }
}

TEST_CASE("project_points: columns grow to the right; points outside the azimuth limits are dropped") {
  const SensorModel sensor = front_sensor();
  CHECK(column_at(sensor, 59.5) == 0);
  CHECK(column_at(sensor, 0.5) == 59);
  CHECK(column_at(sensor, -0.5) == 60);
  CHECK(column_at(sensor, -59.5) == 119);
  for (const double outside : {60.01, 90.0, 180.0, -60.01, -135.0}) {
    CAPTURE(outside);
    CHECK(column_at(sensor, outside) == -1);
  }
  CHECK(reason_of(sensor, {0, 10, 0}) == Reason::kOutsideAzimuth);
}

TEST_CASE("project_points: a field of view across +-pi has no gap") {
  // Left edge at 240 deg (= -120), right edge at 120 deg: a sensor that looks back, columns of 1 deg.
  for (const double left : {240.0, -120.0}) {
    const SensorModel sensor = make_sensor_model(4, 120, left * kDegree, (left - 120) * kDegree, false, 0.5, 200);
    CAPTURE(left);
    CHECK(column_at(sensor, -120.5) == 0);
    CHECK(column_at(sensor, -179.5) == 59);
    CHECK(column_at(sensor, 179.5) == 60);
    CHECK(column_at(sensor, 120.5) == 119);
    CHECK(column_at(sensor, 119.5) == -1);
    CHECK(column_at(sensor, -119.5) == -1);
    CHECK(column_at(sensor, 0.0) == -1);
  }
}

TEST_CASE("project_points: a left edge may be given a turn less") {
  for (const double left : {60.0, 150.0, 90.0}) {
    CAPTURE(left);
    const SensorModel here = make_sensor_model(4, 120, left * kDegree, (left - 120) * kDegree, false, 0.5, 200);
    const SensorModel there =
        make_sensor_model(4, 120, (left - 360) * kDegree, (left - 480) * kDegree, false, 0.5, 200);
    for (int degree = -180; degree < 180; ++degree)
      CHECK(column_at(here, degree + 0.5) == column_at(there, degree + 0.5));
  }
}

TEST_CASE("project_points: wrapping columns accept every azimuth, and a full turn is column 0") {
  for (const double left : {180.0, 0.0, 90.0, 300.0, 390.0, -180.0, -200.0, -270.0, -390.0}) {
    const SensorModel sensor = make_sensor_model(4, 360, left * kDegree, (left - 360) * kDegree, true, 0.5, 200);
    CAPTURE(left);
    int32_t seen[360] = {};
    for (int degree = 0; degree < 360; ++degree) {
      const int32_t column = column_at(sensor, degree + 0.5);
      REQUIRE(column >= 0);
      REQUIRE(column < 360);
      ++seen[column];
    }
    for (const int32_t count : seen) CHECK(count == 1);
    // Just left of the left edge is the last column, or, if rounding moves it onto the edge, column 0; never outside.
    SensorModel nudged = sensor;
    nudged.azimuth_left_rad = std::nextafter(0.0f, -1.0f);
    const Projection p(nudged, {{10, 0, 0}});
    CHECK(p.chain.views.points.column[0] == 0);
  }
}

TEST_CASE("project_points: a point straight above has azimuth 0 and elevation 90 deg") {
  const Projection p(front_sensor(), {{0, 0, 5}, {0, 0, -5}});
  CHECK(p.chain.views.points.column[0] == p.chain.views.points.column[1]);
  CHECK(double(p.chain.views.points.elevation_rad[0]) == doctest::Approx(90 * kDegree));
  CHECK(double(p.chain.views.points.elevation_rad[1]) == doctest::Approx(-90 * kDegree));
}

TEST_CASE("project_points: gives the first reason that holds: finite, zero, range, layer, azimuth") {
  SensorModel sensor = front_sensor();
  sensor.layer_first = 2;
  sensor.layer_last = 5;
  CHECK(reason_of(sensor, {kNan, 0, 0, 1, 99}) == Reason::kNotFinite);
  CHECK(reason_of(sensor, {1, kInf, 0, 1, 99}) == Reason::kNotFinite);
  CHECK(reason_of(sensor, {1, 0, -kInf, 1, 3}) == Reason::kNotFinite);
  CHECK(reason_of(sensor, {0, 0, 0, 1, 99}) == Reason::kZeroRange);
  CHECK(reason_of(sensor, {-0.0f, 0, FLT_MIN / 4, 1, 99}) == Reason::kZeroRange);
  CHECK(reason_of(sensor, {0.3f, 0.3f, 0, 1, 99}) == Reason::kRangeLimit);
  CHECK(reason_of(sensor, {150, 150, 0, 1, 99}) == Reason::kRangeLimit);
  CHECK(reason_of(sensor, {-10, 0, 0, 1, 99}) == Reason::kBadLayer);
  CHECK(reason_of(sensor, {10, 0, 0, 1, 1}) == Reason::kBadLayer);
  CHECK(reason_of(sensor, {10, 0, 0, 1, 6}) == Reason::kBadLayer);
  CHECK(reason_of(sensor, {10, 0, 0, 1, 2.5f}) == Reason::kBadLayer);
  CHECK(reason_of(sensor, {-10, 0, 0, 1, 3}) == Reason::kOutsideAzimuth);
  CHECK(reason_of(sensor, {10, 0, 0, 1, 2}) == Reason::kLabelled);
  CHECK(reason_of(sensor, {10, 0, 0, 1, 5}) == Reason::kLabelled);

  const Projection dropped(sensor, {{150, 150, 7, 1, 3}});
  CHECK(dropped.chain.views.points.range_m[0] == 0.0f);
  CHECK(dropped.chain.views.points.elevation_rad[0] == 0.0f);
  CHECK(dropped.chain.views.points.column[0] == -1);
}

TEST_CASE("project_points: the range limits are inclusive") {
  SensorModel sensor = front_sensor();
  CHECK(reason_of(sensor, {0.5f, 0, 0}) == Reason::kLabelled);
  CHECK(reason_of(sensor, {200, 0, 0}) == Reason::kLabelled);
  CHECK(reason_of(sensor, {std::nextafter(0.5f, 0.0f), 0, 0}) == Reason::kRangeLimit);
  CHECK(reason_of(sensor, {std::nextafter(200.0f, 300.0f), 0, 0}) == Reason::kRangeLimit);
}

TEST_CASE("project_points: a coordinate whose square overflows is beyond any range limit") {
  SensorModel sensor = front_sensor();
  for (const float limit : {200.0f, 1e30f, FLT_MAX, kInf}) {
    sensor.range_max_m = limit;
    CAPTURE(limit);
    for (const float huge : {3e38f, FLT_MAX, 2e19f, 1.1e18f}) {
      CAPTURE(huge);
      CHECK(reason_of(sensor, {huge, 0, 0}) == Reason::kRangeLimit);
      CHECK(reason_of(sensor, {huge, -huge, huge}) == Reason::kRangeLimit);
      CHECK(reason_of(sensor, {1, 0, -huge}) == Reason::kRangeLimit);
    }
  }
}

TEST_CASE("project_points: without a lower limit the nearest point has a range above zero") {
  SensorModel sensor = front_sensor();
  sensor.range_min_m = 0.0f;
  CHECK(reason_of(sensor, {1e-20f, 0, 0}) == Reason::kZeroRange);
  CHECK(reason_of(sensor, {1e-30f, 1e-30f, 1e-30f}) == Reason::kZeroRange);
  const Projection p(sensor, {{2e-12f, 0, 0}});
  CHECK(p.chain.reason(0) == Reason::kLabelled);
  CHECK(p.chain.views.points.range_m[0] > 0.0f);
}

TEST_CASE("project_points: sums points and elevations per layer, of kept points only") {
  const float unit = kElevationUnit;
  const Projection p(front_sensor(), {{10, 0, 1, 1, 65535}, {20, 0, -3, 1, 7}, {30, 0, 2, 1, 65535}, {0, 0, 0, 1, 9}});
  const LayerSums& sums = p.chain.views.layer_sums;
  REQUIRE(sums.touched_count == 2);
  CHECK(sums.point_count[65535] == 2);
  CHECK(sums.point_count[7] == 1);
  CHECK(sums.point_count[9] == 0);
  const float* e = p.chain.views.points.elevation_rad;
  CHECK(sums.elevation_sum[65535] == int64_t(e[0] * unit) + int64_t(e[2] * unit));
  CHECK(sums.elevation_sum[7] == int64_t(e[1] * unit));
}

}  // namespace
}  // namespace overtake
