// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// Ground removal by a running ground height.
#include "kernels/running_ground.h"

#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "tests/support/images.h"

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
    known_m.assign(2, known ? kEverywhere_m : 0.0f);
  }
  RoadSurface view() { return {offset_m.data(), slopes.data(), level.data(), known_m.data()}; }
  static constexpr float kEverywhere_m = 1e9f;
  std::vector<float> offset_m, slopes, level, known_m;
};

struct Place {
  float distance_m, height_m;  // from the sensor's axis; over the road under the sensor
};
constexpr Place kMissing = {0.0f, 0.0f};

// Not the defaults: these are tuned, and the rules stay as they are.
RunningGroundParams params() {
  return {.height_m = 0.1f,
          .known = {.per_m = 0.004f, .limit_m = 0.25f, .slope_limit = 0.02f, .slope_reach_m = 20.0f},
          .guess = {.per_m = 0.02f, .limit_m = 0.5f, .slope_limit = 0.45f, .slope_reach_m = 4.0f},
          .start_per_m = 0.012f,
          .start_limit_m = 0.5f,
          .level_reach_m = 3.0f,
          .free_level_m = 6.0f,
          .level_slope_slack = 0.03f,
          .echo_limit_m = 1e9f,
          .foot_slope = 1.7f};
}

// One column, from the bottom row up. The result has the same order: 'o' non-ground, '.' ground, ' ' no return, 'x' no
// return but non-ground.
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
      text += nonground.view().test(r, 0) ? (range.at(r, 0) > 0.0f ? 'o' : 'x') : range.at(r, 0) > 0.0f ? '.' : ' ';
    return text;
  }
  int32_t rows;
  OwnedPlane<float> range, elevation, height;
  OwnedBits nonground, steep;
};

TEST_CASE("running_ground: a level road is ground, an upright obstacle on it is not") {
  CHECK(Column({{5, 0}, {8, 0}, {14, 0}, {30, 0}}).marks() == "....");
  CHECK(Column({{5, 0}, {8, 0}, {8.6f, 0.5f}, {8.6f, 1.0f}}).marks() == "..oo");
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
  for (int32_t i = 1; i < 20; ++i) hill.push_back({float(5 * i), 0.025f * float(std::max(5 * i - 10, 0))});
  CHECK(Column(hill, FlatRoad(false)).marks() == std::string(19, '.'));
  // On a known road a climb of 2.5 % is an error of the ego pose at most in part.
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
  // The road before it, not steep, is not.
  CHECK(Column({{8, 0}, {8.2f, -0.01f}, {8.31f, 0.05f}, {8.32f, 0.4f}}).marks() == "..oo");
  // The foot of a wall that stands lower than the road, but not what lies more than 0.5 m below it.
  CHECK(Column({{8, 0}, {8.3f, -0.45f}, {8.31f, 0.05f}, {8.32f, 0.4f}}).marks() == ".ooo");
  CHECK(Column({{8, 0}, {8.3f, -0.55f}, {8.31f, 0.05f}, {8.32f, 0.4f}}).marks() == "..oo");
  RunningGroundParams no_feet = params();
  no_feet.foot_slope = 1e9f;
  CHECK(Column({{8, 0}, {8.2f, -0.01f}, {8.31f, 0.05f}, {8.32f, 0.4f}}, FlatRoad(), no_feet).marks() == "...o");
}

TEST_CASE("running_ground: a hole in the road is ground, and does not become the running ground") {
  CHECK(Column({{10, 0}, {15, -5.0f}, {20, 0}, {40, 0}}).marks() == "....");
}

TEST_CASE("running_ground: the allowed height grows with the distance from the last ground pixel, up to a limit") {
  struct Case {
    bool known;
    float distance_m, allowed_m;  // the last ground pixel lies at 10 m
  };
  // 0.1 m + 0.004 per metre up to 0.25 m on a known road; 0.1 m + 0.02 per metre up to 0.5 m on a guess.
  for (const Case& c :
       {Case{true, 14, 0.116f}, {true, 35, 0.2f}, {true, 41, 0.224f}, {false, 20, 0.3f}, {false, 41, 0.5f}}) {
    CAPTURE(c.known);
    CAPTURE(c.distance_m);
    CHECK(Column({{2, 0}, {10, 0}, {c.distance_m, c.allowed_m - 0.005f}}, FlatRoad(c.known)).marks() == "...");
    CHECK(Column({{2, 0}, {10, 0}, {c.distance_m, c.allowed_m + 0.005f}}, FlatRoad(c.known)).marks() == "..o");
  }
}

