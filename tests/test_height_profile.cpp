// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// The height of the centre line, learned from ego poses on a circle whose heights and cross slopes are known.
#include "pipeline/road/height_profile.h"

#include <doctest/doctest.h>

#include <cmath>
#include <cstddef>
#include <cstring>
#include <functional>
#include <vector>

#include "core/math.h"
#include "tests/support/circle_road.h"

namespace overtake {
namespace {

using test::CircleRoad;

constexpr int64_t kMs = 1'000'000;
constexpr int64_t kStart_ns = 1'700'000'000'000'000'000;  // a current stamp
constexpr int32_t kHere = RoadData::kStations / 2;

// A vehicle on the road: pushes its poses, and describes the road around it.
struct Drive {
  explicit Drive(const CircleRoad& on, int32_t capacity = 4096) : road(&on), buffer(capacity) {
    REQUIRE(profile.build(&on.map, default_allocator()));
  }
  // Drives on to the place `to_s_m`, which may lie beyond a full turn.
  void go(double to_s_m, double speed_mps, int64_t period_ns = 10 * kMs) {
    while (s_m < to_s_m) {
      push(speed_mps);
      stamp_ns += period_ns;
      s_m += speed_mps * double(period_ns) * 1e-9;
      if (learns) describe(stamp_ns - period_ns);
    }
  }
  void wait(int64_t duration_ns, int64_t period_ns = 10 * kMs) {
    for (const int64_t end_ns = stamp_ns + duration_ns; stamp_ns < end_ns; stamp_ns += period_ns) push(0.0);
  }
  void push(double speed_mps) {
    EgoPose pose = road->pose_at(s_m, d_m);
    pose.stamp_ns = stamp_ns;
    const EgoPose beside = road->pose_at(s_m, d_m + shift_m);
    pose.x_m = beside.x_m, pose.y_m = beside.y_m;
    pose.z_m += lift_m + lift_per_m * s_m;
    pose.speed_mps = speed_mps;
    REQUIRE(buffer.push(pose) == OVT_OK);
  }
  RoadData describe(int64_t at_ns) {
    RoadData data;
    profile.describe(buffer, buffer.range(), at_ns, data);
    return data;
  }
  RoadData describe() { return describe(stamp_ns - 10 * kMs); }

