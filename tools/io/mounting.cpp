// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
#include "tools/io/mounting.h"

#include <cmath>

#include "tools/io/angles.h"

namespace overtake::io {

Rotation axes_of(double roll, double pitch, double yaw) {
  const double cr = std::cos(roll), sr = std::sin(roll), cp = std::cos(pitch), sp = std::sin(pitch), cy = std::cos(yaw),
               sy = std::sin(yaw);
  return {{{cy * cp, sy * cp, -sp},
           {cy * sp * sr - sy * cr, sy * sp * sr + cy * cr, cp * sr},
           {cy * sp * cr + sy * sr, sy * sp * cr - cy * sr, cp * cr}}};
}

Mounting::Mounting(const RigSensor& s)
    : axes_(axes_of(rad(s.roll_deg), rad(s.pitch_deg), rad(s.yaw_deg))), at_{s.x_m, s.y_m, s.z_m} {}

std::array<double, 3> Mounting::to_vehicle(double x_m, double y_m, double z_m) const {
  const double p[3] = {x_m, y_m, z_m};
  std::array<double, 3> v = at_;
  for (std::size_t a = 0; a < 3; ++a)
    for (std::size_t b = 0; b < 3; ++b) v[b] += axes_[a][b] * p[a];
  return v;
}

}  // namespace overtake::io
