// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// What stands in front of a wall, in one cluster with it, gets a label of its own (step split_clusters).
#include <doctest/doctest.h>

#include <cmath>
#include <vector>

#include "core/math.h"
#include "pipeline/method/split_walls.h"
#include "tests/support/one_cluster.h"

namespace overtake {
namespace {

constexpr SplitWallsParams kUsual = {0.5f, 4.88f, 1.93f, 2.0f};

// A wall on the right, from -40 to 40 m along x, at y = -wall_m; with a curvature, and turned around the vehicle.
class Scene {
 public:
  explicit Scene(float wall_m = 7.0f, float curvature_per_m = 0.0f, float turn_rad = 0.0f, float length_m = 80.0f)
      : wall_m_(wall_m), curvature_(curvature_per_m), cos_(std::cos(turn_rad)), sin_(std::sin(turn_rad)) {
    for (float along = -0.5f * length_m; along < 0.5f * length_m; along += 0.1f) add(along, 0.0f, 0.6f, false);
  }
  // A point in front of the wall. `own`: it is to get a label of its own.
  void add(float along, float inside, float height_m = 0.6f, bool own = true) {
    const float x = along, y = inside - wall_m_ + 0.5f * curvature_ * along * along;
    points_.add(x * cos_ - y * sin_, x * sin_ + y * cos_, height_m);
    own_.push_back(own);
  }
  // A plate that reaches from the wall to depth_m, length_m along it.
  void add_box(float along, float length_m, float depth_m, float height_m = 0.6f, bool own = true) {
    for (float inside = 0.0f; inside <= depth_m; inside += 0.08f) add(along, inside, height_m, own && inside > 0.5f);
    for (float at = 0.0f; at <= length_m; at += 0.08f) add(along + at, depth_m, height_m, own && depth_m > 0.5f);
  }
  int32_t split(const SplitWallsParams& params = kUsual, int32_t label_count = 1) {
    return points_.run([&](const ClusterTable& clusters, const ClusterPointTable& members, Plane<const float> heights,
                           PointTable& points, Plane<int32_t> labels) {
      return split_walls(params, clusters, members, heights, label_count, points, labels);
    });
  }
  // Points whose label is not what it should be. Near inside_m the line's error decides.
  int32_t wrong() {
    int32_t count = 0;
    for (std::size_t k = 0; k < own_.size(); ++k)
      count += (points_.label_of(k) > 1) != (own_[k] && points_.has_own_pixel(k));  // without a pixel it has no height
    return count;
  }
  int32_t pixel_count() const { return points_.pixel_count(); }
  bool last_has_pixel() const { return points_.has_own_pixel(points_.size() - 1); }