  const CircleRoad* road;
  HeightProfile profile;
  EgoBuffer buffer;
  int64_t stamp_ns = kStart_ns;
  double s_m = 0.0, d_m = 0.0, lift_m = 0.0, lift_per_m = 0.0;
  double shift_m = 0.0;  // error of the pose, to the left
  bool learns = true;
};

int32_t count_known(const RoadData& data, int32_t first = 0, int32_t last = RoadData::kStations - 1) {
  int32_t count = 0;
  for (int32_t k = first; k <= last; ++k) count += data.known[k];
  return count;
}

double station_s(const RoadData& data, int32_t k) { return data.s_m + (k - kHere) * RoadData::kStation_m; }

// Checks the known stations from `first` to `last` against the road.
void check_stations(const RoadData& data, const CircleRoad& road, double tolerance_m, int32_t first = 0,
                    int32_t last = RoadData::kStations - 1) {
  for (int32_t k = first; k <= last; ++k) {
    if (!data.known[k]) continue;
    const double s = station_s(data, k);
    CAPTURE(k);
    CAPTURE(data.s_m);
    const double ego_m = road.height(data.s_m) - data.d_m * road.slope(data.s_m);
    CHECK(std::fabs(double(data.height_m[k]) - (road.height(s) - ego_m)) < tolerance_m);
    CHECK(std::fabs(double(data.cross_slope[k]) - road.slope(s)) < 0.01);
  }
}

bool same(const RoadData& a, const RoadData& b) {
  const auto equal = [](const auto& x, const auto& y) { return std::memcmp(&x, &y, sizeof x) == 0; };
  bool heights = equal(a.known, b.known);
  for (int32_t k = 0; k < RoadData::kStations; ++k)
    heights &= !a.known[k] || (equal(a.height_m[k], b.height_m[k]) && equal(a.cross_slope[k], b.cross_slope[k]));
  return heights && a.has_pose == b.has_pose && a.map == b.map &&
         std::memcmp(&a.ego.pose, &b.ego.pose, offsetof(EgoPose, has_attitude)) == 0 &&
         a.ego.pose.has_attitude == b.ego.pose.has_attitude && a.faces_along == b.faces_along && equal(a.s_m, b.s_m) &&
         equal(a.d_m, b.d_m) && equal(a.curvature_per_m, b.curvature_per_m);
}

// A hill of 2 m and a banking of 5 to 15 degrees, one of each in a lap of 2500 m.
CircleRoad hilly_road(bool with_banking) {
  return CircleRoad({.radius_m = 400.0,
                     .with_banking = with_banking,
                     .height = [](double turn) { return 2.0 * std::sin(turn); },
                     .slope = [](double turn) { return 0.18 + 0.09 * std::cos(turn); }});
}
CircleRoad level_road(double radius_m = 400.0) { return CircleRoad({.radius_m = radius_m}); }

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

// What each scan is told about the road. Scan i has the stamp of pose 5 * i; it is pushed when `later` more poses are
// there, and described when `behind` further scans were.
std::vector<RoadData> describe_all(const CircleRoad& road, const std::vector<EgoPose>& poses, std::size_t later,
                                   std::size_t behind) {
  HeightProfile profile;
  REQUIRE(profile.build(&road.map, default_allocator()));
  EgoBuffer buffer(4096);
  struct Scan {
    int64_t stamp_ns;
    EgoRange range;
  };
  std::vector<Scan> scans;
  std::vector<RoadData> all;
  RoadData data;
  const auto describe = [&](const Scan& scan) {
    profile.describe(buffer, scan.range, scan.stamp_ns, data);
    return data;
  };
  for (std::size_t i = 0; i < poses.size(); ++i) {
    REQUIRE(buffer.push(poses[i]) == OVT_OK);
    if (i < 1 + later || (i - 1 - later) % 5 != 0) continue;
    scans.push_back({poses[i - 1 - later].stamp_ns + 3 * kMs, buffer.range()});
    if (behind > 0) describe(scans.back());
    if (scans.size() > behind) all.push_back(describe(scans[scans.size() - 1 - behind]));
  }
  return all;
}

void check_interleaving(const CircleRoad& road, const std::vector<EgoPose>& poses) {
  const std::vector<RoadData> expected = describe_all(road, poses, 0, 0);
  for (const std::size_t later : {0u, 10u, 45u})
    for (const std::size_t behind : {0u, 1u, 10u}) {
      if (later == 45 && behind > 1) continue;  // over 0.5 s
      CAPTURE(later);
      CAPTURE(behind);
      const std::vector<RoadData> all = describe_all(road, poses, later, behind);
      REQUIRE(all.size() > 100);
      std::size_t different = 0;
      for (std::size_t i = 0; i < all.size(); ++i) different += !same(all[i], expected[i]);
      CHECK(different == 0);
    }
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
  for (const double shift_m : {-3.0, -1.0, 1.0, 3.0}) {
    CAPTURE(shift_m);
    Drive drive(road);
    drive.go(200.0, 70.0);
    drive.shift_m = shift_m;
    drive.go(200.6, 70.0);
    drive.shift_m = 0.0;
    for (const double on_m : {201.5, 205.0, 220.0, 300.0}) {
      CAPTURE(on_m);
      drive.go(on_m, 70.0);
      const RoadData data = drive.describe();
      CHECK(count_known(data, kHere - 30, kHere) == 31);
      check_stations(data, road, 0.06, 0, kHere + 2);
    }
  }
  for (const double lift_m : {-1.0, -0.6, 0.3, 0.6}) {
    CAPTURE(lift_m);
    Drive drive(road);
    drive.go(200.0, 70.0);
    drive.lift_m = lift_m;
    for (const double on_m : {201.5, 205.0, 220.0, 300.0}) {
      CAPTURE(on_m);
      drive.go(on_m, 70.0);
      const RoadData data = drive.describe();
      CHECK(count_known(data, kHere - 30, kHere) == 31);
      check_stations(data, road, 0.06, 0, kHere + 2);
    }
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

TEST_CASE("height_profile: nor do jumps depend on poses and scans that arrived by chance") {
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
      CHECK(data.cross_slope[k] == doctest::Approx(0.05).epsilon(0.02));
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