TEST_CASE("running_ground: the road is known only between two known rays") {
  for (const std::size_t unknown : {0u, 1u}) {
    FlatRoad road;
    road.known_m[unknown] = 0.0f;
    CHECK(Column({{6, 0}, {10, 0}, {25, 0.2f}}, road).marks() == "...");
    road.known_m[unknown] = 24.0f;  // up to here
    CHECK(Column({{6, 0}, {10, 0}, {25, 0.2f}}, road).marks() == "...");
    road.known_m[unknown] = 26.0f;
    CHECK(Column({{6, 0}, {10, 0}, {25, 0.2f}}, road).marks() == "..o");
  }
  CHECK(Column({{6, 0}, {10, 0}, {25, 0.2f}}).marks() == "..o");
}

TEST_CASE(
    "running_ground: before the slope is measured, over 2 m and a quarter of the run, the allowed height grows "
    "faster") {
  // 0.1 m + 0.012 per metre up to 0.5 m: the attitude of the pose errs.
  CHECK(Column({{20, 0.33f}}).marks() == ".");
  CHECK(Column({{20, 0.35f}}).marks() == "o");
  CHECK(Column({{50, 0.49f}}).marks() == ".");
  CHECK(Column({{50, 0.51f}}).marks() == "o");
  CHECK(Column({{8, 0}, {9.9f, 0}, {15, 0.15f}}).marks() == "...");
  CHECK(Column({{8, 0}, {10.1f, 0}, {15, 0.15f}}).marks() == "..o");
  CHECK(Column({{8, 0}, {9.9f, 0}, {15, 0.17f}}).marks() == "..o");
  CHECK(Column({{8, 0}, {11, 0}, {23.1f, 0.2f}}).marks() == "...");
  CHECK(Column({{8, 0}, {11, 0}, {22.9f, 0.2f}}).marks() == "..o");
}

TEST_CASE("running_ground: a slope stays measured when a new reach begins") {
  // A new reach begins at 26 m, and the slope is measured from 24 m.
  CHECK(Column({{5, 0}, {24, 0}, {26, 0}, {50, 0.3f}}).marks() == "...o");
}

TEST_CASE("running_ground: what returns from farther than a road can is not ground") {
  // distance^2 / height over the tangent of the road: at most 55 m for a sensor 1 m over the road.
  RunningGroundParams fading = params();
  fading.echo_limit_m = 55.0f * 55.0f;
  const auto marks = [&](std::vector<Place> places, const FlatRoad& road = FlatRoad()) {
    return Column(std::move(places), road, fading).marks();
  };
  CHECK(marks({{10, 0}, {30, 0}, {54.5f, 0}}) == "...");
  CHECK(marks({{10, 0}, {30, 0}, {55.5f, 0}}) == "..o");
  CHECK(marks({{10, 0}, {30, 0}, {55.5f, -0.5f}}) == "..o");  // below the road, too
  // A road that rises from 40 m on shows more of itself: its tangent there is 1.8 m below the sensor.
  FlatRoad rises;
  for (const int32_t ray : {0, kNodes})
    for (int32_t i = 8; i < kNodes; ++i) {
      rises.offset_m[std::size_t(ray + i)] = -1.8f;
      rises.slopes[std::size_t(ray + i)] = 0.02f;
    }
  CHECK(marks({{10, 0}, {30, 0}, {73, 0.66f}}, rises) == "...");
  CHECK(marks({{10, 0}, {30, 0}, {75, 0.7f}}, rises) == "..o");
  // So does ground that is seen to rise from the surface.
  CHECK(marks({{10, 0}, {20, 0}, {30, 0.2f}, {40, 0.4f}, {50, 0.6f}, {60, 0.8f}}, FlatRoad(false)) == "......");
  // A tangent above the sensor, or just below it, is a bend of the surface: at least 0.6 m are assumed, so 42.6 m.
  FlatRoad low;
  low.offset_m.assign(low.offset_m.size(), -0.1f);
  CHECK(marks({{10, 0.9f}, {30, 0.9f}, {42, 0.9f}}, low) == "...");
  CHECK(marks({{10, 0.9f}, {30, 0.9f}, {43, 0.9f}}, low) == "..o");
}

