// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// Ego poses of a localisation in the plane, without roll and pitch, on a banked circuit.
#include "pipeline/road/bank_attitude.h"

#include <doctest/doctest.h>

#include <cmath>
#include <vector>

#include "core/math.h"
#include "tests/support/circle_road.h"
#include "tests/support/one_sensor_detector.h"

namespace {

using namespace overtake;
using doctest::Approx;
using test::CircleRoad, test::Small;

constexpr double kBank = 0.3;

CircleRoad banked_road(double slope, bool with_banking = true) {
  return CircleRoad({.with_banking = with_banking, .slope = [slope](double) { return slope; }});
}

EgoPose flat(EgoPose pose) {
  pose.roll_rad = pose.pitch_rad = 0.0;
  return pose;
}

// A vehicle on the road of that slope, turned to the left from the direction of the map.
EgoPose turned_pose(const CircleRoad& road, double slope, double turned_rad) {
  EgoPose pose = road.pose_at(700.0, 2.0);
  pose.yaw_rad = wrap_angle(pose.yaw_rad + turned_rad);
  const double along = slope * std::sin(turned_rad), across = slope * std::cos(turned_rad);
  pose.pitch_rad = std::atan(along);
  pose.roll_rad = -std::atan(across / std::sqrt(1.0 + along * along));
  return pose;
}

}  // namespace

TEST_CASE("bank attitude: a pose without roll and pitch stands on the banked road, whichever way it faces") {
  for (const double slope : {kBank, -kBank})
    for (const double turned_rad : {0.0, 0.3, -2.0, kPi}) {
      CAPTURE(slope);
      CAPTURE(turned_rad);
      const CircleRoad road = banked_road(slope);
      BankAttitude attitude;
      attitude.build(&road.map);
      const EgoPose whole = turned_pose(road, slope, turned_rad), found = attitude.complete(flat(whole));
      CHECK(std::fabs(found.roll_rad - whole.roll_rad) < 1e-5);  // the map is a polygon
      CHECK(std::fabs(found.pitch_rad - whole.pitch_rad) < 1e-5);
      CHECK_FALSE(found.has_attitude);
      CHECK(found.x_m == whole.x_m);
      CHECK(found.yaw_rad == whole.yaw_rad);
      // Its up axis is that of the road: level to the inside and along the line.
      const EgoState ego = state_of(found);
      const double heading = whole.yaw_rad - turned_rad, left[3] = {-std::sin(heading), std::cos(heading), -slope};
      CHECK(std::fabs(ego.r[2] * left[0] + ego.r[5] * left[1] + ego.r[8] * left[2]) < 1e-5);
      CHECK(std::fabs(ego.r[2] * std::cos(heading) + ego.r[5] * std::sin(heading)) < 1e-5);
    }
}

TEST_CASE("bank attitude: on a map without banking, and beside the circuit, a pose in the plane stays level") {
  const CircleRoad road = banked_road(kBank), untold = banked_road(kBank, false);
  const auto is_level = [](const CircleRoad* on, const EgoPose& pose) {
    BankAttitude attitude;
    attitude.build(on ? &on->map : nullptr);
    const EgoPose found = attitude.complete(pose);
    CHECK_FALSE(found.has_attitude);
    return found.roll_rad == 0.0 && found.pitch_rad == 0.0;
  };
  const EgoPose on_line = flat(road.pose_at(700.0, 0.0));
  CHECK_FALSE(is_level(&road, on_line));
  CHECK(is_level(nullptr, on_line));
  CHECK(is_level(&untold, on_line));
  CHECK(is_level(&road, flat(road.pose_at(700.0, CircleRoad::kWidthLeft_m + 1.5))));  // the apron is level
  CHECK_FALSE(is_level(&road, flat(road.pose_at(700.0, CircleRoad::kWidthLeft_m + 0.5))));
  EgoPose far = on_line;
  far.x_m = 1e9;  // no place of the map
  CHECK(is_level(&road, far));
}

