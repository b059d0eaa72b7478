// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// A measurement: one detection of a vehicle in the tracker's frame of reference. This is the only row type between a
// frame's detections and the filter's update: the frame fills it, the history keeps it, the filter reads it.
#pragma once

#include <cmath>
#include <cstdint>
#include <limits>

#include "core/ids.h"

namespace overtake {

inline constexpr double kNotMeasured = std::numeric_limits<double>::quiet_NaN();

struct Measurement {
  double x_m = 0, y_m = 0;
  double var_x = kNotMeasured, var_y = kNotMeasured, cov_xy = kNotMeasured;  // if not valid: R of the parameters
  double heading_rad = kNotMeasured;
  double length_m = kNotMeasured, width_m = kNotMeasured;
  int64_t stamp_ns = 0;
  int32_t debris = 0;  // 1: initiates no track, and is no hit of a tentative one
  int32_t faint = 0;   // 1: likewise, and it is no detection: too few points for one. No counter counts it
  // What the detection says beside its place. The paper's tracker reads none of it.
  double height_m = kNotMeasured;  // of the highest point over the road
  int32_t object_class = 0;        // ObjectClass
  int32_t free_heading = 0;        // 1: heading_rad was measured modulo pi, not taken from the map or the ego vehicle
  int32_t front = 0;               // where the front of the car is: 1 along heading_rad, -1 the other way, 0 unknown
  int32_t view = -1;               // CarView, -1 unknown
  int32_t points = 0;              // of a cluster; 0: a pushed row
  int32_t in_shadow = 0;           // 1: the shadow of the own car may cut off its sides (pose_by_view.cpp)
  int32_t in_smoke = 0;         // 1: smoke beside it may count as an end of the car, in one frame and not in the next
  double score = kNotMeasured;  // of a pushed row: its detector's confidence, 0 to 1
};

// The rules for looks, lasting errors and clutter are of clusters. A pushed row has no points: its box is another
// detector's estimate of a whole object.
inline bool is_cluster(const Measurement& z) noexcept { return z.points > 0 && std::isfinite(z.height_m); }

// Positive definite, with variances of 1e-12 to 1e12 m^2.
inline bool has_covariance(const Measurement& z) noexcept {
  const auto is_variance = [](double v) { return v >= 1e-12 && v <= 1e12; };
  if (!is_variance(z.var_x) || !is_variance(z.var_y)) return false;
  return z.var_x * z.var_y - z.cov_xy * z.cov_xy > 1e-9 * z.var_x * z.var_y;  // not when it is NaN
}

// A measurement without a valid covariance gets the tracker's R.
inline void ensure_covariance(const double* r_diag, Measurement& z) noexcept {
  if (has_covariance(z)) return;
  z.var_x = r_diag[0];
  z.var_y = r_diag[1];
  z.cov_xy = 0.0;
}

// The measurements of one frame.
struct MeasurementTable {
  int32_t count = 0, capacity = 0;
  Measurement* row = nullptr;
  TrackId* track = nullptr;  // id of the track that took it, kNobody none
};
// clang-format off
template <class F>
void for_each_column(MeasurementTable& t, F&& f) {
  f("row", t.row);  f("track", t.track);
}
// clang-format on

}  // namespace overtake
