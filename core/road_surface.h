// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// The expected height of the road around a sensor, sampled along rays. Kernels subtract it from the heights of returns,
// so that a road that bends up or down looks flat.
//
//   ray k      azimuth of the left edge of column k * kRayColumns; a block of columns lies between two rays
//   node i     horizontal distance kNodeScale_m * i^2, i < kNodes: 0 to 160 m, dense near the sensor
//   piece i    the line through nodes i and i + 1: height = offset + slope * distance; the last piece goes on for ever
//
// All values are in the sensor's axes: distances from its z axis, heights along it.
#pragma once

#include <cstdint>

#include "core/check.h"

namespace overtake {

inline constexpr int32_t kRayColumns = 16;  // columns from one ray to the next
inline constexpr int32_t kNodes = 16;
inline constexpr float kNodeScale_m = 160.0f / 225.0f;

// Rays of an image: one at each edge of every block of kRayColumns columns.
OVT_INLINE constexpr int32_t count_rays(int32_t cols) { return (cols + kRayColumns - 1) / kRayColumns + 1; }
OVT_INLINE constexpr float node_distance_m(int32_t node) { return kNodeScale_m * float(node * node); }

struct RoadSurface {
  float *offset_m = nullptr, *slope = nullptr;  // [count_rays * kNodes]: the pieces of each ray
  float* level_slope = nullptr;                 // [count_rays]: slope of a level plane along the ray
  // [count_rays]: measured road up to here, beyond it a guess of its shape; below 0 without a map or an ego pose
  float* known_m = nullptr;
  // [count_rays]: 1 / distance at which the ray leaves the circuit; 0: not known, or nowhere
  float* bound_per_m = nullptr;
  // [count_rays]: 1 / distance at which it does so for the last time: across a bend, a ray leaves the circuit twice
  float* last_bound_per_m = nullptr;
};

}  // namespace overtake