TEST_CASE("bank attitude: beyond the ends of an open line there is no bank") {
  std::vector<double> x, zero, half, bank;
  for (int32_t i = 0; i <= 20; ++i)
    x.push_back(10.0 * i), zero.push_back(0.0), half.push_back(8.0), bank.push_back(kBank);
  CircuitMap map;
  const char* error = nullptr;
  REQUIRE(map.build(x.data(), zero.data(), half.data(), half.data(), bank.data(), int32_t(x.size()), false, &error));
  BankAttitude attitude;
  attitude.build(&map);
  const auto roll_at = [&](double at_m) {
    EgoPose pose;
    pose.x_m = at_m;
    return attitude.complete(pose).roll_rad;
  };
  CHECK(roll_at(3.0) == Approx(-kBank));
  CHECK(roll_at(-3.0) == 0.0);
  CHECK(roll_at(197.0) == Approx(-kBank));
  CHECK(roll_at(203.0) == 0.0);
}

TEST_CASE("bank attitude: the bank fades to level over the metre beside the circuit, to both sides") {
  const CircleRoad road = banked_road(kBank);
  BankAttitude attitude;
  attitude.build(&road.map);
  const auto slope_at = [&](double d_m) {
    return -std::tan(attitude.complete(flat(road.pose_at(700.0, d_m))).roll_rad);
  };
  for (const double side : {CircleRoad::kWidthLeft_m, -CircleRoad::kWidthRight_m}) {
    const double out = side > 0 ? 1.0 : -1.0;
    CHECK(slope_at(side - 0.1 * out) == Approx(kBank).epsilon(1e-3));
    CHECK(slope_at(side + 0.25 * out) == Approx(0.75 * kBank).epsilon(0.02));
    CHECK(slope_at(side + 0.75 * out) == Approx(0.25 * kBank).epsilon(0.05));
    CHECK(slope_at(side + 1.2 * out) == 0.0);
  }
}

TEST_CASE("bank attitude: a measured attitude stays, and any before the poses are looked at") {
  const CircleRoad road = banked_road(kBank);
  BankAttitude attitude;
  EgoPose level = flat(road.pose_at(700.0, 0.0)), rolled = level, pitched = level;
  rolled.roll_rad = -0.001, pitched.pitch_rad = 0.001;
  CHECK(attitude.complete(level).has_attitude);
  attitude.build(&road.map);
  for (const EgoPose& pose : {rolled, pitched}) {
    const EgoPose found = attitude.complete(pose);
    CHECK(found.has_attitude);
    CHECK(found.roll_rad == pose.roll_rad);
    CHECK(found.pitch_rad == pose.pitch_rad);
  }
}

namespace {

struct Drive {
  double tilt_rad = 0.003, wobble_rad = 0, step_m = 0.5;
  bool banked_pose = false;  // the pose has the attitude of the bank
};

// At how many metres of the way along the circle the attitude is no longer that of the pose; 1e9: never.
double drive(const CircleRoad* road, const CircuitMap* map, const Drive& how) {
  BankAttitude attitude;
  attitude.build(map);
  double until_m = 1e9;
  for (int64_t k = 0; k < 500; ++k) {
    const double way_m = how.step_m * double(k);
    EgoPose pose = road->pose_at(700.0 + way_m, 0.0);
    if (!how.banked_pose) pose = flat(pose);
    pose.stamp_ns = k * 10'000'000;
    pose.speed_mps = how.step_m / 0.01;
    pose.pitch_rad = how.tilt_rad + (k % 2 ? how.wobble_rad : 0.0);
    const EgoPose found = attitude.complete(pose);
    CHECK(found.has_attitude ==
          (found.pitch_rad == pose.pitch_rad && found.roll_rad == pose.roll_rad && found.has_attitude));
    if (!found.has_attitude) until_m = std::min(until_m, way_m);
  }
  return until_m;
}

}  // namespace

