// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// The learned height of the centre line where the localisation jumps: to the side, in height, for one pose.
#include <cmath>
#include <vector>

#include "tests/support/height_drive.h"

namespace overtake {
namespace {

using namespace test;

TEST_CASE("height_profile: a jump of the localisation, along the road or in height, is no road") {
  const CircleRoad road = level_road();
  Drive drive(road);
  drive.go(200.0, 70.0);
  const double from = drive.s_m;
  drive.s_m += 80.0;  // from one pose to the next
  drive.go(350.0, 70.0);
  RoadData data = drive.describe();
  for (int32_t k = 0; k < kHere; ++k)
    if (station_s(data, k) > from + 8.0 && station_s(data, k) < from + 72.0) CHECK_FALSE(data.known[k]);
  drive.go(500.0, 70.0);
  drive.lift_m = 5.0;
  drive.go(560.0, 70.0);
  // The stretches before the jump keep their height, those behind it have the new one; none lies between.
  data = drive.describe();
  for (int32_t k = 0; k < kHere - 6; ++k) {
    if (!data.known[k] || std::fabs(station_s(data, k) - 500.0) < 7.6) continue;
    CAPTURE(station_s(data, k));
    const float height_m = data.height_m[k];
    CHECK((std::fabs(height_m) < 0.01f || std::fabs(height_m + 5.0f) < 0.01f));
  }
}

TEST_CASE("height_profile: a jump of the localisation to the side moves the road on a bank with the vehicle") {
  const CircleRoad road({.radius_m = 400.0,
                         .with_banking = true,
                         .height = [](double turn) { return 2.0 * std::sin(turn); },
                         .slope = [](double) { return 0.3; }});
  for (const int32_t laps : {0, 1})
    for (const double shift_m : {-1.5, 0.8, 2.5}) {
      CAPTURE(laps);
      CAPTURE(shift_m);
      Drive drive(road);
      const double start_m = laps * road.length_m() + 200.0;
      drive.go(start_m, 70.0);
      drive.shift_m = shift_m;
      for (const double on_m : {1.0, 5.0, 20.0, 60.0, 200.0}) {
        CAPTURE(on_m);
        drive.go(start_m + on_m, 70.0);
        const RoadData data = drive.describe();
        CHECK(data.d_m == doctest::Approx(shift_m).epsilon(0.02));
        CHECK(count_known(data, kHere - 30, kHere) == 31);
        check_stations(data, road, 0.06, 0, kHere + 2);
      }
      drive.shift_m = 0.0;  // and back
      for (const double on_m : {201.0, 220.0, 300.0}) {
        CAPTURE(on_m);
        drive.go(start_m + on_m, 70.0);
        check_stations(drive.describe(), road, 0.06, 0, kHere + 2);
      }
    }
}

TEST_CASE("height_profile: one wrong pose, or a step in height alone, leaves the road where it is below the vehicle") {
  const CircleRoad road({.radius_m = 400.0,
                         .with_banking = true,
                         .height = [](double turn) { return 2.0 * std::sin(turn); },
                         .slope = [](double) { return 0.3; }});
  const auto go_on = [&](Drive& drive) {
    for (const double on_m : {201.5, 205.0, 220.0, 300.0}) {
      CAPTURE(on_m);
      drive.go(on_m, 70.0);
      const RoadData data = drive.describe();
      CHECK(count_known(data, kHere - 30, kHere) == 31);
      check_stations(data, road, 0.06, 0, kHere + 2);
    }
  };
  for (const double shift_m : {-3.0, -1.0, 1.0, 3.0}) {
    CAPTURE(shift_m);
    Drive drive(road);
    drive.go(200.0, 70.0);
    drive.shift_m = shift_m;
    drive.go(200.6, 70.0);
    drive.shift_m = 0.0;
    go_on(drive);
  }
  for (const double lift_m : {-1.0, -0.6, 0.3, 0.6}) {
    CAPTURE(lift_m);
    Drive drive(road);
    drive.go(200.0, 70.0);
    drive.lift_m = lift_m;
    go_on(drive);
  }
}

TEST_CASE("height_profile: a first step that is wrong does not make jumps of all that follow") {
  const CircleRoad road({.radius_m = 400.0, .height = [](double turn) { return 2.0 * std::sin(turn); }});
  for (const double first_m : {-1.0, 1.0}) {
    CAPTURE(first_m);
    Drive drive(road);
    drive.shift_m = first_m;
    drive.go(0.6, 70.0);
    drive.shift_m = 0.0;
    drive.go(150.0, 70.0);
    const RoadData data = drive.describe();
    CHECK(count_known(data, kHere - 20, kHere) >= 20);
    check_stations(data, road, 0.06, 0, kHere + 2);
  }
}

TEST_CASE("height_profile: jumps do not depend on poses and scans that arrived by chance") {
  const CircleRoad road({.radius_m = 60.0, .with_banking = true, .slope = [](double) { return 0.2; }});
  std::vector<EgoPose> poses;
  for (int32_t i = 0; i < 1500; ++i) {
    EgoPose pose = road.pose_at(0.4 * i, i / 130 % 2 ? 2.0 : 0.0);
    pose.z_m = road.pose_at(0.4 * i, 0.0).z_m;
    pose.stamp_ns = kStart_ns + i * 10 * kMs;
    pose.speed_mps = 40.0;
    poses.push_back(pose);
  }
  check_interleaving(road, poses);
}

}  // namespace
}  // namespace overtake
