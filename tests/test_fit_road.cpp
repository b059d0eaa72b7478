// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// The terms of a road's shape. What sample_road makes of them: test_guess_road.cpp.
#include "kernels/fit_road.h"

#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <random>
#include <utility>
#include <vector>

#include "kernels/kernel_table.h"
#include "tests/support/road_samples.h"

namespace overtake {
namespace {

using test::make_sensor, test::Scan;
using Source = ExpectedRoad::Source;

RoadAxes axes_of(const SensorModel& sensor) { return {{1, 0, 0, 0, 1, 0, 0, 0, 1}, sensor.T_vehicle_sensor}; }

// A scan of the surface z(x, y) in the vehicle frame by a level sensor that looks ahead; returns from 2 to 90 m.
template <class Surface>
Scan scan_of(const SensorModel& sensor, Surface&& surface) {
  Scan scan(sensor);
  const float* t = sensor.T_vehicle_sensor.t;
  for (int32_t r = 0; r < sensor.rows; ++r)
    for (int32_t c = 0; c < sensor.cols; ++c) {
      const double distance = 90.0 * std::pow(2.0 / 90.0, double(r) / (sensor.rows - 1));
      const double azimuth = double(sensor.azimuth_left_rad) - (c + 0.5) * double(sensor.pitch_rad);
      const double x = distance * std::cos(azimuth), y = distance * std::sin(azimuth);
      const double z = surface(x + double(t[0]), y + double(t[1])) - double(t[2]);
      scan.range.at(r, c) = float(std::hypot(distance, z));
      scan.elevation.at(r, c) = float(std::atan2(z, distance));
    }
  return scan;
}

RoadShape fit(const SensorModel& sensor, Scan scan, RoadShape shape = {}, const char* isa = "ref") {
  find_kernels(isa)->fit_road(test::paper_params(sensor).running_ground, axes_of(sensor), sensor, scan.range,
                              scan.elevation, shape);
  return shape;
}

const SensorModel kAhead = make_sensor({2.3, 0.0, 0.65, 0.0, 0.0, 0.0}, 240);

TEST_CASE("fit_road: the terms of the road's surface: height, grade, cross slope, bend and twist") {
  RoadShape shape;
  shape.curvature = 0.004f;
  const auto lane = [](double x, double y) { return y - 0.002 * x * x; };
  struct {
    double term[RoadShape::kTerms];
  } const roads[] = {{{0.05, 0.0, 0.0, 0.0, 0.0}},
                     {{0.0, 0.01, 0.0, 0.0, 0.0}},
                     {{0.0, 0.0, 0.02, 0.0, 0.0}},
                     {{0.0, 0.0, 0.0, 3e-4, 0.0}},
                     {{0.0, 0.0, 0.0, 0.0, 1e-3}}};
  for (const auto& road : roads) {
    const double* e = road.term;
    const Scan scan = scan_of(kAhead, [&](double x, double y) {
      return e[0] + e[1] * x + e[2] * lane(x, y) + e[3] * x * x + e[4] * x * lane(x, y);
    });
    const RoadShape fitted = fit(kAhead, scan, shape);
    const double tolerance[] = {0.01, 1e-3, 2e-3, 2e-5, 1e-4};
    for (int32_t k = 0; k < RoadShape::kTerms; ++k) {
      CAPTURE(k);
      CHECK(std::fabs(double(fitted.term[k]) - e[k]) < tolerance[k]);
    }
  }
}

TEST_CASE("fit_road: a sensor whose pitch or roll is wrong by 3 deg finds its ground, also over known heights") {
  constexpr double kWrong = 0.052;
  for (const auto& [pitch, roll] : {std::pair{kWrong, 0.0}, {-kWrong, 0.0}, {0.0, kWrong}, {0.0, -kWrong}})
    for (const auto& [source, near_m] :
         {std::pair{Source::kNone, 0.0f}, {Source::kLearned, 0.0f}, {Source::kLearned, 10.0f}}) {
      if (near_m > 0.0f && roll != 0.0) continue;  // too few columns show a roll of the ground far ahead
      CAPTURE(near_m);
      CAPTURE(pitch);
      CAPTURE(roll);
      RoadShape shape;
      shape.expected.source = source;
      std::fill_n(shape.expected.base_m, ExpectedRoad::kPlaces, 0.0f);
      std::fill_n(shape.expected.twist, ExpectedRoad::kPlaces, 0.0f);
      const double along = pitch, across = roll;
      Scan scan = scan_of(kAhead, [&](double x, double y) { return along * x + across * y; });
      for (int32_t r = 0; r < kAhead.rows; ++r)
        for (int32_t c = 0; c < kAhead.cols; ++c)
          if (scan.range.at(r, c) < near_m) scan.range.at(r, c) = kNoReturn;
      const RoadShape fitted = fit(kAhead, scan, shape);
      for (const float x : {10.0f, 25.0f})
        for (const float y : {-4.0f, 4.0f}) {
          CAPTURE(x);
          CAPTURE(y);
          CHECK(std::fabs(double(fitted.height_at(x, y)) - (pitch * double(x) + roll * double(y))) < 0.11);
        }
    }
}

TEST_CASE("fit_road: too little ground, or ground of one place, leaves the terms as they are") {
  const auto bent = [](double x, double) { return 0.04 + 3e-4 * x * x; };
  RoadShape before;
  before.term[0] = 0.03f, before.term[3] = 2e-4f;
  Scan scan = scan_of(kAhead, bent);
  CHECK(fit(kAhead, scan, before).term[0] != before.term[0]);
  for (int32_t r = 0; r < kAhead.rows; ++r)
    for (int32_t c = 0; c < kAhead.cols; ++c)
      if (r < kAhead.rows - 4) scan.range.at(r, c) = kNoReturn;  // 2 to 3 m ahead
  CHECK(std::memcmp(fit(kAhead, scan, before).term, before.term, sizeof before.term) == 0);
  scan.range.fill(kNoReturn);
  CHECK(std::memcmp(fit(kAhead, scan, before).term, before.term, sizeof before.term) == 0);
}

TEST_CASE("fit_road: what stands on the road does not lift it") {
  const auto level = [](double, double) { return 0.0; };
  const auto with_box = [](double x, double y) {
    return x > 22.0 && x < 27.0 && std::fabs(y) < 1.0 ? 0.5 + 0.1 * (x - 22.0) : 0.0;
  };
  const RoadShape alone = fit(kAhead, scan_of(kAhead, level)), beside = fit(kAhead, scan_of(kAhead, with_box));
  for (const float x : {10.0f, 40.0f, 80.0f})
    CHECK(std::fabs(beside.height_at(x, 0.0f) - alone.height_at(x, 0.0f)) < 0.02f);
}

// From 28 to 60 m the road returns nothing. The far part is 0.6 m over the tangent of the near one, so over that it is
// no ground.
TEST_CASE("fit_road: each pass walks over the shape so far: where it bends, ground beyond a gap still counts") {
  const auto bent = [](double x, double) { return 5e-4 * x * x; };
  Scan scan = scan_of(kAhead, bent);
  for (int32_t r = 0; r < kAhead.rows; ++r)
    for (int32_t c = 0; c < kAhead.cols; ++c)
      if (scan.range.at(r, c) > 28.0f && scan.range.at(r, c) < 60.0f) scan.range.at(r, c) = kNoReturn;
  CHECK(std::fabs(double(fit(kAhead, scan).height_at(80.0f, 0.0f)) - bent(80.0, 0.0)) < 0.05);
}

// A road that is expected to rise by 1 % and to fall by 2 % to the left of the lane, up to 5 m.
RoadShape expect(Source source) {
  RoadShape shape;
  shape.expected.source = source;
  shape.expected.left_m = shape.expected.right_m = 5.0f;
  for (int32_t i = 0; i < ExpectedRoad::kPlaces; ++i) {
    shape.expected.base_m[i] = 0.01f * (ExpectedRoad::kFirst_m + float(i) * ExpectedRoad::kStep_m);
    shape.expected.twist[i] = -0.02f;
  }
  return shape;
}

TEST_CASE("fit_road: the expected road lies between its places, goes on beyond them, and ends beside the bank") {
  const RoadShape shape = expect(Source::kMap);
  CHECK(shape.expected_at(12.0f, 0.0f) == doctest::Approx(0.12));
  CHECK(shape.expected_at(150.0f, 0.0f) == doctest::Approx(1.5));
  CHECK(shape.expected_at(-120.0f, 3.0f) == doctest::Approx(-1.2 - 0.06));
  CHECK(shape.expected_at(0.0f, 9.0f) == doctest::Approx(-0.1));
  CHECK(shape.expected_at(0.0f, -9.0f) == doctest::Approx(0.1));
  CHECK(expect(Source::kNone).expected_at(12.0f, 3.0f) == 0.0f);
}

TEST_CASE("fit_road: the terms are the difference to the expected road; where its heights are known, a plane") {
  const auto risen = [](double x, double y) { return 0.04 + 0.01 * x - 0.02 * std::fmin(std::fmax(y, -5.0), 5.0); };
  const auto bent = [&](double x, double y) { return risen(x, y) + 1e-4 * x * x; };
  const RoadShape map = fit(kAhead, scan_of(kAhead, risen), expect(Source::kMap));
  CHECK(map.term[0] == doctest::Approx(0.04).scale(0).epsilon(0.1));
  CHECK(std::fabs(map.term[1]) < 1e-3f);
  CHECK(std::fabs(map.term[2]) < 2e-3f);
  CHECK(fit(kAhead, scan_of(kAhead, bent), expect(Source::kWay)).term[3] ==
        doctest::Approx(1e-4).scale(0).epsilon(0.1));
  CHECK(std::fabs(fit(kAhead, scan_of(kAhead, bent), expect(Source::kLearned)).term[3]) < 1e-5f);
  // Only where heights are known ground counts.
  RoadShape near = expect(Source::kLearned);
  near.expected.from_m = 0.0f, near.expected.to_m = 12.0f;
  const auto step = [&](double x, double y) { return risen(x, y) - 0.04 - (x > 12.0 ? 0.15 : 0.0); };
  CHECK(std::fabs(fit(kAhead, scan_of(kAhead, step), near).height_at(20.0f, 0.0f) - 0.2f) < 0.02f);
}

TEST_CASE("fit_road: every ISA writes the reference's bytes, for images of any size, with every source") {
  std::mt19937_64 random(7);
  const auto draw = [&](double low, double high) { return std::uniform_real_distribution<double>(low, high)(random); };
  const KernelTable* tables[8] = {};
  const int32_t count = list_kernels(tables);
  int32_t fitted = 0;
  for (int32_t n = 0; n < 300; ++n) {
    const int32_t rows = n % 50 == 0 ? 300 + n : 1 + int32_t(random() % 64), cols = 1 + int32_t(random() % 900);
    SensorModel sensor = make_sensor_model(rows, cols, draw(0.2, 3.0), draw(-3.0, 0.1), false, 0.5, 300.0);
    sensor.T_vehicle_sensor = make_transform(draw(-1, 3), draw(-1, 1), draw(0.3, 2), draw(-0.1, 0.1), draw(-0.1, 0.1),
                                             n % 3 == 0 ? 0.0 : draw(-3, 3));
    const double bend = draw(-1e-3, 1e-3);
    Scan scan = scan_of(sensor, [&](double x, double y) { return bend * x * x + 0.02 * y; });
    for (int32_t r = 0; r < rows; ++r)
      for (int32_t c = 0; c < cols; ++c) {
        if (random() % 8 == 0) scan.range.at(r, c) = kNoReturn;
        if (random() % 8 == 0) scan.range.at(r, c) *= float(draw(0.2, 1.0));
      }
    RoadShape shape = expect(Source(n % 4));
    for (int32_t i = 0; i < ExpectedRoad::kPlaces; ++i) shape.expected.base_m[i] += float(draw(-0.05, 0.05));
    shape.curvature = float(draw(-0.02, 0.02));
    if (n % 5 == 0) shape.expected.from_m = float(draw(-30, 0)), shape.expected.to_m = float(draw(0, 60));
    const RoadShape expected = fit(sensor, scan, shape);
    fitted += expected.term[0] != 0.0f;
    for (int32_t t = 1; t < count; ++t) {
      CAPTURE(tables[t]->isa);
      CAPTURE(n);
      const RoadShape got = fit(sensor, scan, shape, tables[t]->isa);
      CHECK(std::memcmp(got.term, expected.term, sizeof expected.term) == 0);
    }
  }
  CHECK(fitted > 100);
}

}  // namespace
}  // namespace overtake