TEST_CASE("running_ground: the level rule ends 3 m behind the last ground pixel, and allows a slack of 0.03") {
  // A level plane with a slope of 0.3 along the ray: a rise up to (0.3 + 0.03) * run + 0.1 m.
  const FlatRoad road(true, 0.3f);
  CHECK(Column({{10, 0}, {12, 0.75f}}, road).marks() == "..");
  CHECK(Column({{10, 0}, {12, 0.77f}}, road).marks() == ".o");
  CHECK(Column({{10, 0}, {12.99f, 0.9f}}, road).marks() == "..");
  CHECK(Column({{10, 0}, {13.01f, 0.9f}}, road).marks() == ".o");
  CHECK(Column({{10, 0}, {13.01f, 0.95f}}, FlatRoad(false, 0.3f)).marks() == ".o");
  // Without a map, 6 m: far from the vehicle the rows of an apron are so far apart.
  FlatRoad free(false, 0.3f);
  free.known_m.assign(2, -1.0f);
  CHECK(Column({{10, 0}, {15.99f, 1.8f}}, free).marks() == "..");
  CHECK(Column({{10, 0}, {16.01f, 1.8f}}, free).marks() == ".o");
  CHECK(Column({{10, 0}, {15.0f, 1.8f}}, free).marks() == ".o");
}

TEST_CASE("running_ground: feet: a chain of steep pairs down to the road; a missing pixel ends the chain") {
  const FlatRoad road;
  CHECK(Column({{8, 0}, {8.2f, -0.01f}, {8.31f, 0.05f}, {8.32f, 0.09f}, {8.33f, 0.4f}}).marks() == "..ooo");
  CHECK(Column({{8, 0}, {8.2f, -0.01f}, {8.31f, 0.05f}, kMissing, {8.33f, 0.4f}}).marks() == "... o");
  // A flat pair ends it, too: a slope of 1 between 0.05 m and 0.09 m.
  CHECK(Column({{8, 0}, {8.3f, 0.05f}, {8.34f, 0.09f}, {8.35f, 0.4f}}).marks() == "..oo");
}

TEST_CASE("running_ground: pixels that are nearer, or steep, or in a hole are ground but do not move the ground") {
  // Each is followed by a car's row of 0.24 m at 30 m, where 0.18 m is allowed behind ground at 10 m.
  CHECK(Column({{4, 0}, {10, 0}, {30, 0.24f}}).marks() == "..o");
  CHECK(Column({{4, 0}, {10, 0}, {9, 0.09f}, {30, 0.24f}}).marks() == "...o");
  CHECK(Column({{4, 0}, {10, 0}, {10.15f, 0.09f}, {30, 0.24f}}).marks() == "...o");  // a slope of 0.6
  CHECK(Column({{4, 0}, {10, 0}, {10.5f, 0.09f}, {30, 0.24f}}).marks() == "....");   // of 0.18: the road rises
  // A pixel 0.55 m below the road 1.5 m farther is a hole, 2 m farther a road that falls by 0.2 and 0.2 m at most.
  // Where the road is known it is a hole, too: it falls by 0.01 and 0.3 m at most.
  const FlatRoad guess(false);
  CHECK(Column({{4, 0}, {10, 0}, {11.5f, -0.55f}, {13, 0.05f}}, guess).marks() == "....");
  CHECK(Column({{4, 0}, {10, 0}, {12, -0.55f}, {13, 0.05f}}, guess).marks() == "...o");
  CHECK(Column({{4, 0}, {10, 0}, {12, -0.55f}, {13, 0.05f}}).marks() == "....");
  CHECK(Column({{4, 0}, {10, 0}, {12, -0.33f}, {13, 0.05f}}).marks() == "....");
  CHECK(Column({{4, 0}, {10, 0}, {12, -0.31f}, {13, 0.05f}}).marks() == "...o");
  CHECK(Column({{4, 0}, {10, 0}, {22, -0.43f}, {23, 0.05f}}).marks() == "....");
  CHECK(Column({{4, 0}, {10, 0}, {22, -0.41f}, {23, 0.05f}}).marks() == "...o");
  // Over a long run a guessed road falls by 0.04 and 1 m at most: farther below is a ghost.
  CHECK(Column({{4, 0}, {10, 0}, {30, -1.85f}, {31, 0.05f}}, guess).marks() == "....");
  CHECK(Column({{4, 0}, {10, 0}, {30, -1.75f}, {31, 0.05f}}, guess).marks() == "...o");
  // The image of a wall in a wet road, before any road: the road is seen all the same.
  CHECK(Column({{13, -3.7f}, {5, 0}, {7, 0}, {10, 0}, {15, 0}}).marks() == ".....");
  CHECK(Column({{13, -3.7f}, {5, 0}, {7, 0}, {10, 0}, {15, 0.5f}}).marks() == "....o");
}