TEST_CASE(
    "bank attitude: one that stays the same over a way is the tilt of a mounting, where bank or bend contradict it") {
  const CircleRoad road = banked_road(kBank), untold = banked_road(kBank, false);
  constexpr double kNever = 1e9;
  CHECK(drive(&road, &road.map, {}) == Approx(20.0).epsilon(0.05));
  CHECK(drive(&road, &road.map, {.wobble_rad = 1e-6}) == Approx(20.0).epsilon(0.05));
  CHECK(drive(&road, &road.map, {.wobble_rad = 1e-4}) == kNever);
  CHECK(drive(&road, &road.map, {.banked_pose = true}) == kNever);  // a simulation without noise
  CHECK(drive(&road, &road.map, {.step_m = 0.0}) == kNever);
  const double without_bank_m = drive(&untold, &untold.map, {});
  CHECK(without_bank_m >= 99.0);
  CHECK(without_bank_m < 200.0);
  CHECK(drive(&untold, nullptr, {}) == without_bank_m);
  CHECK(drive(&untold, nullptr, {.wobble_rad = 1e-4}) == kNever);
  BankAttitude straight;
  straight.build(nullptr);
  for (int64_t k = 0; k < 500; ++k) {
    EgoPose pose;
    pose.stamp_ns = k * 10'000'000, pose.x_m = 0.8 * double(k), pose.speed_mps = 80, pose.pitch_rad = 0.003;
    CHECK(straight.complete(pose).has_attitude);
  }
}

TEST_CASE("bank attitude: between two poses there is an attitude if both have one") {
  for (const bool first : {true, false})
    for (const bool second : {true, false}) {
      EgoWindow window;
      window.count = 2;
      window.poses[0].stamp_ns = 0, window.poses[1].stamp_ns = 10'000'000;
      window.poses[0].has_attitude = first, window.poses[1].has_attitude = second;
      EgoState at;
      REQUIRE(window.at(5'000'000, at));
      CHECK(at.pose.has_attitude == (first && second));
    }
}

TEST_CASE("detector: with poses in the plane a row 12 m to the left of it is where the bank is, in best only") {
  std::vector<double> x, zero, half, bank;
  for (int32_t i = 0; i <= 50; ++i)
    x.push_back(20.0 * i), zero.push_back(0.0), half.push_back(15.0), bank.push_back(kBank);
  for (const bool best : {true, false}) {
    CAPTURE(best);
    Small small(1);
    ovt_map_def map = ovt_default_map_def();
    map.count = int32_t(x.size());
    map.x_m = x.data(), map.y_m = zero.data(), map.width_left_m = map.width_right_m = half.data();
    map.banking_rad = bank.data();
    small.def.map = &map;
    small.create(best ? "best" : "paper");
    for (int32_t k = 0; k < 12; ++k) {
      const int64_t stamp_ns = 1 + k * 50'000'000;
      ovt_ego_pose pose;
      ovt_ego_pose_init(&pose, sizeof pose);
      pose.stamp_ns = stamp_ns, pose.x_m = 200 + 2.5 * k, pose.speed_mps = 50;
      REQUIRE(ovt_push_ego_pose(small.detector, &pose) == OVT_OK);
      const double ahead = 0, left = 12;
      ovt_external_detections row;
      ovt_external_detections_init(&row, sizeof row);
      row.stamp_ns = stamp_ns, row.count = 1, row.x_m = &ahead, row.y_m = &left;
      CHECK(ovt_push_detections(small.detector, &row) == OVT_OK);
    }
    CHECK(ovt_flush(small.detector) == OVT_OK);
    const ovt_tracks tracks = small.next_tracks();
    REQUIRE(tracks.count == 1);
    CHECK(tracks.y_m[0] == Approx(best ? 12 * std::cos(kBank) : 12).epsilon(0.003));
  }
}
