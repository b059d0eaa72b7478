// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// Ground removal by a running ground height.
#include "kernels/running_ground.h"

#include <doctest/doctest.h>

#include <cmath>
#include <vector>

#include "tests/support/images.h"
#include "tests/support/paper_params.h"

namespace overtake {
namespace {

using test::OwnedBits;
using test::OwnedPlane;

constexpr float kSensor_m = 1.0f;  // height of the sensor over the road

// A road without a bend along one block of columns.
struct FlatRoad {
  explicit FlatRoad(bool known = true, float level_slope = 0.0f, float slope = 0.0f) {
    offset_m.assign(2 * kNodes, -kSensor_m);
    slopes.assign(2 * kNodes, slope);
    level.assign(2, level_slope);
    is_known.assign(2, known ? 1.0f : 0.0f);
  }
  RoadSurface view() { return {offset_m.data(), slopes.data(), level.data(), is_known.data()}; }
  std::vector<float> offset_m, slopes, level, is_known;
};

struct Place {
  float distance_m, height_m;  // from the sensor's axis; over the road under the sensor
};
constexpr Place kMissing = {0.0f, 0.0f};

RunningGroundParams params() { return test::paper_params().running_ground; }

// One column, from the bottom row up. The result has the same order: 'o' non-ground, '.' ground, ' ' no return.
struct Column {
  Column(std::vector<Place> places, FlatRoad road = FlatRoad(), RunningGroundParams rules = params())
      : rows(int32_t(places.size())),
        range(rows, 1),
        elevation(rows, 1),
        height(rows, 1),
        nonground(rows, 1),
        steep(rows, 1) {
    for (int32_t i = 0; i < rows; ++i) {
      const Place p = places[std::size_t(i)];
      const float z = p.height_m - kSensor_m;
      range.at(rows - 1 - i, 0) = p.distance_m > 0.0f ? std::hypot(p.distance_m, z) : 0.0f;
      elevation.at(rows - 1 - i, 0) = p.distance_m > 0.0f ? std::atan2(z, p.distance_m) : 0.0f;
    }
    ref::running_ground(rules, road.view(), range, elevation, height, nonground, steep);
    CHECK(test::tail_is_clear(nonground));
  }
  std::string marks() {
    std::string text;
    for (int32_t r = rows - 1; r >= 0; --r)
      text += range.at(r, 0) == 0.0f ? ' ' : nonground.view().test(r, 0) ? 'o' : '.';
    return text;
  }
  int32_t rows;
  OwnedPlane<float> range, elevation, height;
  OwnedBits nonground, steep;
};

TEST_CASE("running_ground: a level road is ground, an upright obstacle on it is not") {
  CHECK(Column({{5, 0}, {8, 0}, {14, 0}, {30, 0}}).marks() == "....");
  CHECK(Column({{5, 0}, {8, 0}, {8.1f, 0.5f}, {8.1f, 1.0f}}).marks() == "..oo");
}

TEST_CASE("running_ground: a car's lowest row is non-ground although the slope from the road before it is flat") {
  // One row at 80 m, 0.4 m over the road; the last ground pixel lies at 30 m.
  CHECK(Column({{10, 0}, {30, 0}, {80, 0.4f}}).marks() == "..o");
  CHECK(Column({{10, 0}, {30, 0}, {80, 0.2f}}).marks() == "...");
}

TEST_CASE("running_ground: a missing row changes nothing") {
  CHECK(Column({{10, 0}, kMissing, {30, 0}, kMissing, {80, 0.4f}}).marks() == ". . o");
  CHECK(Column({kMissing, kMissing, {30, 0}, {120, 0}}).marks() == "  ..");
}

TEST_CASE("running_ground: the road behind an obstacle is ground again") {
  CHECK(Column({{8, 0}, {12, 0.6f}, {12.2f, 0.9f}, {25, 0}, {50, 0}}).marks() == ".oo..");
}

TEST_CASE("running_ground: the foot of a wall does not lift the ground") {
  // Pixels within the tolerance, but steep: they stay ground, and the next one is measured from the road.
  Column wall({{19, 0}, {20, 0.02f}, {20.05f, 0.09f}, {20.1f, 0.16f}, {20.1f, 0.5f}});
  CHECK(wall.marks().substr(3) == "oo");
}

TEST_CASE("running_ground: a slow climb that the surface does not have is followed where the road is a guess") {
  std::vector<Place> hill;
  for (int32_t i = 1; i < 20; ++i) hill.push_back({float(5 * i), 0.04f * float(5 * i)});
  CHECK(Column(hill, FlatRoad(false)).marks() == std::string(19, '.'));
  // On a known road a climb of 4 % is an error of the ego pose at most in part.
  CHECK(Column(hill, FlatRoad(true)).marks().back() == 'o');
}

TEST_CASE("running_ground: heights are measured from the road surface") {
  std::vector<Place> hill;
  for (int32_t i = 1; i < 20; ++i) hill.push_back({float(5 * i), 0.1f * float(5 * i)});
  CHECK(Column(hill, FlatRoad(true, 0.0f, 0.1f)).marks() == std::string(19, '.'));
  Column image(hill, FlatRoad(true, 0.0f, 0.1f));
  for (int32_t r = 0; r < image.rows; ++r) CHECK(std::fabs(image.height.at(r, 0)) < 1e-3f);
}

TEST_CASE("running_ground: an apron that rises like a level plane is ground, a steeper one is not") {
  const std::vector<Place> apron = {{8, 0}, {9, 0.3f}, {10, 0.6f}, {12, 1.2f}, {15, 2.1f}};
  CHECK(Column(apron, FlatRoad(true, 0.3f)).marks() == ".....");
  CHECK(Column(apron, FlatRoad(true, 0.1f)).marks() == ".oooo");
}

TEST_CASE("running_ground: feet: ground below an obstacle belongs to it down a steep pair, at most to its foot") {
  // 0.05 m over the road is within the tolerance.
  CHECK(Column({{8, 0}, {8.3f, 0.01f}, {8.31f, 0.05f}, {8.32f, 0.4f}}).marks() == "..oo");
  RunningGroundParams no_feet = params();
  no_feet.foot_slope = 1e9f;
  CHECK(Column({{8, 0}, {8.3f, 0.01f}, {8.31f, 0.05f}, {8.32f, 0.4f}}, FlatRoad(), no_feet).marks() == "...o");
}

TEST_CASE("running_ground: a hole in the road is ground, and does not become the running ground") {
  CHECK(Column({{10, 0}, {15, -5.0f}, {20, 0}, {40, 0}}).marks() == "....");
}

TEST_CASE("running_ground: the height image is 0 without a return") {
  Column image({{10, 0}, kMissing, {30, 0.7f}});
  CHECK(image.height.at(1, 0) == 0.0f);
  CHECK(image.height.at(0, 0) == doctest::Approx(0.7f).epsilon(0.02));
}

}  // namespace
}  // namespace overtake
