// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// What the reference and the vector form of fit_road share: the columns, a pixel, and the fit itself.
#pragma once

#include "kernels/fit_road.h"
#include "kernels/running_ground_pixel.h"

namespace overtake {

// Points on the road, of one scan. When they are too many, every other one goes, and of those that follow, too: points
// come column after column, so the last ones alone are not those of the whole road.
struct RoadPoints {
  static constexpr int32_t kCapacity = 4096;
  int32_t count = 0, offered = 0, every = 1;
  float x[kCapacity], n[kCapacity], above_m[kCapacity];  // ahead, left of the lane, over the expected road

  OVT_INLINE void clear() noexcept { count = offered = 0, every = 1; }

  OVT_INLINE void add(float at_x, float at_n, float at_above_m) noexcept {
    if (offered++ % every != 0) return;
    if (count == kCapacity) thin();
    x[count] = at_x;
    n[count] = at_n;
    above_m[count++] = at_above_m;
  }

 private:
  OVT_INLINE void thin() noexcept {
    count /= 2, every *= 2;
    for (int32_t i = 0; i < count; ++i) x[i] = x[2 * i], n[i] = n[2 * i], above_m[i] = above_m[2 * i];
  }
};

// Least squares over the points within trim_m of the shape, each 5 m of x with the same weight. False: too few points.
bool fit_shape(const RoadPoints& points, double trim_m, RoadShape& shape) noexcept;

// The first pass looks for the ground of a sensor whose pitch or roll is wrong by up to 3 deg: a column's first ground
// pixel may lie so much higher than the expected road. The next passes walk over the shape that it found.
struct FitPass {
  float reach_m;  // of the ground that counts
  double trim_m;
  bool of_plane;                     // also where only a plane is fitted
  float start_per_m, start_limit_m;  // at least, of the walk (RunningGroundParams)
};
constexpr FitPass kFitPasses[] = {
    {30.0f, 1.5, true, 0.06f, 1.5f}, {60.0f, 0.3, false, 0.0f, 0.0f}, {100.0f, 0.3, true, 0.0f, 0.0f}};

OVT_INLINE GroundBlock make_fit_block(const RunningGroundParams& params, const FitPass& pass) {
  GroundBlock block = make_ground_block(params);
  block.start_per_m = max_of(block.start_per_m, pass.start_per_m);
  block.start_limit_m = max_of(block.start_limit_m, pass.start_limit_m);
  return block;
}

OVT_INLINE bool fits_plane(const RoadShape& shape) noexcept {
  return shape.expected.source == ExpectedRoad::Source::kLearned;
}

// Every so many columns of the image.
struct FitColumns {
  int32_t first, step, count;
  FitColumns(const SensorModel& sensor, const RoadShape& shape) noexcept;
  OVT_INLINE int32_t operator[](int32_t k) const noexcept { return first + k * step; }
};

float azimuth_of(const SensorModel& sensor, int32_t column) noexcept;  // of its middle

// Where a pixel lies. V: float or a vector of floats.
template <class V>
struct RoadPixel {
  V distance, sensor_z;  // in the sensor's axes
  V x, n;                // ahead in the vehicle frame, left of its lane
  V above_m;             // over the expected road
  V expected_z;          // of the expected road there, in the sensor's axes
};

template <class V>
OVT_INLINE RoadPixel<V> place_pixel(const RoadAxes& axes, const RoadShape& shape, V range, V elevation, V sine,
                                    V cosine) {
  const float *m = axes.mounting.r, *t = axes.mounting.t;
  RoadPixel<V> p;
  V up, level;
  sin_cos_small_of(elevation, up, level);
  p.distance = range * level, p.sensor_z = range * up;
  const V sx = p.distance * cosine, sy = p.distance * sine;
  const V y = V(m[3]) * sx + V(m[4]) * sy + V(m[5]) * p.sensor_z + V(t[1]);
  const V tilt = V(m[6]) * sx + V(m[7]) * sy + V(t[2]);
  p.x = V(m[0]) * sx + V(m[1]) * sy + V(m[2]) * p.sensor_z + V(t[0]);
  p.n = shape.lane_offset(p.x, y);
  const V expected = shape.expected_at(p.x, p.n);
  p.above_m = tilt + V(m[8]) * p.sensor_z - expected;
  p.expected_z = (expected - tilt) * V(1.0f / m[8]);
  return p;
}

// The running ground under the sensor, before the first pixel.
template <class V>
OVT_INLINE GroundState<V> start_walk(const RoadAxes& axes, const RoadShape& shape) {
  const float x = axes.mounting.t[0], n = shape.lane_offset(x, axes.mounting.t[1]);
  return start_ground(V(axes.to_sensor_z(shape.height_at(x, n), 0.0f, 0.0f)));
}

// Moves the running ground up to a pixel. Returns whether the pixel is ground for the fit.
template <class V, class M>
OVT_INLINE M walk_pixel(const GroundBlock& block, const RoadAxes& axes, const RoadShape& shape, float reach_m,
                        const RoadPixel<V>& p, M exists, GroundState<V>& state) {
  constexpr float kLane_m = 6.0f, kNoEcho_m = -1e9f;  // the road returns an echo wherever it is
  const V zero(0.0f), road_z = p.expected_z + shape.difference_at(p.x, p.n) * V(1.0f / axes.mounting.r[8]);
  const auto pixel =
      walk_ground(block, p.distance, p.sensor_z, RoadPlace<V>{road_z, V(kNoEcho_m)}, zero, zero, exists, state);
  const V ahead = abs_of(p.x), aside = abs_of(p.n);
  return pixel.ground & (state.distance == p.distance) & (ahead <= V(reach_m)) & (aside <= V(kLane_m)) &
         (p.x >= V(shape.expected.from_m)) & (p.x <= V(shape.expected.to_m));
}

}  // namespace overtake
