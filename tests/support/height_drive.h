// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// A vehicle on a circle whose heights and cross slopes are known, and what a HeightProfile makes of its poses.
#pragma once

#include <doctest/doctest.h>

#include <cmath>
#include <cstddef>
#include <cstring>
#include <vector>

#include "pipeline/road/height_profile.h"
#include "tests/support/circle_road.h"

namespace overtake::test {

inline constexpr int64_t kMs = 1'000'000;
inline constexpr int64_t kStart_ns = 1'700'000'000'000'000'000;  // a current stamp
inline constexpr int32_t kHere = RoadData::kStations / 2;

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

inline int32_t count_known(const RoadData& data, int32_t first = 0, int32_t last = RoadData::kStations - 1) {
  int32_t count = 0;
  for (int32_t k = first; k <= last; ++k) count += data.known[k];
  return count;
}

inline double station_s(const RoadData& data, int32_t k) { return data.s_m + (k - kHere) * RoadData::kStation_m; }

// Checks the known stations from `first` to `last` against the road.
inline void check_stations(const RoadData& data, const CircleRoad& road, double tolerance_m, int32_t first = 0,
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

inline bool same(const RoadData& a, const RoadData& b) {
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
inline CircleRoad hilly_road(bool with_banking) {
  return CircleRoad({.radius_m = 400.0,
                     .with_banking = with_banking,
                     .height = [](double turn) { return 2.0 * std::sin(turn); },
                     .slope = [](double turn) { return 0.18 + 0.09 * std::cos(turn); }});
}
inline CircleRoad level_road(double radius_m = 400.0) { return CircleRoad({.radius_m = radius_m}); }

// What each scan is told about the road. Scan i has the stamp of pose 5 * i; it is pushed when `later` more poses are
// there, and described when `behind` further scans were.
inline std::vector<RoadData> describe_all(const CircleRoad& road, const std::vector<EgoPose>& poses, std::size_t later,
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

inline void check_interleaving(const CircleRoad& road, const std::vector<EgoPose>& poses) {
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

}  // namespace overtake::test
