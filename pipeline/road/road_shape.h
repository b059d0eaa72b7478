// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// The shape of a road whose heights are not known, fitted to the ground of one scan.
#pragma once

#include "core/plane.h"
#include "core/sensor_model.h"
#include "kernels/running_ground.h"

namespace overtake {

// The vehicle's axes in the map and the sensor's axes in the vehicle, in float.
struct RoadAxes {
  float map[9];
  Transform mounting;
  float to_sensor_z(float vehicle_z, float x, float y) const noexcept {  // x, y in the sensor's axes
    return (vehicle_z - mounting.t[2] - mounting.r[6] * x - mounting.r[7] * y) / mounting.r[8];
  }
};

// The shape of a road that is not known, in the vehicle frame: z = a + b x + c n + q x^2 + e x n with n the distance
// from the vehicle's lane, which bends by `curvature`. Beyond kBend_m it goes on straight, beyond kLane_m it is as at
// the edge.
constexpr int32_t kTerms = 5;
struct RoadShape {
  double term[kTerms] = {};  // a, b, c, q, e
  double curvature = 0;

  static constexpr double kBend_m = 100.0, kLane_m = 12.0;
  static double limited(double v, double most) noexcept {
    const double low = v < -most ? -most : v;
    return low > most ? most : low;
  }
  double lane_offset(double x, double y) const noexcept {
    const double near = limited(x, kBend_m);
    return y - 0.5 * curvature * near * (2.0 * x - near);
  }
  double height(double x, double y) const noexcept { return height_at(x, lane_offset(x, y)); }
  double height_at(double x, double lane_offset_m) const noexcept {
    const double near = limited(x, kBend_m), n = limited(lane_offset_m, kLane_m);
    return term[0] + term[1] * x + term[2] * n + term[3] * near * (2.0 * x - near) + term[4] * near * n;
  }
};

// Fits the shape to the scan's own ground, from near to far. A scan with too little ground leaves it as it is.
void fit_road(const RunningGroundParams& params, const RoadAxes& axes, const SensorModel& sensor,
              Plane<const float> range_m, Plane<const float> elevation_rad, RoadShape& shape) noexcept;

}  // namespace overtake
