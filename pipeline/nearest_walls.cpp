// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
#include "pipeline/nearest_walls.h"

#include <algorithm>

#include "core/reduce.h"

namespace overtake {
namespace {

constexpr float kFoot_m = 0.6f;  // a wall stands on the ground: a beam over the road is none

// Points begin, begin + step, ... of a cluster, kLanes at once. Which of them is nearer cannot be predicted, so no
// branch depends on it.
template <bool kOnlyFoot>
void add_points(const SensorPart& part, const float* origin_m, int32_t begin, int32_t end, int32_t step,
                NearestWall* nearest) noexcept {
  const float* const heights_m = part.kept.images.height_m.data;
  for (int32_t first = begin; first < end; first += kLanes * step) {
    int32_t direction[kLanes];
    float range2[kLanes];
    const int32_t count = std::min((end - first + step - 1) / step, kLanes);
    float x[kLanes] = {}, y[kLanes] = {};
    for (int32_t l = 0; l < count; ++l) {
      x[l] = part.cluster_points.x_m[first + l * step];
      y[l] = part.cluster_points.y_m[first + l * step];
    }
    for (int32_t l = 0; l < kLanes; ++l) {
      const float dx = x[l] - origin_m[0], dy = y[l] - origin_m[1];
      range2[l] = dx * dx + dy * dy;
      direction[l] = wall_direction_of(dx, dy);
    }
    for (int32_t l = 0; l < count; ++l) {
      const int32_t row = first + l * step;
      bool counts = range2[l] > 0.0f;
      if constexpr (kOnlyFoot) {
        const int32_t pixel = part.kept.points.pixel[part.cluster_points.point[row]];
        counts = counts & ((pixel < 0) | !(heights_m[pixel < 0 ? 0 : pixel] > kFoot_m));
      }
      const NearestWall own = uint64_t(std::bit_cast<uint32_t>(range2[l])) << 32 | uint32_t(row);
      NearestWall& best = nearest[direction[l]];
      best = std::min(best, counts ? own : kNoWall);
    }
  }
}

}  // namespace

void find_nearest_walls(const StageContext& context, const Frame& frame, int32_t sensor, int32_t most_read,
                        bool only_foot, NearestWall* nearest) noexcept {
  std::fill_n(nearest, kWallDirections, kNoWall);
  const SensorPart& part = frame.sensors[sensor];
  const FrameClusterTable& merged = frame.merged;
  const float* const origin_m = context.sensors[sensor].T_vehicle_sensor.t;
  const auto for_each_wall = [&](auto&& f) {
    for (int32_t m = 0; m < frame.members.count; ++m) {
      const int32_t row = frame.members.merged[m];
      if (frame.members.sensor[m] != sensor || row < 0) continue;
      const float dx = merged.max_x_m[row] - merged.min_x_m[row], dy = merged.max_y_m[row] - merged.min_y_m[row];
      if (std::max(dx, dy) > context.detect.walls.length_m) f(frame.members.cluster[m]);
    }
  };
  int32_t total = 0;
  for_each_wall([&](int32_t cluster) { total += part.clusters.point_count[cluster]; });
  const int32_t step = std::max(1, (total + most_read - 1) / most_read);
  const bool has_heights = part.kept.images.height_m.data != nullptr;
  for_each_wall([&](int32_t cluster) {
    const int32_t begin = part.clusters.point_begin[cluster], end = begin + part.clusters.point_count[cluster];
    if (only_foot && has_heights)
      add_points<true>(part, origin_m, begin, end, step, nearest);
    else
      add_points<false>(part, origin_m, begin, end, step, nearest);
  });
}

}  // namespace overtake
