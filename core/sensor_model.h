// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// One LiDAR: its image, its limits and its pose on the vehicle.
#pragma once

#include <cstdint>

namespace overtake {

inline constexpr int32_t kMaxSensors = 8;

// Rigid transform p_to = R p_from + t, float32 as the kernels use it. Row-major R.
struct Transform {
  float r[9] = {1, 0, 0, 0, 1, 0, 0, 0, 1};
  float t[3] = {0, 0, 0};
};
// R = Rz(yaw) Ry(pitch) Rx(roll), computed in double.
Transform make_transform(double x_m, double y_m, double z_m, double roll_rad, double pitch_rad,
                         double yaw_rad) noexcept;

struct SensorModel {
  int32_t rows = 32, cols = 857;
  float azimuth_left_rad = 0;  // left edge of column 0, counter-clockwise from the sensor's x axis
  float pitch_rad = 0;         // width of a column
  float inverse_pitch = 0;     // columns a radian
  float sin_pitch = 0, cos_pitch = 1;
  bool wraps = false;  // the columns cover a full turn: column 0 is the right neighbour of the last
  float range_min_m = 0, range_max_m = 0;
  int32_t layer_first = 0, layer_last = 65535;
  bool is_compensated = false;  // all points of a scan are placed as seen compensated_to_ns after its stamp
  int64_t compensated_to_ns = 0;
  Transform T_vehicle_sensor;
  float mounting_yaw_rad = 0;  // azimuth of the sensor's x axis in the vehicle frame, in (-pi, pi]
};

// azimuth_right < azimuth_left; for a sensor that wraps the right edge is left - 2 pi.
SensorModel make_sensor_model(int32_t rows, int32_t cols, double azimuth_left_rad, double azimuth_right_rad, bool wraps,
                              double range_min_m, double range_max_m) noexcept;

}  // namespace overtake
