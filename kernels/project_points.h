// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// Section 1 of kernels/README.md: points to spherical coordinates.
#pragma once

#include "core/point_table.h"
#include "core/sensor_model.h"

namespace overtake {

// Per layer id of one scan: the number of valid points, and the sum of their elevations as integers of 2^-24 rad, which
// is the same in any order. Indexed by layer id; `touched` lists the ids in use (in any order).
inline constexpr int32_t kLayerIds = 65536;
inline constexpr float kElevationUnit = 16777216.0f;  // 2^24 per radian
struct LayerSums {
  int32_t touched_count = 0;
  int32_t* touched = nullptr;        // [kLayerIds]
  int32_t* point_count = nullptr;    // [kLayerIds], all zero between scans
  int64_t* elevation_sum = nullptr;  // [kLayerIds], all zero between scans
};

// r = |p|, azimuth a = atan2(y, x), elevation e = atan2(z, hypot(x, y)), column = floor((a_left - a) / pitch)
// (paper IV-A).
//   reads    scan x y z layer           writes  points range_m elevation_rad column reason, points.count; adds to sums
//   drops    points that are NaN, infinite, zero, outside range limits, of a bad layer, outside azimuth; the first that
//            holds is the reason. A dropped point has range_m = elevation_rad = 0, column = -1
//   cost     two atan2 and two sqrt per point            agrees  exactly on every ISA
namespace ref {
void project_points(const SensorModel& sensor, const ScanTable& scan, PointTable& points, LayerSums& sums) noexcept;
}

}  // namespace overtake
