// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// Section 10 of kernels/README.md: pose by two headings and a rectangle of known size (eq. 5).
#pragma once

#include <cstdint>

namespace overtake {

struct FitRectangleParams {
  float length_m, width_m;  // of the car
  float margin_m;           // a point this far outside the rectangle still counts
  int32_t min_var_points;   // fewer: psi_VAR = psi_REF
};

struct RectangleFit {
  float heading_ref_rad, heading_var_rad;     // directed, in (-pi, pi]
  int32_t inliers_ref, inliers_var;           // |P_REF|, |P_VAR|
  bool from_var;                              // eq. 5 chose psi_VAR
  float heading_rad, center_x_m, center_y_m;  // of the chosen rectangle
  float ref_x_m, ref_y_m, var_x_m, var_y_m;   // centres of both rectangles
  float extent_length_m, extent_width_m;      // extent of the points, along and across heading_rad
};

// Points x, y [count >= 1] of one cluster, and the position of the sensor that saw most of them, in the same frame.
//   psi_VAR  Zhang 2017, variance criterion, on a grid of 1 deg over [0, 90), refined by halving steps to 1/16 deg
//   scratch  none       agrees  exactly on every ISA: sums in 16 lanes (point k in lane k % 16), lanes added pairwise
namespace ref {
RectangleFit fit_rectangle(const FitRectangleParams& params, const float* x_m, const float* y_m, int32_t count,
                           float heading_ref_rad, float sensor_x_m, float sensor_y_m) noexcept;
}

}  // namespace overtake