 private:
  float wall_m_, curvature_, cos_, sin_;
  std::vector<bool> own_;
  test::OneCluster points_;
};

}  // namespace

TEST_CASE("split_walls: a car that touches a wall, at any angle to it, gets a label of its own") {
  for (const float depth_m : {1.9f, 3.5f, 5.0f})
    for (const float length_m : {1.9f, 4.9f})
      for (const float along : {-20.0f, 3.0f, 30.0f}) {
        CAPTURE(depth_m);
        CAPTURE(length_m);
        CAPTURE(along);
        Scene scene;
        scene.add_box(along, length_m, depth_m);
        CHECK(scene.split() == 2);
        CHECK(scene.wrong() <= 3);
      }
}

TEST_CASE("split_walls: the wall may be on either side, curved, and in any direction") {
  for (const float wall_m : {-7.0f, 7.0f})
    for (const float curvature : {-0.004f, 0.0f, 0.004f})
      for (const float turn_deg : {0.0f, 25.0f, 90.0f, -140.0f}) {
        CAPTURE(wall_m);
        CAPTURE(curvature);
        CAPTURE(turn_deg);
        Scene scene(wall_m, curvature, turn_deg * float(kPi / 180));
        CHECK(scene.split() == 1);
        const float side = wall_m > 0.0f ? 1.0f : -1.0f;
        for (float inside = 0.0f; inside < 4.0f; inside += 0.05f) scene.add(30.0f, side * inside, 0.6f, inside > 0.5f);
        CHECK(scene.split() == 2);
        CHECK(scene.wrong() <= 4);
      }
}

TEST_CASE("split_walls: two cars at one wall get a label each; cars closer than a metre do not") {
  Scene two;
  two.add_box(5.0f, 1.9f, 4.0f);
  two.add_box(12.0f, 1.9f, 4.0f);
  CHECK(two.split() == 3);
  CHECK(two.wrong() <= 6);
  Scene close;  // longer than a car, together
  close.add_box(5.0f, 3.0f, 3.0f);
  close.add_box(9.0f, 3.0f, 3.0f);
  CHECK(close.split() == 1);
}

TEST_CASE("split_walls: there are no more labels than pixels") {
  Scene two;
  two.add_box(5.0f, 1.9f, 4.0f);
  two.add_box(12.0f, 1.9f, 4.0f);
  CHECK(two.split(kUsual, two.pixel_count() - 1) == two.pixel_count());
  CHECK(two.split(kUsual, two.pixel_count()) == two.pixel_count());
}

TEST_CASE("split_walls: what is no car stays a part of the wall") {
  const auto labels = [](float length_m, float depth_m, float height_m) {
    Scene scene;
    scene.add_box(5.0f, length_m, depth_m, height_m, false);
    return scene.split();
  };
  REQUIRE(labels(2.0f, 3.0f, 0.6f) == 2);
  CHECK(labels(7.0f, 3.0f, 0.6f) == 1);   // too long: the wall itself, nearer
  CHECK(labels(2.0f, 7.0f, 0.6f) == 1);   // a wall across
  CHECK(labels(2.0f, 0.8f, 0.6f) == 1);   // flat
  CHECK(labels(2.0f, 3.0f, 2.5f) == 1);   // above: a catch fence
  CHECK(labels(2.0f, 3.0f, 0.05f) == 1);  // on the ground
  Scene two;                              // a car, and something flat
  two.add_box(5.0f, 2.0f, 3.0f);
  two.add_box(15.0f, 2.0f, 0.8f, 0.6f, false);
  CHECK(two.split() == 2);
  Scene few;
  for (int32_t with_pixel = 0; with_pixel < 14;) {
    few.add(5.0f, 1.0f + 0.1f * float(with_pixel));
    with_pixel += few.last_has_pixel();
  }
  CHECK(few.split() == 1);
  do few.add(5.0f, 3.0f);
  while (!few.last_has_pixel());
  CHECK(few.split() == 2);
  Scene behind;  // a stand, on the other side
  for (float inside = 0.0f; inside > -4.0f; inside -= 0.05f) behind.add(10.0f, inside, 0.6f, false);
  CHECK(behind.split() == 1);
}

TEST_CASE("split_walls: only near, long clusters of many points with one line; cut.wall_m 0 switches it off") {
  const auto labels = [](float wall_m, float length_m, float inside_m = 0.5f) {
    Scene scene(wall_m, 0.0f, 0.0f, length_m);
    scene.add_box(-1.0f, 1.9f, 3.5f);
    SplitWallsParams params = kUsual;
    params.inside_m = inside_m;
    return scene.split(params);
  };
  REQUIRE(labels(7.0f, 40.0f) == 2);
  CHECK(labels(7.0f, 7.0f) == 1);    // as long as a car and a half
  CHECK(labels(95.0f, 40.0f) == 1);  // far away
  CHECK(labels(7.0f, 40.0f, 0.0f) == 1);
  for (const float along : {80.0f, 100.0f}) {  // the same wall, near and far
    CAPTURE(along);
    Scene long_wall(7.0f, 0.0f, 0.0f, 240.0f);
    long_wall.add_box(along, 1.9f, 3.5f);
    CHECK(long_wall.split() == (along < 90.0f ? 2 : 1));
  }
  Scene bent(7.0f, 0.0f, 0.0f, 24.0f);  // two walls in one cluster: fewer than three fifths lie on any line
  for (float along = -12.0f; along < 12.0f; along += 0.1f) bent.add(along, 3.0f + 0.8f * along, 0.6f, false);
  CHECK(bent.split() == 1);
}

}  // namespace overtake
