// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// Places on the centre line's pieces, against the projection on the map.
#include "pipeline/road/centre_line.h"

#include <doctest/doctest.h>

#include <cmath>
#include <vector>

#include "core/math.h"

namespace overtake {
namespace {

constexpr double kRadius_m = 80.0, kLeft_m = 6.0, kRight_m = 7.0;

void make_map(bool closed, CircuitMap& map) {
  const int32_t count = closed ? 251 : 101;
  std::vector<double> x, y, left, right;
  for (int32_t i = 0; i < count; ++i) {
    const double turn = kTwoPi * i / 251;
    x.push_back(5000.0 + kRadius_m * std::sin(turn));
    y.push_back(-3000.0 + kRadius_m * (1.0 - std::cos(turn)));
    left.push_back(kLeft_m), right.push_back(kRight_m);
  }
  REQUIRE(map.build(x.data(), y.data(), left.data(), right.data(), nullptr, count, closed, nullptr));
}

TEST_CASE("centre line: places beside it lie as far to the left as on the map, at the same length") {
  CircuitMap map;
  make_map(true, map);
  const double start = map.length_m() - 20.0;  // over the start
  const MapPose origin = map.at(start);
  CentreLine line;
  line.lay(map, start, 2.5, 41, origin.x_m, origin.y_m);
  CHECK(line.first == 0);
  CHECK(line.last == 40);
  int32_t piece = 20;
  for (double along = -48.0; along <= 48.0; along += 0.7)
    for (const double left : {-12.0, -3.0, 0.0, 2.0, 20.0}) {
      CAPTURE(along);
      CAPTURE(left);
      const MapPose at = map.at(start + along);
      const float x = float(at.x_m - left * std::sin(at.heading_rad) - origin.x_m);
      const float y = float(at.y_m + left * std::cos(at.heading_rad) - origin.y_m);
      const float t = line.find_piece(x, y, piece);
      // A piece is straight: beside its ends, along differs by the bend over its length.
      CHECK(std::fabs(2.5 * (double(piece - 20) + double(t)) - along) < 0.02 + std::fabs(left) * 2.6 / kRadius_m);
      CHECK(std::fabs(double(line.measure_left(x, y, piece)) - left) < 0.02);
      CHECK(line.left_m[piece] == float(kLeft_m));
      CHECK(line.right_m[piece] == float(kRight_m));
    }
}

TEST_CASE("centre line: where the search begins has no effect") {
  CircuitMap map;
  make_map(true, map);
  const MapPose origin = map.at(100.0), at = map.at(110.5);
  CentreLine line;
  line.lay(map, 100.0, 2.5, 41, origin.x_m, origin.y_m);
  for (const int32_t from : {-5, 0, 3, 20, 24, 39, 40, 99}) {
    int32_t piece = from;
    const float t = line.find_piece(float(at.x_m - origin.x_m), float(at.y_m - origin.y_m), piece);
    CHECK(piece == 24);
    CHECK(t == doctest::Approx(0.2).epsilon(0.01));
  }
}

TEST_CASE("centre line: ends with an open map, and places beyond are known as such") {
  CircuitMap map;
  make_map(false, map);
  const MapPose origin = map.at(10.0);
  CentreLine line;
  line.lay(map, 10.0, 2.5, 41, origin.x_m, origin.y_m);
  CHECK(line.first == 16);
  CHECK(line.last == 40);
  CHECK(!line.empty());
  const MapPose start = map.at(0.0);
  int32_t piece = 30;
  const float x = float(start.x_m - 3.0 * std::cos(start.heading_rad) - origin.x_m);
  const float y = float(start.y_m - 3.0 * std::sin(start.heading_rad) - origin.y_m);
  CHECK(line.find_piece(x, y, piece) < -1.0f);
  CHECK(piece == 16);
  line.lay(map, map.length_m() + 200.0, 2.5, 41, origin.x_m, origin.y_m);
  CHECK(line.empty());
}

}  // namespace
}  // namespace overtake
