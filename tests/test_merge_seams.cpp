// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// Clusters across sensors: which sensors have seams, and which clusters are joined over them.
#include "kernels/merge_seams.h"

#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <random>
#include <vector>

#include "tests/support/seam_scene.h"

using namespace overtake;
using namespace overtake::test;

TEST_CASE("find_seams: three sensors of 120 deg have three seams, including the rear one") {
  SensorModel sensors[3];
  for (int s = 0; s < 3; ++s) sensors[s] = model_of(kAv21[s]);
  int32_t left[kMaxSensors], right[kMaxSensors];
  REQUIRE(find_seams(sensors, 3, left, right) == 3);
  // Each pair once: (left, front), (front, right), (right, left).
  CHECK(Ints(left, left + 3) == Ints{1, 0, 2});
  CHECK(Ints(right, right + 3) == Ints{0, 2, 1});
}

TEST_CASE("find_seams: uses the azimuth of the image's middle, not the order of sensors or the x axis") {
  int32_t left[kMaxSensors], right[kMaxSensors];
  SensorModel sensors[4];
  const double yaw[4] = {180, 0, -90, 90};
  for (int s = 0; s < 4; ++s) sensors[s] = model_of({0, 0, 0, yaw[s]}, 100, 90);
  // The same rear view by a sensor mounted ahead with its image from 225 to 135 deg.
  for (int turned : {0, 1}) {
    CAPTURE(turned);
    if (turned) sensors[0].mounting_yaw_rad = 0, sensors[0].azimuth_left_rad = float(225 * kDegree);
    REQUIRE(find_seams(sensors, 4, left, right) == 4);
    for (int i = 0; i < 4; ++i) {
      const int32_t want[4] = {3, 2, 0, 1};  // clockwise neighbour: rear -> left -> front -> right -> rear
      CHECK(right[i] == want[left[i]]);
    }
  }
}

TEST_CASE("find_seams: one sensor has no seam, two have both directions, wrapping sensors have no edge") {
  SensorModel sensors[3] = {model_of({0, 0, 0, 0}), model_of({0, 0, 0, 170}), model_of({0, 0, 0, 90}, 857, 360)};
  int32_t left[kMaxSensors], right[kMaxSensors];
  CHECK(find_seams(sensors, 0, left, right) == 0);
  CHECK(find_seams(sensors, 1, left, right) == 0);
  CHECK(find_seams(sensors + 2, 1, left, right) == 0);
  for (int count : {2, 3}) {
    CAPTURE(count);
    REQUIRE(find_seams(sensors, count, left, right) == 2);
    CHECK(left[0] == right[1]);
    CHECK(left[1] == right[0]);
    CHECK(left[0] + left[1] == 1);
  }
  CHECK(find_seams(sensors + 1, 2, left, right) == 0);
}

TEST_CASE("merge_seams: 1.80 m bridges the AV-21's blind strips of 0.82 m in front and 0.53 m behind") {
  struct Strip {
    double seam_deg, distance, width;
    int32_t mask;
  };
  for (const Strip& strip : {Strip{60, 12, 0.8203, 3}, Strip{-60, 12, 0.8203, 5}, Strip{180, 10, 0.534, 6}}) {
    CAPTURE(strip.seam_deg);
    std::vector<Sensor> rig = rig_of(kAv21);
    see_wall_across(rig, strip.seam_deg, strip.distance);
    const Frame one(rig, closer_than(1.80f));
    REQUIRE(one.merged.count == 1);
    CHECK(one.merged.sensor_mask[0] == strip.mask);
    CHECK(one.members.count == 2);
    // The strip has the stated width: an edge column is 3 cm wide there.
    CHECK(Frame(rig, closer_than(float(strip.width) - 0.01f)).merged.count == 2);
    CHECK(Frame(rig, closer_than(float(strip.width) + 0.07f)).merged.count == 1);
  }
}

TEST_CASE("merge_seams: 1.80 m bridges the paper's blind strip of 0.40 m at every seam") {
  for (double seam_deg : {60.0, -60.0, 180.0}) {
    CAPTURE(seam_deg);
    std::vector<Sensor> rig = rig_of(kPaper);
    see_wall_across(rig, seam_deg, 12);
    CHECK(Frame(rig, closer_than(1.80f)).merged.count == 1);
    CHECK(Frame(rig, closer_than(0.39f)).merged.count == 2);
    CHECK(Frame(rig, closer_than(0.47f)).merged.count == 1);
  }
}

TEST_CASE("merge_seams: is transitive: one object seen by three sensors over the front and the rear seam") {
  std::vector<Sensor> rig = rig_of(kAv21);
  see_arc(rig, 30, 215, 1);
  const Frame f(rig, kMerge);
  REQUIRE(f.merged.count == 1);
  CHECK(f.merged.sensor_mask[0] == 7);
  CHECK(f.merged.main_sensor[0] == 1);
  CHECK(f.row_members(0) == Ints{0, 1, 2});
  CHECK(f.merged.point_count[0] ==
        f.clusters[0].point_count[0] + f.clusters[1].point_count[0] + f.clusters[2].point_count[0]);
  CHECK(f.merged.max_y_m[0] == doctest::Approx(6).epsilon(1e-3));
  CHECK(f.merged.min_x_m[0] == doctest::Approx(-4.194).epsilon(1e-3));  // the strip hides points due west
  // All around: over all three seams, still one object.
  std::vector<Sensor> ring = rig_of(kAv21);
  see_arc(ring, 0, 360, 1);
  CHECK(Frame(ring, kMerge).merged.count == 1);
}