TEST_CASE("running_ground: the running slope is measured over a reach, limited, and not from the road at the sensor") {
  // A mounting that is 0.1 m too low lifts the first pixel; a slope from it would hide the row at 24 m.
  CHECK(Column({{4, 0.1f}, {24, 0.45f}}, FlatRoad(false)).marks() == ".o");
  CHECK(Column({{4, 0.1f}, {24, 0.43f}}, FlatRoad(false)).marks() == "..");
  // A road that the surface has 1.5 % too flat is followed to the end; the slope is that of the last 20 m.
  std::vector<Place> hill;
  for (int32_t i = 1; i < 25; ++i) hill.push_back({float(4 * i), 0.015f * float(4 * i)});
  CHECK(Column(hill).marks() == std::string(24, '.'));
  hill.push_back({140, 0.015f * 140});  // without a slope 0.6 m above the ground at 96 m
  CHECK(Column(hill).marks() == std::string(25, '.'));
  hill.back().height_m += 0.3f;
  CHECK(Column(hill).marks().back() == 'o');
  // The slope is limited: 3 % are followed from pixel to pixel, but not over 44 m.
  hill.clear();
  for (int32_t i = 1; i < 52; ++i) hill.push_back({float(2 * i), 0.03f * float(2 * i)});
  hill.push_back({146, 0.03f * 146});
  CHECK(Column(hill).marks() == std::string(51, '.') + "o");
  RunningGroundParams steeper = params();
  steeper.known.slope_limit = 0.03f;
  CHECK(Column(hill, FlatRoad(), steeper).marks() == std::string(52, '.'));
}

// A surface of three rays, each level at another height.
TEST_CASE("running_ground: the surface is interpolated between the rays on either side of a column") {
  constexpr int32_t kCols = 2 * kRayColumns;
  std::vector<float> offset_m, slope(3 * kNodes, 0.0f), level(3, 0.0f), known(3, 1.0f);
  for (const float height : {-1.0f, -2.0f, -4.0f}) offset_m.insert(offset_m.end(), kNodes, height);
  OwnedPlane<float> range(1, kCols), elevation(1, kCols), height(1, kCols);
  OwnedBits nonground(1, kCols), steep(1, kCols);
  const auto road_z = [](int32_t c) {
    const float t = (float(c % kRayColumns) + 0.5f) / float(kRayColumns);
    return c < kRayColumns ? -1.0f - t : -2.0f - 2.0f * t;
  };
  for (int32_t c = 0; c < kCols; ++c) {
    range.at(0, c) = std::hypot(20.0f, road_z(c) + 0.05f);
    elevation.at(0, c) = std::atan2(road_z(c) + 0.05f, 20.0f);
  }
  ref::running_ground(params(), {offset_m.data(), slope.data(), level.data(), known.data()}, range, elevation, height,
                      nonground, steep);
  for (int32_t c = 0; c < kCols; ++c) CHECK(height.at(0, c) == doctest::Approx(0.05).scale(0).epsilon(0.02));
}

TEST_CASE("running_ground: a distance is read from its piece of the surface, beyond 160 m from the last one") {
  FlatRoad road;
  for (int32_t i = 0; i < 2 * kNodes; ++i) road.offset_m[std::size_t(i)] = -kSensor_m + 0.01f * float(i % kNodes);
  for (int32_t i = 0; i < kNodes; ++i) {
    const float from = node_distance_m(i), to = i + 1 < kNodes ? node_distance_m(i + 1) : 290.0f;
    for (const float distance : {from + 0.01f * (to - from), to - 0.01f * (to - from)}) {
      Column image({{distance, 0.0f}}, road);
      // The walk begins on the first piece.
      CHECK(image.height.at(0, 0) == doctest::Approx(-0.01 * i).epsilon(0.001));
    }
  }
}

TEST_CASE("running_ground: the height image is 0 without a return") {
  Column image({{10, 0}, kMissing, {30, 0.7f}});
  CHECK(image.height.at(1, 0) == 0.0f);
  CHECK(image.height.at(0, 0) == doctest::Approx(0.7f).epsilon(0.02));
}

}  // namespace
}  // namespace overtake
