// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// Columns of ovt_detections and values of ovt_frame_info that only some methods compute: null or 0, or absent in an
// older library.
#pragma once

#include <cstdint>

#include "tools/evaluation/metrics/consistency.h"
#include "tools/evaluation/numbers.h"
#include "tools/evaluation/places.h"

namespace overtake::evaluation {

// The height that a detection's centre is taken to the map at: that of the road under the object, else that of its
// points; vehicle frame.
template <class Detections>
double height_of(const Detections& d, int32_t i) {
  if constexpr (requires { d.road_z_m; })
    if (d.road_z_m) return double(d.road_z_m[i]);
  return double(d.z_m[i]);
}

// The pose that takes detections to the map: with the error of its heading that the method has found, if any.
template <class Info>
io::EgoRow corrected(io::EgoRow pose, const Info& info) {
  if constexpr (requires { info.ego_heading_offset_rad; }) pose.yaw_rad += info.ego_heading_offset_rad;
  return pose;
}

// The same for one detection: the offset at its own stamp, of its own sensor, where the method publishes it.
template <class Detections, class Info>
io::EgoRow corrected(io::EgoRow pose, const Info& info, const Detections& d, int32_t i) {
  if constexpr (requires { d.ego_offset_rad; })
    if (d.ego_offset_rad) {
      pose.yaw_rad += double(d.ego_offset_rad[i]);
      return pose;
    }
  return corrected(pose, info);
}

template <class Detections>
bool is_debris(const Detections& d, int32_t i) {
  constexpr int32_t kDebris = 2;  // OVT_CLASS_DEBRIS
  if constexpr (requires { d.object_class; })
    if (d.object_class) return d.object_class[i] == kDebris;
  return false;
}

// The square of a centre's error in units of its published covariance; NaN without one. The error is level, in the map;
// the covariance is in the plane of the vehicle with the given axes.
template <class Detections>
double square_of(const Detections& d, int32_t i, const Rotation& vehicle, double x_map_m, double y_map_m) {
  if constexpr (requires { d.var_x, d.var_y, d.cov_xy; })
    if (d.var_x && d.var_y && d.cov_xy) {
      const auto &ahead = vehicle[0], &left = vehicle[1];
      const double det = ahead[0] * left[1] - ahead[1] * left[0];
      const double error[2] = {(x_map_m * left[1] - y_map_m * left[0]) / det,
                               (y_map_m * ahead[0] - x_map_m * ahead[1]) / det};
      const double lower[3] = {double(d.var_x[i]), double(d.cov_xy[i]), double(d.var_y[i])};
      return metrics::normalized_square(error, lower, 2);
    }
  return kNan;
}

}  // namespace overtake::evaluation
