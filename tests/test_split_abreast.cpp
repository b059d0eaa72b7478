// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// The step split_abreast: two cars side by side in one cluster get two labels.
#include <doctest/doctest.h>

#include <cmath>
#include <vector>

#include "core/math.h"
#include "pipeline/method/split_abreast.h"
#include "tests/support/one_cluster.h"

namespace overtake {
namespace {

constexpr float kLength_m = 4.88f, kWidth_m = 1.93f, kStep_m = 0.06f;
constexpr SplitAbreastParams kUsual = {0.25f, kLength_m, kWidth_m, 0.0024f};

// What is seen of cars: points of one cluster, in the axes of the cars, turned by heading_rad and moved at_m ahead.
class Cluster {
 public:
  explicit Cluster(float heading_rad = 0.0f, float at_m = 10.0f)
      : cos_(std::cos(heading_rad)), sin_(std::sin(heading_rad)), at_m_(at_m) {}

  void add(float along, float across) {
    points_.add(at_m_ + along * cos_ - across * sin_, along * sin_ + across * cos_);
    across_.push_back(across);
  }
  void add_line(float along_1, float across_1, float along_2, float across_2) {
    const float length_m = std::hypot(along_2 - along_1, across_2 - across_1);
    const int32_t steps = int32_t(length_m / kStep_m) + 1;
    for (int32_t k = 0; k <= steps; ++k) {
      const float share = float(k) / float(steps);
      add(along_1 + share * (along_2 - along_1), across_1 + share * (across_2 - across_1));
    }
  }
  // The rear end of a car whose right flank is at across_m, and that flank.
  void add_car(float along_m, float across_m, float flank_m = kLength_m) {
    add_line(along_m, across_m, along_m, across_m + kWidth_m);
    if (flank_m > 0.0f) add_line(along_m, across_m, along_m + flank_m, across_m);
  }
  std::size_t size() const { return points_.size(); }
  int32_t pixel_count() const { return points_.pixel_count(); }

  // The number of labels that the step returns.
  int32_t split(const SplitAbreastParams& params = kUsual, int32_t label_count = 1) {
    return points_.run(
        [&](const ClusterTable& clusters, const ClusterPointTable& members, Plane<const float>, PointTable& points,
            Plane<int32_t> labels) { return split_abreast(params, clusters, members, label_count, points, labels); });
  }
  // Whether exactly the points to the left of across_m have label 2.
  bool is_split_at(float across_m) {
    for (std::size_t k = 0; k < across_.size(); ++k)
      if (points_.label_of(k) != (across_[k] > across_m ? 2 : 1)) return false;
    return true;
  }

