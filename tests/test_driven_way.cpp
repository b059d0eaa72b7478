// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// The way that the ego vehicle drove, on a banked circle whose heights and cross slopes are known.
#include "pipeline/road/driven_way.h"

#include <doctest/doctest.h>

#include <cmath>
#include <cstring>
#include <utility>

#include "tests/support/circle_road.h"

namespace overtake {
namespace {

using test::CircleRoad;

constexpr int64_t kPeriodNs = 10'000'000;
constexpr double kSpeed_mps = 70.0, kPeriod_m = kSpeed_mps * 1e-9 * double(kPeriodNs);

CircleRoad banked_road() {
  return CircleRoad({.height = [](double turn) { return 3.0 * std::sin(2.0 * turn); },
                     .slope = [](double turn) { return 0.2 + 0.1 * std::sin(3.0 * turn); }});
}

EgoPose pose_of(const CircleRoad& road, int64_t k) {
  EgoPose pose = road.pose_at(kPeriod_m * double(k), 1.0);
  pose.stamp_ns = k * kPeriodNs;
  pose.speed_mps = kSpeed_mps;
  return pose;
}

// The way behind pose `k`, told by the poses `first` to `last`.
RoadData told_at(const CircleRoad& road, int64_t k, int64_t first, int64_t last) {
  DrivenWay way;
  for (int64_t i = first; i <= last; ++i) way.add(pose_of(road, i));
  RoadData data;
  data.has_pose = true;
  data.ego = state_of(pose_of(road, k));
  way.describe(k * kPeriodNs, data);
  return data;
}

TEST_CASE("driven way: behind the vehicle lies the road that it drove on, in its frame, from near to far") {
  const CircleRoad road = banked_road();
  const RoadData data = told_at(road, 300, 0, 300);
  REQUIRE(data.way_count == RoadData::kWay);
  float last_x = 0.0f;
  for (int32_t i = 0; i < data.way_count; ++i) {
    const RoadData::WayPlace& p = data.way[i];
    CHECK(p.x_m < last_x);
    last_x = p.x_m;
    // The place and what lies 1 m to its left, in the map.
    const auto above_m = [&](double left_m) {
      const double v[3] = {double(p.x_m), double(p.y_m) + left_m, double(p.z_m + p.slope * float(left_m))};
      double w[3] = {data.ego.pose.x_m, data.ego.pose.y_m, data.ego.pose.z_m};
      for (int32_t row = 0; row < 3; ++row)
        for (int32_t col = 0; col < 3; ++col) w[row] += data.ego.r[3 * row + col] * v[col];
      const MapProjection at = road.map.project(w[0], w[1], -1);
      return w[2] - (road.height(at.s_m) - at.d_m * road.slope(at.s_m));
    };
    CAPTURE(p.x_m);
    CHECK(std::fabs(above_m(0.0)) < 0.01);
    CHECK(std::fabs(above_m(1.0)) < 0.03);
  }
  CHECK(last_x < -80.0f);
  CHECK(data.way[0].x_m > -float(kSpeed_mps * 1e-9 * double(DrivenWay::kLagNs) + DrivenWay::kStep_m));
}

TEST_CASE("driven way: poses that come later do not change what a scan is told") {
  const CircleRoad road = banked_road();
  const int64_t lag = DrivenWay::kLagNs / kPeriodNs;
  const RoadData early = told_at(road, 200, 0, 200 - lag), later = told_at(road, 200, 0, 230);
  REQUIRE(early.way_count > 10);
  REQUIRE(later.way_count == early.way_count);
  CHECK(std::memcmp(early.way, later.way, sizeof early.way) == 0);
}

TEST_CASE("driven way: a step of the localisation after a scan changes nothing, one just before it ends the way") {
  const CircleRoad road = banked_road();
  const auto told = [&](int64_t jump, int64_t last) {
    DrivenWay way;
    for (int64_t k = 0; k <= last; ++k) {
      EgoPose pose = pose_of(road, k);
      if (k >= jump) pose.z_m += 2.0;
      way.add(pose);
    }
    RoadData data;
    data.has_pose = true;
    data.ego = state_of(pose_of(road, 200));
    way.describe(200 * kPeriodNs, data);
    return data;
  };
  const RoadData none = told(1000, 200), after = told(201, 260);
  REQUIRE(none.way_count > 10);
  CHECK(after.way_count == none.way_count);
  CHECK(std::memcmp(after.way, none.way, sizeof none.way) == 0);
  CHECK(told(195, 200).way_count == 0);
}

TEST_CASE("driven way: a step of the localisation, a gap and another clock begin a new way") {
  const CircleRoad road = banked_road();
  const auto count_after = [&](auto change) {
    DrivenWay way;
    int64_t last_ns = 0;
    for (int64_t k = 0; k <= 150; ++k) {
      if (k == 75) {
        if (!change(way, nullptr)) continue;
      }
      EgoPose pose = pose_of(road, k);
      if (k > 75) change(way, &pose);
      last_ns = pose.stamp_ns;
      way.add(pose);
    }
    RoadData data;
    data.has_pose = true;
    data.ego = state_of(pose_of(road, 150));
    way.describe(last_ns + kPeriodNs, data);
    return data.way_count;
  };
  const int32_t whole = count_after([](DrivenWay&, EgoPose*) { return true; });
  CHECK(whole > 15);
  const auto moved = [&](double x_m, double z_m, int64_t later_ns) {
    return count_after([=](DrivenWay&, EgoPose* pose) {
      if (pose) pose->x_m += x_m, pose->z_m += z_m, pose->stamp_ns += later_ns;
      return true;
    });
  };
  CHECK(moved(0.1, 0.1, 0) == whole);
  CHECK(moved(-0.1, -0.1, kPeriodNs / 10) >= whole - 1);
  CHECK(moved(2.0, 0.0, 0) < whole / 2 + 1);
  CHECK(moved(0.0, 1.0, 0) < whole / 2 + 1);
  CHECK(moved(0.0, -1.0, 0) < whole / 2 + 1);
  CHECK(moved(0.0, 0.0, 1'500'000'000) < whole / 2 + 1);
  CHECK(count_after([](DrivenWay& way, EgoPose* pose) {
          if (!pose) way.clear();
          return true;
        }) < whole / 2 + 1);
  CHECK(count_after([](DrivenWay&, EgoPose* pose) { return pose != nullptr; }) >= whole - 1);  // one pose is missing
}

TEST_CASE("driven way: what lies behind a gap of the poses is not told, however well it fits") {
  const CircleRoad road = banked_road();
  DrivenWay way;
  for (int64_t k = 0; k <= 300; ++k) {
    EgoPose pose = pose_of(road, k);
    if (k <= 120 || k > 250) way.add(pose);
  }
  RoadData data;
  data.has_pose = true;
  data.ego = state_of(pose_of(road, 300));
  way.describe(300 * kPeriodNs, data);
  CHECK(data.way_count > 2);
  CHECK(double(data.way[data.way_count - 1].x_m) > -kPeriod_m * 51.0);
}

TEST_CASE("driven way: a vehicle that has turned round, or stands, has none behind it") {
  DrivenWay way;
  EgoPose pose;
  for (int64_t k = 0; k < 200; ++k) {
    pose.stamp_ns = k * kPeriodNs;
    way.add(pose);
  }
  RoadData data;
  data.has_pose = true;
  data.ego = state_of(pose);
  way.describe(201 * kPeriodNs, data);
  CHECK(data.way_count == 0);

  const CircleRoad road = banked_road();
  for (int64_t k = 200; k < 400; ++k) way.add(pose_of(road, k));
  data.ego = state_of(pose_of(road, 399));
  way.describe(400 * kPeriodNs, data);
  CHECK(data.way_count > 10);
  EgoPose turned = pose_of(road, 399);
  for (const double turn_rad : {1.3, -1.3, kPi}) {
    turned.yaw_rad = pose_of(road, 399).yaw_rad + turn_rad;
    data.ego = state_of(turned);
    way.describe(400 * kPeriodNs, data);
    CHECK(data.way_count == 0);
  }
}

}  // namespace
}  // namespace overtake
