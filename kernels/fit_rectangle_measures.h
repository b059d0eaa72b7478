// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// The measurements of the points that fit_rectangle needs. The loops over the points exist once per ISA; the search
// over the headings and the choice between the two poses exist once (fit_rectangle_ref.cpp).
//
// All coordinates are offsets from the cluster's first point, clamped, so that their precision does not depend on the
// distance to the frame's origin.
#pragma once

#include "core/math.h"
#include "kernels/fit_rectangle.h"

namespace overtake {

// Longer than any car. Keeps squares and their sums finite for all finite coordinates.
inline constexpr float kFitOffsetLimit_m = 1.0e6f;

// Axis 1 along the heading, axis 2 to its left.
struct HeadingAxes {
  float c, s;
  template <class V>
  OVT_INLINE V first(V x, V y) const {
    return x * V(c) + y * V(s);
  }
  template <class V>
  OVT_INLINE V second(V x, V y) const {
    return y * V(c) - x * V(s);
  }
};

// The minimum-area rectangle at a heading.
struct HeadingBounds {
  float low_1, high_1, low_2, high_2;
};

// A part of the known car's rectangle: `reach` to both sides of `center` on each axis.
struct HeadingBox {
  float center_1, center_2, reach_1, reach_2;
};

// The sums behind the cost of one heading (Zhang 2017, algorithm 4). Each point belongs to its closer edge (ties: an
// edge along axis 2), d is its distance to that edge. Set 1 holds the points closer to an edge that crosses axis 1, set
// 2 those closer to an edge that crosses axis 2.
struct EdgeSums {
  float count_1, sum_1, square_1, sum_2, square_2;
};

// Mean of the squares minus square of the mean; 0 for an empty set. This formula is precise enough here: the values are
// distances to an edge that the points lie along, and near the minimum they are small.
template <class V>
OVT_INLINE V variance_of(V count, V sum, V square_sum) {
  const V zero(0.0f);
  const auto any = count > zero;
  const V n = select(any, count, V(1.0f));
  const V mean = sum / n;
  return select(any, max_of(square_sum / n - mean * mean, zero), zero);
}

// The cost of a heading: the sum of the variances of both sets.
OVT_INLINE float edge_variance(const EdgeSums& e, int32_t count) {
  return variance_of(e.count_1, e.sum_1, e.square_1) + variance_of(float(count) - e.count_1, e.sum_2, e.square_2);
}

// `points` is private to the implementation. Each function is called at least once per heading.
struct RectangleMeasures {
  const void* points;
  // The cost of every whole degree, [kDegreesPadded] (the padding may hold any value).
  void (*cost_degrees)(const void* points, float* cost) noexcept;
  HeadingBounds (*bound)(const void* points, HeadingAxes axes) noexcept;
  EdgeSums (*sum_edges)(const void* points, HeadingAxes axes) noexcept;
  int32_t (*count_inside)(const void* points, HeadingAxes axes, HeadingBox box) noexcept;
};

// fit_rectangle without the loops over the points. Reads only the first point of x_m and y_m.
RectangleFit fit_rectangle_by(const RectangleMeasures& measures, const FitRectangleParams& params, const float* x_m,
                              const float* y_m, int32_t count, float heading_ref_rad, float sensor_x_m,
                              float sensor_y_m) noexcept;

}  // namespace overtake
