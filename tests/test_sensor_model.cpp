// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
#include "core/sensor_model.h"

#include <doctest/doctest.h>

#include <cmath>
#include <random>

#include "core/math.h"

namespace overtake {
namespace {

struct Point {
  double x, y, z;
};
Point apply(const Transform& T, Point p) {
  return {double(T.r[0]) * p.x + double(T.r[1]) * p.y + double(T.r[2]) * p.z + double(T.t[0]),
          double(T.r[3]) * p.x + double(T.r[4]) * p.y + double(T.r[5]) * p.z + double(T.t[1]),
          double(T.r[6]) * p.x + double(T.r[7]) * p.y + double(T.r[8]) * p.z + double(T.t[2])};
}
void check_point(Point got, Point want) {
  CHECK(std::fabs(got.x - want.x) < 1e-6);
  CHECK(std::fabs(got.y - want.y) < 1e-6);
  CHECK(std::fabs(got.z - want.z) < 1e-6);
}

TEST_CASE("transform: yaw turns x to the left, pitch turns x down, roll turns y up") {
  const double quarter = kHalfPi;
  check_point(apply(make_transform(0, 0, 0, 0, 0, quarter), {1, 0, 0}), {0, 1, 0});
  check_point(apply(make_transform(0, 0, 0, 0, quarter, 0), {1, 0, 0}), {0, 0, -1});
  check_point(apply(make_transform(0, 0, 0, quarter, 0, 0), {0, 1, 0}), {0, 0, 1});
  check_point(apply(make_transform(1, 2, 3, 0, 0, 0), {4, 5, 6}), {5, 7, 9});
}

TEST_CASE("transform: applies roll, then pitch, then yaw, then the translation") {
  const unsigned seed = 11;
  CAPTURE(seed);
  std::mt19937_64 random(seed);
  std::uniform_real_distribution<double> angle(-3.0, 3.0), place(-1.0, 1.0);
  for (int i = 0; i < 200; ++i) {
    const double roll = angle(random), pitch = angle(random), yaw = angle(random);
    const Point t{place(random), place(random), place(random)}, p{place(random), place(random), place(random)};
    const Point a = apply(make_transform(0, 0, 0, roll, 0, 0), p);
    const Point b = apply(make_transform(0, 0, 0, 0, pitch, 0), a);
    const Point c = apply(make_transform(0, 0, 0, 0, 0, yaw), b);
    check_point(apply(make_transform(t.x, t.y, t.z, roll, pitch, yaw), p), {c.x + t.x, c.y + t.y, c.z + t.z});
  }
}

TEST_CASE("transform: a rotation keeps lengths and handedness") {
  const Transform T = make_transform(0, 0, 0, 0.3, -0.7, 2.2);
  const Point x = apply(T, {1, 0, 0}), y = apply(T, {0, 1, 0}), z = apply(T, {0, 0, 1});
  CHECK(std::fabs(x.x * x.x + x.y * x.y + x.z * x.z - 1) < 1e-6);
  CHECK(std::fabs(x.x * y.x + x.y * y.y + x.z * y.z) < 1e-6);
  check_point({x.y * y.z - x.z * y.y, x.z * y.x - x.x * y.z, x.x * y.y - x.y * y.x}, z);
}

TEST_CASE("sensor_model: 120 degrees and 857 columns give columns of 0.14 degrees") {
  const SensorModel m = make_sensor_model(32, 857, kPi / 3, -kPi / 3, false, 0.5, 250.0);
  const double pitch = 2 * kPi / 3 / 857;
  CHECK(m.rows == 32);
  CHECK(m.cols == 857);
  CHECK(m.azimuth_left_rad == float(kPi / 3));
  CHECK(m.pitch_rad == float(pitch));
  CHECK(m.inverse_pitch == float(1 / pitch));
  CHECK(m.sin_pitch == float(std::sin(pitch)));
  CHECK(m.cos_pitch == float(std::cos(pitch)));
  CHECK_FALSE(m.wraps);
  CHECK(m.range_min_m == 0.5f);
  CHECK(m.range_max_m == 250.0f);
}

TEST_CASE("sensor_model: the columns of a sensor that wraps cover exactly one turn") {
  const SensorModel m = make_sensor_model(64, 2048, kPi, 0.0, true, 1.0, 120.0);
  CHECK(m.wraps);
  CHECK(m.pitch_rad == float(kTwoPi / 2048));
}

}  // namespace
}  // namespace overtake
