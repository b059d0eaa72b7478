// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// Angle image (eq. 1).
#include "kernels/angle_image.h"

#include <doctest/doctest.h>

#include <cmath>
#include <random>

#include "tests/support/images.h"
#include "tests/support/paper_params.h"
#include "tests/support/ray_scene.h"

namespace overtake {
namespace {

using test::kDegree;
using test::OwnedPlane;

TEST_CASE("angle_image: 0 is level, 90 deg upright, up or down alike") {
  // One pixel pair per column, given as points (h, z) seen from the origin.
  struct Pair {
    double h0, z0, h1, z1, degrees;
  };
  const Pair pairs[] = {
      {20, -1.5, 10, -1.5, 0},   // ground
      {12, 1, 12, -1, 90},       // wall
      {11, -0.5, 10, -1.5, 45},  // ramp up, away from the sensor
      {10, 0.5, 11, -0.5, 45},   // overhang: the upper pixel is nearer
      {30, 1 + std::sqrt(3.0), 27, 1, std::atan2(std::sqrt(3.0), 3.0) / kDegree},
  };
  OwnedPlane<float> range(2, 5), elevation(2, 5), angle(2, 5);
  for (int32_t c = 0; c < 5; ++c) {
    const Pair& p = pairs[c];
    range.at(0, c) = float(std::hypot(p.h0, p.z0));
    range.at(1, c) = float(std::hypot(p.h1, p.z1));
    elevation.at(0, c) = float(std::atan2(p.z0, p.h0));
    elevation.at(1, c) = float(std::atan2(p.z1, p.h1));
  }
  ref::angle_image(test::paper_params().angle_image, range, elevation, angle);
  for (int32_t c = 0; c < 5; ++c) {
    CAPTURE(c);
    CHECK(std::fabs(double(angle.at(0, c)) / kDegree - pairs[c].degrees) < 1e-3);
    CHECK(angle.at(1, c) == kAngleUndefined);
  }
}

TEST_CASE("angle_image: agrees with atan2 in double on random pairs") {
  std::mt19937 random(5);
  INFO("seed 5");
  std::uniform_real_distribution<float> any_range(1, 100), any_elevation(-0.6f, 0.6f);
  const int32_t rows = 9, cols = 37;  // two full stripes and a partial one
  OwnedPlane<float> range(rows, cols), elevation(rows, cols), angle(rows, cols);
  for (int32_t r = 0; r < rows; ++r)
    for (int32_t c = 0; c < cols; ++c) {
      range.at(r, c) = any_range(random);
      elevation.at(r, c) = any_elevation(random);
    }
  ref::angle_image(test::paper_params().angle_image, range, elevation, angle);
  for (int32_t r = 0; r + 1 < rows; ++r)
    for (int32_t c = 0; c < cols; ++c) {
      const double r0 = double(range.at(r, c)), r1 = double(range.at(r + 1, c));
      const double e0 = double(elevation.at(r, c)), e1 = double(elevation.at(r + 1, c));
      const double dz = std::fabs(r0 * std::sin(e0) - r1 * std::sin(e1));
      const double dh = std::fabs(r0 * std::cos(e0) - r1 * std::cos(e1));
      if (std::fabs(e0 - e1) < 0.001) continue;
      CHECK(std::fabs(double(angle.at(r, c)) - std::atan2(dz, dh)) < 1e-4 / std::hypot(dz, dh) + 1e-6);
    }
}

TEST_CASE("angle_image: a pair with a missing pixel is undefined, and undefined is not ground") {
  // col 0: upper missing, 1: lower missing, 2: both, 3: none
  OwnedPlane<float> range({{0.0f, 10.0f, 0.0f, 10.0f}, {10.0f, 0.0f, 0.0f, 10.0f}});
  OwnedPlane<float> elevation({{0.0f, 0.1f, 0.0f, 0.1f}, {0.0f, 0.0f, 0.0f, 0.0f}});
  OwnedPlane<float> angle(2, 4);
  ref::angle_image(test::paper_params().angle_image, range, elevation, angle);
  for (int32_t c = 0; c < 3; ++c) CHECK(angle.at(0, c) == kAngleUndefined);
  CHECK(angle.at(0, 3) > 0.0f);
}

TEST_CASE("angle_image: skips pairs of layers closer than 0.05 deg") {
  const auto below = float(0.0499 * kDegree), above = float(0.0501 * kDegree);
  OwnedPlane<float> range({{10.0f, 10.0f, 10.0f, 10.0f, 0.0f}, {20.0f, 20.0f, 20.0f, 20.0f, 20.0f}});
  OwnedPlane<float> elevation({{0.0f, below, -below, above, 0.0f}, {0.0f, 0.0f, 0.0f, 0.0f, 0.0f}});
  OwnedPlane<float> angle(2, 5);
  ref::angle_image(test::paper_params().angle_image, range, elevation, angle);
  for (int32_t c = 0; c < 3; ++c) CHECK(angle.at(0, c) == kAngleSkipped);
  CHECK(angle.at(0, 3) >= 0.0f);
  CHECK(angle.at(0, 4) == kAngleUndefined);  // missing has priority over skipped
}

TEST_CASE("angle_image: one row has no pair") {
  OwnedPlane<float> range({{10.0f}}), elevation({{0.0f}}), angle(1, 1);
  ref::angle_image(test::paper_params().angle_image, range, elevation, angle);
  CHECK(angle.at(0, 0) == kAngleUndefined);
}

}  // namespace
}  // namespace overtake
