// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// The nearest point of a wall in each direction from a sensor.
#pragma once

#include <bit>
#include <cstdint>

#include "core/math.h"
#include "pipeline/stages.h"

namespace overtake {

inline constexpr int32_t kWallDirections = 720;  // of a full turn, about half a degree each

// The nearest point of a direction, as one key that sorts by range, then by row of the ClusterPointTable: positive
// floats sort like their bits.
using NearestWall = uint64_t;
inline constexpr NearestWall kNoWall = ~uint64_t(0);
OVT_INLINE int32_t row_of(NearestWall nearest) { return nearest == kNoWall ? -1 : int32_t(uint32_t(nearest)); }
OVT_INLINE float range2_of(NearestWall nearest) { return std::bit_cast<float>(uint32_t(nearest >> 32)); }

// A direction around the sensor as an index; the steps are not equal angles, but this needs no arc tangent. Without
// branches, so compilers make vectors of a loop over it.
OVT_INLINE int32_t wall_direction_of(float x, float y) {
  const float q = x / (abs_of(x) + abs_of(y) + 1e-30f);
  const float begin = y >= 0.0f ? 1.0f : 3.0f, sign = y >= 0.0f ? -1.0f : 1.0f;
  const float turn = begin + sign * q;  // 0 to 4
  const int32_t direction = int32_t(turn * (float(kWallDirections) * 0.25f));
  return direction < kWallDirections - 1 ? direction : kWallDirections - 1;
}

// Walls are the clusters longer than WallParams::length_m along x or y. Of the points of one sensor on walls reads
// every n-th, at most `most_read`, so that a scan has a limited cost; with `only_foot` those up to 0.6 m over the
// running ground.
//   reads  merged, members, cluster points; only_foot: their pixels and heights    writes  nearest[kWallDirections]
void find_nearest_walls(const StageContext& context, const Frame& frame, int32_t sensor, int32_t most_read,
                        bool only_foot, NearestWall* nearest) noexcept;

}  // namespace overtake
