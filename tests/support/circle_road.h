// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// A left-hand circle with heights and cross slopes as functions of the turn, its map, and poses of a vehicle that
// stands on it.
#pragma once

#include <doctest/doctest.h>

#include <cmath>
#include <functional>
#include <vector>

#include "core/circuit_map.h"
#include "core/math.h"
#include "pipeline/ego_buffer.h"

namespace overtake::test {

struct CircleRoadDef {
  double radius_m = 400.0;
  bool closed = true, with_banking = false;
  // Of the turn along the centre line, in radians from its first point. The slope is a tangent; positive: the right
  // side is higher.
  std::function<double(double)> height = [](double) { return 0.0; };
  std::function<double(double)> slope = [](double) { return 0.0; };
};

class CircleRoad {
 public:
  static constexpr double kWidthLeft_m = 8.0, kWidthRight_m = 6.0;

  explicit CircleRoad(CircleRoadDef wanted) : def(std::move(wanted)) {
    const int32_t count = def.radius_m < 1e5 ? int32_t(std::fmax(12.0, 2.0 * kPi * def.radius_m / 2.0)) : 10000;
    std::vector<double> x, y, left, right, banking;
    for (int32_t i = 0; i < count; ++i) {
      const double turn = 2.0 * kPi * i / count;
      x.push_back(def.radius_m * std::sin(turn));
      y.push_back(def.radius_m * (1.0 - std::cos(turn)));
      left.push_back(kWidthLeft_m);
      right.push_back(kWidthRight_m);
      banking.push_back(std::atan(def.slope(turn)));
    }
    const char* error = nullptr;
    REQUIRE(map.build(x.data(), y.data(), left.data(), right.data(), def.with_banking ? banking.data() : nullptr, count,
                      def.closed, &error));
  }
  double length_m() const { return map.length_m(); }
  double turn(double s_m) const { return std::remainder(s_m / whole_m() * 2.0 * kPi, 2.0 * kPi); }
  double height(double s_m) const { return def.height(positive_turn(s_m)); }
  double slope(double s_m) const { return def.slope(positive_turn(s_m)); }

  // A vehicle at the place, along the centre line; its plane is that of the road without the grade.
  EgoPose pose_at(double s_m, double d_m) const {
    const MapPose at = map.at(s_m);
    EgoPose pose;
    pose.x_m = at.x_m - d_m * std::sin(at.heading_rad);
    pose.y_m = at.y_m + d_m * std::cos(at.heading_rad);
    pose.z_m = height(s_m) - d_m * slope(s_m);
    pose.roll_rad = -std::atan(slope(s_m));
    pose.yaw_rad = at.heading_rad;
    return pose;
  }

  CircleRoadDef def;
  CircuitMap map;

 private:
  double whole_m() const { return def.closed ? map.length_m() : map.length_m() * segments_of_whole(); }
  double segments_of_whole() const { return double(map.segment_count() + 1) / double(map.segment_count()); }
  double positive_turn(double s_m) const {
    const double t = turn(s_m);
    return t < 0.0 ? t + 2.0 * kPi : t;
  }
};

}  // namespace overtake::test
