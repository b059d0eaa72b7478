// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// Section 5b: ground removal by a running ground height.
#include "kernels/running_ground.h"

#include <cmath>

#include "core/check.h"
#include "kernels/running_ground_pixel.h"

namespace overtake::ref {
namespace {

float mix(float a, float b, float weight) { return a + weight * (b - a); }

void walk_column(const RunningGroundParams& params, const RoadSurface& road, Plane<const float> range_filled_m,
                 Plane<const float> elevation_filled_rad, int32_t c, Plane<float> height_m, BitPlane nonground,
                 BitPlane steep) {
  const int32_t ray = c / kRayColumns;
  const float weight = (float(c % kRayColumns) + 0.5f) * (1.0f / kRayColumns);
  const GroundBlock block = make_ground_block(params);
  const float known_m = min_of(road.known_m[ray], road.known_m[ray + 1]);
  const float level = mix(road.level_slope[ray], road.level_slope[ray + 1], weight) + params.level_slope_slack;
  const float *offset_m = road.offset_m + ray * kNodes, *slope = road.slope + ray * kNodes;
  const auto road_z = [&](float distance) {
    const float scaled = std::sqrt(distance * (1.0f / kNodeScale_m));
    const int32_t piece = int32_t(min_of(scaled, float(kNodes - 1)));
    const float offset = mix(offset_m[piece], offset_m[kNodes + piece], weight);
    return RoadPlace<float>{offset + mix(slope[piece], slope[kNodes + piece], weight) * distance, offset};
  };
  GroundState<float> state = start_ground(road_z(0.0f).z);
  for (int32_t r = range_filled_m.rows - 1; r >= 0; --r) {
    const float range = range_filled_m.row(r)[c];
    const bool exists = range > 0.0f;
    float sine, cosine;
    sin_cos_small_f32(elevation_filled_rad.row(r)[c], sine, cosine);
    const float distance = range * cosine;
    const auto pixel = walk_ground(block, distance, range * sine, road_z(distance), level, known_m, exists, state);
    height_m.row(r)[c] = pixel.height;
    if (exists && !pixel.ground) nonground.set(r, c);
    if (pixel.steep) steep.set(r, c);
  }
}

}  // namespace

void running_ground(const RunningGroundParams& params, const RoadSurface& road, Plane<const float> range_filled_m,
                    Plane<const float> elevation_filled_rad, Plane<float> height_m, BitPlane nonground, BitPlane steep,
                    ColumnSpan columns) noexcept {
  const ColumnSpan own = columns.within(range_filled_m.cols);
  for (int32_t r = 0; r < nonground.rows; ++r)
    for (int32_t w = own.first_word(); w < own.end_word(); ++w) nonground.row(r)[w] = steep.row(r)[w] = 0;
  for (int32_t c = own.first; c < own.last; ++c)
    walk_column(params, road, range_filled_m, elevation_filled_rad, c, height_m, nonground, steep);
  for (int32_t r = 0; r + 1 < nonground.rows; ++r)  // feet, from the top down
    for (int32_t w = own.first_word(); w < own.end_word(); ++w)
      nonground.row(r + 1)[w] |= nonground.row(r)[w] & steep.row(r)[w];
}

}  // namespace overtake::ref
