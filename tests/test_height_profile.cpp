// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// The height of the centre line, learned from ego poses on a circle whose heights and cross slopes are known.
#include "pipeline/road/height_profile.h"

#include <doctest/doctest.h>

#include <cmath>
#include <vector>

#include "core/math.h"
#include "tests/support/height_drive.h"

namespace overtake {
namespace {

using namespace test;

TEST_CASE("height_profile: after a lap the heights and the cross slopes are those of the road, also across the start") {
  for (const bool with_banking : {true, false})
    for (const double d_m : {0.0, -3.0, 5.0}) {
      CAPTURE(with_banking);
      CAPTURE(d_m);
      const CircleRoad road = hilly_road(with_banking);
      Drive drive(road);
      drive.d_m = d_m;
      drive.go(1.2 * road.length_m(), 70.0);
      for (const double lap : {1.25, 1.5, 1.93, 1.999, 2.0, 2.001, 2.06, 2.5}) {
        drive.go(lap * road.length_m(), 70.0);
        const RoadData data = drive.describe();
        REQUIRE(data.has_pose);
        REQUIRE(data.map == &road.map);
        CHECK(data.d_m == doctest::Approx(d_m).epsilon(0.01));
        CHECK(data.curvature_per_m == doctest::Approx(1.0 / 400.0).epsilon(0.01));
        CHECK(count_known(data) == RoadData::kStations);
        check_stations(data, road, 0.02);
      }
    }
}

TEST_CASE("height_profile: poses of a localisation in the plane tell no heights") {
  for (const bool with_banking : {true, false}) {
    const CircleRoad road = hilly_road(with_banking);
    Drive drive(road);
    const auto go = [&](double to_s_m, bool flat) {
      for (; drive.s_m < to_s_m; drive.s_m += 0.7, drive.stamp_ns += 10 * kMs) {
        EgoPose pose = road.pose_at(drive.s_m, 0.0);
        pose.stamp_ns = drive.stamp_ns;
        if (flat) pose.z_m = 0.0, pose.has_attitude = false;
        REQUIRE(drive.buffer.push(pose) == OVT_OK);
        drive.describe(drive.stamp_ns);
      }
    };
    go(1.3 * road.length_m(), true);
    const RoadData data = drive.describe();
    CHECK(data.has_pose);
    CHECK(data.map == &road.map);
    CHECK_FALSE(data.has_expected);
    CHECK(count_known(data) == 0);
    go(1.3 * road.length_m() + 100, false);  // the first heights are those of whole poses
    const RoadData whole = drive.describe();
    CHECK(whole.known[kHere]);
    CHECK_FALSE(whole.known[kHere - 30]);
  }
}

TEST_CASE("height_profile: stations beyond the start have the heights of their own places") {
  // A grade of 5 % at the start: a height from 1 m farther on is wrong by 0.05 m.
  const CircleRoad road({.radius_m = 400.0, .height = [](double turn) { return 20.0 * std::sin(turn); }});
  Drive drive(road);
  drive.go(1.9 * road.length_m(), 70.0);
  for (double s_m = 1.95 * road.length_m(); s_m < 2.01 * road.length_m(); s_m += 7.3) {
    drive.go(s_m, 70.0);
    const RoadData data = drive.describe();
    CHECK(count_known(data) == RoadData::kStations);
    check_stations(data, road, 0.05);
  }
}

TEST_CASE("height_profile: on the first lap the road behind is known, and only the next stations ahead") {
  const CircleRoad road = hilly_road(true);
  Drive drive(road);
  drive.s_m = 100.0;
  drive.go(220.0, 70.0);
  RoadData data = drive.describe();
  for (int32_t k = 0; k < RoadData::kStations; ++k) {
    const double s = station_s(data, k);
    CAPTURE(s);
    if (s < 98.0) CHECK_FALSE(data.known[k]);
    if (s > 110.0 && k <= kHere + 2) CHECK(data.known[k]);
    if (k > kHere + 2) CHECK_FALSE(data.known[k]);
  }
  check_stations(data, road, 0.05);
  drive.go(600.0, 70.0);
  data = drive.describe();
  CHECK(count_known(data, 0, kHere + 2) == kHere + 3);
  CHECK(count_known(data, kHere + 3) == 0);
  check_stations(data, road, 0.05);
}

TEST_CASE(
    "height_profile: on the first lap the inner edge of a banked road goes on as it came, if the map has banking") {
  // An inner edge that climbs by 2 %; banking from 0.1 to 0.3.
  const auto slope = [](double turn) { return 0.2 - 0.1 * std::cos(turn); };
  const auto height = [=](double turn) { return 0.02 * 400.0 * turn + CircleRoad::kWidthLeft_m * slope(turn); };
  for (const bool with_banking : {true, false}) {
    const CircleRoad road({.radius_m = 400.0, .with_banking = with_banking, .height = height, .slope = slope});
    Drive drive(road);
    drive.s_m = 100.0;
    drive.go(600.0, 70.0);
    const RoadData data = drive.describe();
    CHECK(data.has_expected == with_banking);
    if (!with_banking) continue;
    const double ego_m = road.height(data.s_m) - data.d_m * road.slope(data.s_m);
    for (int32_t k = kHere; k < RoadData::kStations; ++k) {
      CAPTURE(k);
      CHECK(data.known[k] == (k <= kHere + 2));
      CHECK(std::fabs(double(data.height_m[k]) - (road.height(station_s(data, k)) - ego_m)) < 0.1);
      CHECK(std::fabs(double(data.cross_slope[k]) - road.slope(station_s(data, k))) < 0.01);
    }
  }
}

TEST_CASE("height_profile: a stretch is used from 0.2 s after the pose that left it") {
  // A bump of 0.5 m in the stretch from 50 to 55 m; the vehicle then stands at 56 m, with a station at 51 m.
  const CircleRoad whole = level_road();
  const double bin_m = whole.length_m() / std::floor(whole.length_m() / HeightProfile::kBin_m);
  const CircleRoad road({.radius_m = 400.0, .height = [&](double turn) {
                           const double s = turn / (2.0 * kPi) * whole.length_m() - 10.0 * bin_m;
                           return s > 0.0 && s < bin_m ? 0.5 - std::fabs(s / bin_m - 0.5) : 0.0;
                         }});
  Drive drive(road);
  drive.learns = false;
  drive.s_m = 10.0;
  int64_t left_ns = 0;
  while (drive.s_m < 11.2 * bin_m) {
    if (left_ns == 0 && drive.s_m >= 11.0 * bin_m) left_ns = drive.stamp_ns;
    drive.push(10.0);
    drive.stamp_ns += 10 * kMs;
    drive.s_m += 0.1;
  }
  drive.wait(500 * kMs);
  const RoadData late = drive.describe(left_ns + 200 * kMs), early = drive.describe(left_ns + 200 * kMs - 1);
  REQUIRE(late.known[kHere - 1]);
  CHECK(late.height_m[kHere - 1] > 0.1f);
  CHECK(std::fabs(early.height_m[kHere - 1]) < 0.02f);  // the straight line to the vehicle
}

TEST_CASE("height_profile: what a scan is told does not depend on poses and scans that arrived before it by chance") {
  const CircleRoad road({.radius_m = 60.0,
                         .height = [](double turn) { return 0.5 * std::sin(3.0 * turn); },
                         .slope = [](double turn) { return 0.1 * std::cos(turn); }});
  std::vector<EgoPose> poses;
  for (int32_t i = 0; i < 2500; ++i) {
    EgoPose pose = road.pose_at(0.4 * i, 2.0 * std::sin(0.01 * i));
    pose.stamp_ns = kStart_ns + i * 10 * kMs;
    pose.speed_mps = 40.0;
    pose.z_m += 1e-4 * i;
    poses.push_back(pose);
  }
  check_interleaving(road, poses);
}

TEST_CASE("height_profile: nor for a vehicle that stands at the border of two stretches, with noisy poses") {
  const CircleRoad road({.radius_m = 60.0, .height = [](double turn) { return 0.5 * std::sin(3.0 * turn); }});
  const double bin_m = road.length_m() / std::floor(road.length_m() / HeightProfile::kBin_m);
  std::vector<EgoPose> poses;
  for (int32_t i = 0; i < 1500; ++i) {
    const double s = i < 500 ? 10.0 * bin_m + 1.0 - 0.02 * (500 - i) : 10.0 * bin_m + (i / 3 % 2 ? 0.05 : -0.05);
    EgoPose pose = road.pose_at(s, 0.0);
    pose.stamp_ns = kStart_ns + i * 10 * kMs;
    pose.z_m += 0.02 * ((i * 7) % 11);
    poses.push_back(pose);
  }
  check_interleaving(road, poses);
}

TEST_CASE("height_profile: a gap in the poses is bridged up to 40 m, and leaves no heights behind it if it is longer") {
  const CircleRoad road = hilly_road(true);
  for (const double gap_m : {25.0, 39.0, 60.0, 100.0}) {
    CAPTURE(gap_m);
    Drive drive(road);
    drive.go(200.0, 70.0);
    const double from = drive.s_m;
    drive.stamp_ns += int64_t(gap_m / 70.0 * 1e9);
    drive.s_m += gap_m;
    drive.go(from + gap_m + 60.0, 70.0);
    const RoadData data = drive.describe();
    int32_t known = 0, all = 0;
    for (int32_t k = 0; k < kHere; ++k)
      if (station_s(data, k) > from + 8.0 && station_s(data, k) < from + gap_m - 8.0) known += data.known[k], ++all;
    REQUIRE(all > 0);
    CHECK(known == (gap_m < 40.0 ? all : 0));
    check_stations(data, road, 0.05);
  }
}

TEST_CASE("height_profile: poses beside the circuit teach nothing and do not use the map") {
  const CircleRoad road = level_road();
  Drive drive(road);
  drive.d_m = -CircleRoad::kWidthRight_m - 1.1;
  drive.go(300.0, 70.0);
  RoadData data = drive.describe();
  CHECK(data.has_pose);
  CHECK(data.map == nullptr);
  drive.d_m = 0.0;
  drive.go(310.0, 70.0);
  data = drive.describe();
  CHECK(data.map == &road.map);
  CHECK(count_known(data, 0, kHere - 3) == 0);
  Drive at_the_wall(road);
  at_the_wall.d_m = -CircleRoad::kWidthRight_m - 0.9;
  at_the_wall.go(300.0, 70.0);
  CHECK(count_known(at_the_wall.describe()) > kHere);
}

TEST_CASE(
    "height_profile: the vehicle's height now corrects heights of earlier laps for the drift of the localisation") {
  const CircleRoad road = hilly_road(true);
  Drive drive(road);
  drive.go(1.2 * road.length_m(), 70.0);
  // Each lap ends 0.4 m above the last one.
  drive.lift_per_m = 0.4 / road.length_m();
  drive.lift_m = -drive.lift_per_m * drive.s_m;
  for (const double lap : {1.5, 2.0, 2.2, 2.7, 3.3, 4.1}) {
    drive.go(lap * road.length_m(), 70.0);
    CAPTURE(lap);
    const RoadData data = drive.describe();
    CHECK(count_known(data) == RoadData::kStations);
    const double ego_m = road.height(data.s_m);
    for (int32_t k = 0; k < RoadData::kStations; ++k) {
      CAPTURE(k);
      CHECK(std::fabs(double(data.height_m[k]) - (road.height(station_s(data, k)) - ego_m)) < 0.06);
    }
  }
}

TEST_CASE("height_profile: heights and cross slopes are means over the laps") {
  double slope = 0.1;
  const CircleRoad road({.radius_m = 200.0, .slope = [&](double) { return slope; }});
  Drive drive(road);
  const double lap_m = road.length_m();
  drive.go(1.2 * lap_m, 50.0);
  slope = 0.2;
  drive.go(2.2 * lap_m, 50.0);
  RoadData data = drive.describe();
  for (int32_t k = kHere + 3; k < RoadData::kStations; ++k)
    CHECK(data.cross_slope[k] == doctest::Approx(0.15).epsilon(0.01));
  drive.go(8.2 * lap_m, 50.0);  // seven more laps: the mean over four forgets the first one
  data = drive.describe();
  for (int32_t k = 0; k < RoadData::kStations; ++k) CHECK(data.cross_slope[k] > 0.183f);
}

TEST_CASE("height_profile: poses at 10 Hz and 300 km/h leave no stretch out") {
  double slope = 0.0;
  const CircleRoad road({.radius_m = 200.0, .slope = [&](double) { return slope; }});
  Drive drive(road);
  const double lap_m = road.length_m();
  drive.go(1.2 * lap_m, 83.3, 100 * kMs);
  slope = 0.1;
  drive.go(2.2 * lap_m, 83.3, 100 * kMs);  // each stretch must have taken part: its mean is 0.05
  for (const double lap : {2.25, 2.5, 2.75, 2.95}) {
    drive.go(lap * lap_m, 83.3, 100 * kMs);
    const RoadData data = drive.describe(drive.stamp_ns - 100 * kMs);
    for (int32_t k = kHere + 3; k < RoadData::kStations; ++k) {
      if (station_s(data, k) > 1.15 * lap_m && station_s(data, k) < 1.25 * lap_m) continue;
      CAPTURE(station_s(data, k));
      CHECK(std::fabs(double(data.cross_slope[k]) - 0.05) < 0.02);
    }
  }
}

TEST_CASE("height_profile: an open line ends: no station lies beyond its ends") {
  const CircleRoad road({.radius_m = 400.0,
                         .closed = false,
                         .height = [](double turn) { return std::sin(turn); },
                         .slope = [](double) { return 0.1; }});
  Drive drive(road);
  const double length_m = road.length_m();
  drive.go(100.0, 70.0);
  RoadData data = drive.describe();
  for (int32_t k = 0; k < RoadData::kStations; ++k)
    if (station_s(data, k) < 0.0) CHECK_FALSE(data.known[k]);
  CHECK(count_known(data) > 10);
  check_stations(data, road, 0.03);
  drive.go(length_m - 1.0, 70.0);
  data = drive.describe();
  CHECK(data.map == &road.map);
  for (int32_t k = 0; k < RoadData::kStations; ++k)
    if (station_s(data, k) > length_m + 2.0 * RoadData::kStation_m) CHECK_FALSE(data.known[k]);
  check_stations(data, road, 0.03, 0, kHere);
}

TEST_CASE("height_profile: after a restart of the clock all that was learned is valid at once") {
  const CircleRoad road = hilly_road(true);
  Drive drive(road);
  drive.go(1.3 * road.length_m(), 70.0);
  drive.profile.restart();
  drive.stamp_ns -= 3'600'000 * kMs;
  EgoPose pose = road.pose_at(drive.s_m, 0.0);
  for (int32_t i = 0; i < 10; ++i) {  // the buffer accepts the third
    pose = road.pose_at(drive.s_m, 0.0);
    pose.stamp_ns = drive.stamp_ns;
    pose.speed_mps = 70.0;
    CHECK(drive.buffer.push(pose) == (i < 2 ? OVT_LATE : OVT_OK));
    drive.stamp_ns += 10 * kMs;
    drive.s_m += 0.7;
  }
  const RoadData data = drive.describe();
  REQUIRE(data.map == &road.map);
  CHECK(count_known(data) == RoadData::kStations);
  check_stations(data, road, 0.02);
  drive.go(1.5 * road.length_m(), 70.0);
  check_stations(drive.describe(), road, 0.02);
}

TEST_CASE("height_profile: a scan is not told a place between poses and a run whose clock stepped ahead") {
  const CircleRoad road = level_road();
  Drive drive(road), stepped(road);
  drive.go(50.0, 70.0), stepped.go(50.0, 70.0);
  const int64_t scan_ns = drive.stamp_ns + 40 * kMs;
  const RoadData right = drive.describe(scan_ns);
  stepped.stamp_ns += 10'000 * kMs, stepped.learns = false;
  stepped.go(52.0, 70.0);
  const RoadData told = stepped.describe(scan_ns);
  REQUIRE(right.has_pose);
  REQUIRE(told.has_pose);
  CHECK(told.s_m == right.s_m);
  CHECK(std::memcmp(&told.ego.pose, &right.ego.pose, sizeof told.ego.pose) == 0);
}

TEST_CASE("height_profile: without a map, without a pose, and with a stale pose") {
  const CircleRoad road = level_road();
  {
    HeightProfile profile;
    REQUIRE(profile.build(nullptr, default_allocator()));
    CHECK(profile.bin_count() == 0);
    EgoBuffer buffer(512);
    RoadData data;
    profile.describe(buffer, buffer.range(), kStart_ns, data);
    CHECK_FALSE(data.has_pose);
    EgoPose pose = road.pose_at(10.0, 0.0);
    pose.stamp_ns = kStart_ns;
    REQUIRE(buffer.push(pose) == OVT_OK);
    profile.describe(buffer, buffer.range(), kStart_ns + 10 * kMs, data);
    CHECK(data.has_pose);
    CHECK(data.map == nullptr);
    profile.restart();
  }
  Drive drive(road);
  CHECK_FALSE(drive.describe(kStart_ns).has_pose);
  drive.go(50.0, 70.0);
  const int64_t last_ns = drive.stamp_ns - 10 * kMs;
  CHECK(drive.describe(last_ns + 100 * kMs).has_pose);
  CHECK_FALSE(drive.describe(last_ns + 100 * kMs + 1).has_pose);
  CHECK_FALSE(drive.describe(kStart_ns - 100 * kMs - 1).has_pose);
}

TEST_CASE("height_profile: poses that the buffer overwrote before a scan came are a gap") {
  const CircleRoad road = hilly_road(true);
  Drive drive(road, 512);
  drive.go(100.0, 70.0);
  drive.learns = false;
  drive.go(1600.0, 70.0);  // 2143 poses, of which 384 are safe to read
  drive.learns = true;
  const double seen_m = 1600.0 - 384 * 0.7;
  drive.go(1700.0, 70.0);
  RoadData data = drive.describe();
  CHECK(count_known(data, 0, kHere) == kHere + 1);
  check_stations(data, road, 0.03);
  drive.go(1.0 * road.length_m() + 1000.0, 70.0);  // the next lap, before the stretch that is missing
  data = drive.describe();
  CHECK(count_known(data, 0, kHere) == kHere + 1);
  drive.go(1.0 * road.length_m() + seen_m - 60.0, 70.0);
  data = drive.describe();
  for (int32_t k = kHere + 3; k < RoadData::kStations; ++k) {
    CAPTURE(station_s(data, k));
    if (station_s(data, k) < seen_m - 5.0) CHECK_FALSE(data.known[k]);
    if (station_s(data, k) > seen_m + 10.0) CHECK(data.known[k]);
  }
}

TEST_CASE("height_profile: tiny and huge circuits") {
  for (const double radius_m : {0.5, 3.0, 20.0, 1e6}) {
    CAPTURE(radius_m);
    const CircleRoad road = level_road(radius_m);
    Drive drive(road);
    CHECK(drive.profile.bin_count() >= 1);
    CHECK(drive.profile.bin_count() <= 1'000'000);
    drive.go(200.0, 20.0);
    const RoadData data = drive.describe();
    CHECK(data.has_pose);
    for (int32_t k = 0; k < RoadData::kStations; ++k) {
      if (!data.known[k]) continue;
      CHECK(std::fabs(data.height_m[k]) < 1e-3f);
    }
  }
}

}  // namespace
}  // namespace overtake
