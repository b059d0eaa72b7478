// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// How a car drives: a kinematic bicycle follows plans of speed and lateral position over time.
//
// The centre of gravity follows the plan exactly: ds/dt = speed along the track / (1 - curvature d), d by smooth steps.
// This gives its course. The body follows the bicycle model (the rear wheels roll along the body, except for their slip
// angle): d(heading)/dt = v / l_r sin(course - heading - slip), slip = -a_y / stiffness per radian. A spin adds a
// rotation of the body. States are stored every 2 ms; between two of them the position is Hermite's cubic and the
// angles are linear. That is the truth: sensors and tables use the same motion.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "tools/sim/track.h"

namespace overtake::sim {

struct SpeedChange {
  double at_s, speed_mps, over_s;  // a smooth step from the previous speed
};
struct LaneChange {
  double at_s, d_m, over_s;
};
struct Spin {
  double at_s, turns, over_s;  // rotation of the body relative to its course; positive to the left
};

struct CarPlan {
  std::string name;
  double start_s_m = 0, start_d_m = 0, start_speed_mps = 60;
  std::vector<SpeedChange> speed;  // in order of time, without overlap
  std::vector<LaneChange> lane;
  std::vector<Spin> spin;
};

inline constexpr double kRearAxleToCg = 1.6, kWheelBase = 2.971;
inline constexpr double kSlipStiffness = 700;  // m/s^2 per radian: 1.8 deg at 22 m/s^2
inline constexpr double kMostAlong = 18.5, kMostAcross = 26.5, kMostSpeed_kmh = 350, kMostSpeed = kMostSpeed_kmh / 3.6;

struct CarState {
  Rigid T_map_vehicle;             // rear axle on the road; the body stands on the banked surface
  double speed_mps, yaw_rate_rps;  // of the centre of gravity along its course; of the body
  double heading_rad, course_rad;  // in the horizontal plane
  double accel_along_mps2, accel_across_mps2;
  double s_m, d_m;  // of the centre of gravity; s continues over laps
};

class Motion {
 public:
  // Throws std::invalid_argument with car, time and value if a plan exceeds what a car can do.
  Motion(const Track& track, const CarPlan& plan, double seconds);

  CarState at(double time_s) const;
  const std::string& name() const { return name_; }

 private:
  struct Row {
    double s, d, x, y, vx, vy, heading, yaw_rate, course, speed, along, across;
  };
  const Track* track_;
  std::string name_;
  std::vector<Row> rows_;
};

}  // namespace overtake::sim