 private:
  float cos_, sin_, at_m_;
  std::vector<float> across_;
  test::OneCluster points_;
};

constexpr float kDegree = float(kPi / 180);

// Two cars with a gap between them, the left one ahead_m farther ahead.
Cluster two_cars(float gap_m, float ahead_m, float heading_rad = 0.0f, float at_m = 10.0f) {
  Cluster cluster(heading_rad, at_m);
  cluster.add_car(0.0f, 0.0f);
  cluster.add_car(ahead_m, kWidth_m + gap_m, 2.0f);
  return cluster;
}

}  // namespace

TEST_CASE("split_abreast: two cars with a gap between them get two labels, whatever their heading") {
  for (const float gap_m : {0.4f, 0.6f, 1.0f})
    for (const float ahead_m : {-1.5f, 0.4f, 3.0f})
      for (const float degree : {-40.0f, -11.0f, 0.0f, 8.0f, 33.0f}) {
        CAPTURE(gap_m);
        CAPTURE(ahead_m);
        CAPTURE(degree);
        Cluster cluster = two_cars(gap_m, ahead_m, degree * kDegree);
        CHECK(cluster.split() == 2);
        CHECK(cluster.is_split_at(kWidth_m + 0.5f * gap_m));
      }
}

TEST_CASE("split_abreast: a single car is never two, at any heading and whatever is seen of it") {
  for (const float flank_m : {0.0f, 1.0f, 3.0f, kLength_m})
    for (float degree = -180.0f; degree < 180.0f; degree += 7.0f) {
      CAPTURE(flank_m);
      CAPTURE(degree);
      Cluster cluster(degree * kDegree);
      cluster.add_car(0.0f, 0.0f, flank_m);
      CHECK(cluster.split() == 1);
      CHECK(cluster.is_split_at(INFINITY));
    }
  Cluster wheels(20.0f * kDegree);  // its ends alone, which leave strips at other headings
  for (const float along_m : {0.0f, 0.1f, 0.2f, kLength_m}) wheels.add_line(along_m, 0.0f, along_m, kWidth_m);
  CHECK(wheels.split() == 1);
}

TEST_CASE("split_abreast: no strip, or one that is too narrow or is not empty, divides nothing") {
  Cluster touching;
  for (const float across_m : {0.0f, kWidth_m + 0.15f}) touching.add_car(0.0f, across_m);
  CHECK(touching.split() == 1);
  SplitAbreastParams params = kUsual;
  params.strip_m = 0.7f;
  CHECK(two_cars(0.6f, 0.4f).split(params) == 1);
  CHECK(two_cars(0.9f, 0.4f).split(params) == 2);
  params.strip_m = 0.0f;
  CHECK(two_cars(0.9f, 0.4f).split(params) == 1);
  // A few beams hit both cars and measure a place between them.
  for (const int32_t between : {1, 20}) {
    CAPTURE(between);
    Cluster cluster;
    for (int32_t row = 0; row < 4; ++row)
      for (const float across_m : {0.0f, kWidth_m + 0.6f}) cluster.add_car(0.02f * float(row), across_m);
    for (int32_t k = 0; k < between; ++k)
      for (const float across_m : {0.1f, 0.2f, 0.3f, 0.4f, 0.5f}) cluster.add(0.05f * float(k), kWidth_m + across_m);
    CHECK(cluster.split() == (between == 1 ? 2 : 1));
  }
}

TEST_CASE("split_abreast: a wall beside a car, and three cars, stay one cluster") {
  Cluster wall;
  wall.add_car(0.0f, 0.0f);
  wall.add_line(-2.0f, kWidth_m + 0.6f, 6.0f, kWidth_m + 0.6f);
  CHECK(wall.split() == 1);
  Cluster three;
  for (const float across_m : {0.0f, 2.6f, 5.2f}) three.add_car(0.0f, across_m);
  CHECK(three.split() == 1);
}

TEST_CASE("split_abreast: only near clusters of many points, where columns are close together") {
  CHECK(two_cars(0.6f, 0.4f, 0.0f, 29.0f).split() == 2);
  CHECK(two_cars(0.6f, 0.4f, 0.0f, 31.0f).split() == 1);
  SplitAbreastParams coarse = kUsual;
  coarse.pitch_rad = 0.009f;
  CHECK(two_cars(0.6f, 0.4f, 0.0f, 12.0f).split(coarse) == 1);
  CHECK(two_cars(0.6f, 0.4f, 0.0f, 10.0f).split(coarse) == 2);
  Cluster few;
  for (const float across_m : {0.0f, kWidth_m + 0.6f})
    for (int32_t k = 0; k < 29; ++k) few.add(0.15f * float(k), across_m + 0.06f * float(k));
  REQUIRE(few.size() == 58);
  CHECK(few.split() == 1);
  Cluster part;  // seven points beyond the strip
  part.add_car(0.0f, 0.0f);
  for (int32_t k = 0; k < 7; ++k) part.add(0.1f * float(k), kWidth_m + 0.6f);
  CHECK(part.split() == 1);
  part.add(0.0f, kWidth_m + 0.7f);
  CHECK(part.split() == 2);
}

TEST_CASE("split_abreast: there are no more labels than pixels") {
  Cluster cluster = two_cars(0.6f, 0.4f);
  CHECK(cluster.split(kUsual, cluster.pixel_count() - 1) == cluster.pixel_count());
  CHECK(cluster.split(kUsual, cluster.pixel_count()) == cluster.pixel_count());
}

TEST_CASE("split_abreast: of a cluster of thousands of points every n-th counts, and all get their label") {
  Cluster cluster;
  for (int32_t row = 0; row < 20; ++row) {
    cluster.add_car(0.001f * float(row), 0.0f);
    cluster.add_car(0.4f + 0.001f * float(row), kWidth_m + 0.6f);
  }
  REQUIRE(cluster.size() > 4000);
  CHECK(cluster.split() == 2);
  CHECK(cluster.is_split_at(kWidth_m + 0.3f));
}

}  // namespace overtake
