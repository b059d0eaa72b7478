// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// Selects clusters that can be a vehicle by their size. Axis-aligned bounds in the vehicle frame reject no heading of
// the car: its diagonal is 5.27 m, and the limit, its length plus slack, is 5.41 m.
#include "core/math.h"
#include "kernels/gate_clusters.h"

namespace overtake::ref {

int32_t gate_clusters(const GateClustersParams& params, const FrameClusterTable& merged, int32_t* kept) noexcept {
  int32_t count = 0;
  for (int32_t i = 0; i < merged.count; ++i) {
    const float x = merged.max_x_m[i] - merged.min_x_m[i];
    const float y = merged.max_y_m[i] - merged.min_y_m[i];
    const float z = merged.max_z_m[i] - merged.min_z_m[i];
    const bool enough = merged.point_count[i] >= params.min_points;
    const bool fits = max_of(max_of(x, y), z) <= params.max_extent_m;
    if (enough && fits) kept[count++] = i;
  }
  return count;
}

}  // namespace overtake::ref