TEST_CASE("merge_seams: objects at different seams stay apart") {
  std::vector<Sensor> rig = rig_of(kAv21);
  see_arc(rig, 55, 80, 1);
  see_arc(rig, 170, 190, 2);
  see_arc(rig, -80, -55, 3);
  const Frame f(rig, kMerge);
  REQUIRE(f.merged.count == 3);
  // By first member: front's clusters are 1 (left seam) and 3 (right seam); the rear one begins with the left sensor.
  CHECK(f.merged.sensor_mask[0] == 3);
  CHECK(f.merged.sensor_mask[1] == 5);
  CHECK(f.merged.sensor_mask[2] == 6);
}

TEST_CASE("merge_seams: a missing sensor causes no error and joins nothing") {
  for (int missing = 0; missing < 3; ++missing) {
    CAPTURE(missing);
    std::vector<Sensor> rig = rig_of(kAv21);
    see_arc(rig, 0, 360, 1);
    rig[size_t(missing)].present = false;
    const Frame f(rig, kMerge);
    // The two that are left have their own seam.
    CHECK(f.members.count == 2);
    REQUIRE(f.merged.count == 1);
    CHECK(f.merged.sensor_mask[0] == (7 & ~(1 << missing)));
  }
  // Without the left sensor its two neighbours are not neighbours, however close the points at their edges are.
  std::vector<Sensor> rig = plain_rig(20, 3);
  rig[0].put(0, 19, 10, 0, 0, 1);
  rig[2].put(0, 0, 10, 1, 0, 1);
  rig[1].present = false;
  CHECK(Frame(rig, kMerge).merged.count == 2);
  std::vector<Sensor> none = plain_rig(20, 3);
  for (Sensor& s : none) s.present = false;
  CHECK(Frame(none, kMerge).merged.count == 0);
}

TEST_CASE("merge_seams: merges with small errors of the extrinsics, 0.2 deg and 2 cm") {
  for (double seam_deg : {60.0, -60.0, 180.0})
    for (int signs = 0; signs < 64; ++signs) {
      CAPTURE(seam_deg);
      CAPTURE(signs);
      std::vector<Sensor> rig = rig_of(kAv21);
      see_wall_across(rig, seam_deg, 25);
      for (size_t s = 0; s < 3; ++s) {
        Place wrong = rig[s].place;
        wrong.yaw_deg += signs >> (2 * s) & 1 ? 0.2 : -0.2;
        wrong.x += signs >> (2 * s + 1) & 1 ? 0.02 : -0.02;
        wrong.y += signs >> (2 * s) & 1 ? -0.02 : 0.02;
        wrong.z += 0.02;
        rig[s].model.T_vehicle_sensor = transform_of(wrong);
        rig[s].model.mounting_yaw_rad = float(wrong.yaw_deg * kDegree);
      }
      CHECK(Frame(rig, kMerge).merged.count == 1);
    }
}

TEST_CASE("merge_seams: only the right edge of the left sensor meets the left edge of the right one") {
  // Two sensors: 0 looks left (+90), 1 right (-90). Each is the left neighbour of the other at one seam.
  const auto merged = [](int32_t column_0, int32_t column_1, int32_t columns) {
    std::vector<Sensor> rig = plain_rig();
    rig[0].put(3, column_0, 10, 0.2f, 0, 1);
    rig[1].put(7, column_1, 10, -0.2f, 0, 1);
    return Frame(rig, closer_than(1.8f, columns)).merged.count == 1;
  };
  CHECK(merged(19, 0, 1));         // the front seam
  CHECK(merged(0, 19, 1));         // the rear seam
  CHECK_FALSE(merged(0, 0, 1));    // left edges
  CHECK_FALSE(merged(19, 19, 1));  // right edges
  CHECK_FALSE(merged(18, 0, 1));
  CHECK_FALSE(merged(19, 1, 1));
  // K = 8 columns on either side.
  CHECK(merged(12, 7, 8));
  CHECK_FALSE(merged(11, 7, 8));
  CHECK_FALSE(merged(12, 8, 8));
  CHECK(merged(3, 12, 40));  // more columns than the image has: all of them
}

TEST_CASE("merge_seams: the distance must be below the limit, in three dimensions") {
  const auto merged = [](float dx, float dy, float dz) {
    std::vector<Sensor> rig = plain_rig();
    rig[0].put(0, 19, 10, 1, 2, 1);
    rig[1].put(0, 0, 10 + dx, 1 + dy, 2 + dz, 1);
    return Frame(rig, closer_than(2.0f)).merged.count == 1;
  };
  const float under = 2.0f - 1e-5f;
  for (float sign : {-1.0f, 1.0f}) {
    CHECK_FALSE(merged(sign * 2, 0, 0));
    CHECK_FALSE(merged(0, sign * 2, 0));
    CHECK_FALSE(merged(0, 0, sign * 2));
    CHECK(merged(sign * under, 0, 0));
    CHECK(merged(0, sign * under, 0));
    CHECK(merged(0, 0, sign * under));
  }
  CHECK(merged(1.1f, 1.1f, 1.1f));        // 1.905
  CHECK_FALSE(merged(1.2f, 1.2f, 1.2f));  // 2.078
}
