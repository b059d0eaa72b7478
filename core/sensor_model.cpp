// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
#include "core/sensor_model.h"

#include "core/math.h"

namespace overtake {

Transform make_transform(double x_m, double y_m, double z_m, double roll_rad, double pitch_rad,
                         double yaw_rad) noexcept {
  double sr, cr, sp, cp, sy, cy;
  sin_cos_f64(roll_rad, sr, cr);
  sin_cos_f64(pitch_rad, sp, cp);
  sin_cos_f64(yaw_rad, sy, cy);
  // clang-format off
  const double r[9] = {cy * cp, cy * sp * sr - sy * cr, cy * sp * cr + sy * sr,
                       sy * cp, sy * sp * sr + cy * cr, sy * sp * cr - cy * sr,
                       -sp,     cp * sr,                cp * cr};
  // clang-format on
  Transform T;
  for (int i = 0; i < 9; ++i) T.r[i] = float(r[i]);
  T.t[0] = float(x_m);
  T.t[1] = float(y_m);
  T.t[2] = float(z_m);
  return T;
}

SensorModel make_sensor_model(int32_t rows, int32_t cols, double azimuth_left_rad, double azimuth_right_rad, bool wraps,
                              double range_min_m, double range_max_m) noexcept {
  const double pitch = (wraps ? kTwoPi : azimuth_left_rad - azimuth_right_rad) / cols;
  double s, c;
  sin_cos_f64(pitch, s, c);
  SensorModel m;
  m.rows = rows;
  m.cols = cols;
  // Not below -pi: the kernels add one turn at most to the difference to an azimuth.
  m.azimuth_left_rad = float(azimuth_left_rad < -kPi ? azimuth_left_rad + kTwoPi : azimuth_left_rad);
  m.pitch_rad = float(pitch);
  m.inverse_pitch = float(1.0 / pitch);
  m.sin_pitch = float(s);
  m.cos_pitch = float(c);
  m.wraps = wraps;
  m.range_min_m = float(range_min_m);
  m.range_max_m = float(range_max_m);
  return m;
}

}  // namespace overtake
