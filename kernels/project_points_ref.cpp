// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// Section 1: points to spherical coordinates (paper IV-A).
#include "kernels/project_points.h"

#include <cmath>

#include "core/check.h"
#include "core/math.h"

namespace overtake::ref {
namespace {

// Points beyond this are rejected before any product of two coordinates, so nothing overflows at any sensor limit.
constexpr float kFarthest_m = 1e18f;
// A smaller coordinate becomes 0: squares and quotients are then never subnormal, which hosts may flush to zero.
constexpr float kNearest_m = 1e-12f;

struct Spherical {
  float range_m = 0.0f, elevation_rad = 0.0f;
  int32_t column = -1;
};

// Columns from the left edge, or -1. If the field of view contains +-pi, the difference of two azimuths needs a full
// turn added. A point just left of the left edge then lies almost a full turn to the right of it: outside, or in the
// last column if columns wrap. Rounding may put such a point exactly on the edge: column 0.
int32_t column_of(const SensorModel& sensor, float azimuth_rad) {
  const float d = sensor.azimuth_left_rad - azimuth_rad;
  const float right_of_edge = d < 0.0f ? d + kTwoPiF : d >= kTwoPiF ? d - kTwoPiF : d;
  const float position = right_of_edge * sensor.inverse_pitch;
  if (position >= 0.0f && position < float(sensor.cols)) return int32_t(position);
  return sensor.wraps ? 0 : -1;
}

Reason project(const SensorModel& sensor, float x, float y, float z, int32_t layer, Spherical& out) {
  if (!std::isfinite(x) || !std::isfinite(y) || !std::isfinite(z)) return Reason::kNotFinite;
  x = std::fabs(x) < kNearest_m ? 0.0f : x;
  y = std::fabs(y) < kNearest_m ? 0.0f : y;
  z = std::fabs(z) < kNearest_m ? 0.0f : z;
  if (x == 0.0f && y == 0.0f && z == 0.0f) return Reason::kZeroRange;

  const float farthest_m = sensor.range_max_m < kFarthest_m ? sensor.range_max_m : kFarthest_m;
  if (std::fabs(x) > farthest_m || std::fabs(y) > farthest_m || std::fabs(z) > farthest_m) return Reason::kRangeLimit;
  const float level = x * x + y * y;
  const float range_m = std::sqrt(level + z * z);
  if (range_m < sensor.range_min_m || range_m > farthest_m) return Reason::kRangeLimit;

  if (layer < 0 || layer < sensor.layer_first || layer > sensor.layer_last) return Reason::kBadLayer;

  const int32_t column = column_of(sensor, atan2_f32(y, x));
  if (column < 0) return Reason::kOutsideAzimuth;
  out = {range_m, atan2_f32(z, std::sqrt(level)), column};
  return Reason::kLabelled;
}

}  // namespace

void project_points(const SensorModel& sensor, const ScanTable& scan, PointTable& points, LayerSums& sums) noexcept {
  OVT_CHECK(scan.count <= points.capacity);
  points.count = scan.count;
  sums.touched_count = 0;
  for (int32_t i = 0; i < scan.count; ++i) {
    Spherical s;
    const Reason reason = project(sensor, scan.x_m[i], scan.y_m[i], scan.z_m[i], scan.layer[i], s);
    points.range_m[i] = s.range_m;
    points.elevation_rad[i] = s.elevation_rad;
    points.column[i] = s.column;
    points.reason[i] = uint8_t(reason);
    if (reason != Reason::kLabelled) continue;

    const int32_t layer = scan.layer[i];
    if (sums.point_count[layer]++ == 0) sums.touched[sums.touched_count++] = layer;
    sums.elevation_sum[layer] += int32_t(s.elevation_rad * kElevationUnit);
  }
}

}  // namespace overtake::ref
