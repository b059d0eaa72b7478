// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// Rotations by roll, pitch and yaw, and the place of a sensor in the vehicle.
#pragma once

#include <array>

#include "tools/io/rig.h"

namespace overtake::io {

// Rows are the axes of the inner frame in the outer one (roll, then pitch, then yaw).
using Rotation = std::array<std::array<double, 3>, 3>;
Rotation axes_of(double roll_rad, double pitch_rad, double yaw_rad);

// T_vehicle_sensor of a rig's sensor.
class Mounting {
 public:
  explicit Mounting(const RigSensor& sensor);
  std::array<double, 3> to_vehicle(double x_m, double y_m, double z_m) const;
  double x_m() const { return at_[0]; }
  double y_m() const { return at_[1]; }

 private:
  Rotation axes_;
  std::array<double, 3> at_;
};

}  // namespace overtake::io
