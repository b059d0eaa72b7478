// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// Section 10: the loops over the points for fit_rectangle; the search is in the reference (fit_rectangle_measures.h).
//
// One heading takes two passes over points in L1 (ManyPoints handles thousands, which do not fit). The first pass
// rotates the points to the heading's axes, stores them and finds the bounds; the second sums. When the 16 lanes do not
// fit one register, the sums go group by group (kSize lanes each), which needs fewer registers than all groups at once.
#pragma once

#include <limits>

#include "core/reduce.h"
#include "kernels/fit_rectangle_measures.h"
#include "kernels/heading_grid.h"
#include "kernels/simd.h"

namespace overtake::simd {

// A car is a few hundred points; copies of them stay in the cache. Larger clusters go block by block: see ManyPoints.
inline constexpr int32_t kMostFitPoints = 4096;
template <class A>
inline constexpr int32_t kFitGroups = kLanes / kSize<A>;

OVT_INLINE float offset_one(float v, float origin) {
  return max_of(min_of(v - origin, kFitOffsetLimit_m), 0.0f - kFitOffsetLimit_m);
}
template <class A>
OVT_INLINE Float<A> offset(Float<A> v, float origin) {
  return max_of(min_of(v - Float<A>(origin), Float<A>(kFitOffsetLimit_m)), Float<A>(0.0f - kFitOffsetLimit_m));
}
// Offsets from the first point, padded with the first point to whole blocks of kLanes. Returns the padded count.
template <class A>
OVT_INLINE int32_t copy_offsets(const float* x, const float* y, int32_t n, float first_x, float first_y, float* to_x,
                                float* to_y) {
  const int32_t padded = round_up(n, kLanes);
  int32_t k = 0;
  for (; k + kSize<A> <= n; k += kSize<A>) {
    offset(Float<A>::load(x + k), first_x).store(to_x + k);
    offset(Float<A>::load(y + k), first_y).store(to_y + k);
  }
  for (; k < n; ++k) {
    to_x[k] = offset_one(x[k], first_x);
    to_y[k] = offset_one(y[k], first_y);
  }
  for (; k < padded; ++k) to_x[k] = to_y[k] = 0.0f;
  return padded;
}

template <class A>
struct FitPoints {
  static constexpr int32_t kGroups = kFitGroups<A>;
  int32_t count, padded;
  alignas(64) float x_m[kMostFitPoints];
  alignas(64) float y_m[kMostFitPoints];
  alignas(64) float first_m[kMostFitPoints];  // on the axes of the current heading
  alignas(64) float second_m[kMostFitPoints];

  OVT_INLINE void read(const float* x, const float* y, int32_t n) {
    count = n;
    padded = copy_offsets<A>(x, y, n, x[0], y[0], x_m, y_m);
  }
};

// The bounds of points that come in blocks: the same result as the reference, including the sign of a zero.
template <class A>
struct BoundLanes {
  static constexpr float kInfinity = std::numeric_limits<float>::infinity();
  Float<A> low_1[kFitGroups<A>], high_1[kFitGroups<A>], low_2[kFitGroups<A>], high_2[kFitGroups<A>];

  OVT_INLINE BoundLanes() {
    for (int32_t g = 0; g < kFitGroups<A>; ++g) {
      low_1[g] = low_2[g] = Float<A>(kInfinity);
      high_1[g] = high_2[g] = Float<A>(-kInfinity);
    }
  }
  OVT_INLINE void add(const float* block_x, const float* block_y, int32_t n, HeadingAxes axes) {
    for (int32_t g = 0; g < kFitGroups<A>; ++g)
      for (int32_t k = g * kSize<A>; k < n; k += kLanes) {
        const Float<A> x = Float<A>::load(block_x + k), y = Float<A>::load(block_y + k);
        const Float<A> c1 = axes.first(x, y), c2 = axes.second(x, y);
        const Mask<A> in = Mask<A>::first(n - k);
        low_1[g] = min_of(low_1[g], select(in, c1, Float<A>(kInfinity)));
        high_1[g] = max_of(high_1[g], select(in, c1, Float<A>(-kInfinity)));
        low_2[g] = min_of(low_2[g], select(in, c2, Float<A>(kInfinity)));
        high_2[g] = max_of(high_2[g], select(in, c2, Float<A>(-kInfinity)));
      }
  }
  OVT_INLINE HeadingBounds bounds() { return {lane_min(low_1), lane_max(high_1), lane_min(low_2), lane_max(high_2)}; }
};

template <class A>
HeadingBounds bound_points(const void* context, HeadingAxes axes) noexcept {
  const FitPoints<A>& points = *static_cast<const FitPoints<A>*>(context);
  BoundLanes<A> lanes;
  lanes.add(points.x_m, points.y_m, points.count, axes);
  return lanes.bounds();
}

// The same for callers that ignore the sign of a zero (the sums below): any order will do. The last block is padded
// with the first point, which changes no bound.
template <class A>
OVT_INLINE HeadingBounds turn_points(FitPoints<A>& points, HeadingAxes axes) {
  constexpr float kInfinity = std::numeric_limits<float>::infinity();
  Float<A> low_1(kInfinity), high_1(-kInfinity), low_2(kInfinity), high_2(-kInfinity);
  for (int32_t k = 0; k < points.padded; k += kSize<A>) {
    const Float<A> x = Float<A>::load(points.x_m + k), y = Float<A>::load(points.y_m + k);
    const Float<A> c1 = axes.first(x, y), c2 = axes.second(x, y);
    c1.store(points.first_m + k);
    c2.store(points.second_m + k);
    low_1 = min_of(low_1, c1);
    high_1 = max_of(high_1, c1);
    low_2 = min_of(low_2, c2);
    high_2 = max_of(high_2, c2);
  }
  return {any_lane_min(low_1), any_lane_max(high_1), any_lane_min(low_2), any_lane_max(high_2)};
}

// The sums of one group of kSize lanes. A count needs no lanes: it is exact in any order.
template <class A>
struct EdgeLanes {
  int32_t count_1 = 0;
  Float<A> sum_1{0.0f}, square_1{0.0f}, sum_2{0.0f}, square_2{0.0f};

  OVT_INLINE void add(Mask<A> in, Float<A> d1, Float<A> d2) {
    const Mask<A> closer_2 = d2 < d1;
    const Mask<A> in_1 = in & ~closer_2, in_2 = in & closer_2;
    const Float<A> d = min_of(d2, d1), square = d * d;  // the distance to the closer edge
    count_1 += count_bits(in_1.bits());
    sum_1 = add_where(in_1, sum_1, d);
    square_1 = add_where(in_1, square_1, square);
    sum_2 = add_where(in_2, sum_2, d);
    square_2 = add_where(in_2, square_2, square);
  }
};

// The sums of one heading, in the reference's order, of points that come in blocks.
template <class A>
struct EdgeGroups {
  int32_t count_1 = 0;
  Float<A> sum_1[kFitGroups<A>], square_1[kFitGroups<A>], sum_2[kFitGroups<A>], square_2[kFitGroups<A>];

  OVT_INLINE EdgeGroups() {
    for (int32_t g = 0; g < kFitGroups<A>; ++g) sum_1[g] = square_1[g] = sum_2[g] = square_2[g] = Float<A>(0.0f);
  }
  // turned(k, c1, c2): gives the coordinates of points k .. k + kSize - 1 of the block on the axes of the heading.
  template <class F>
  OVT_INLINE void add(int32_t n, HeadingBounds b, F&& turned) {
    const Float<A> low_1(b.low_1), high_1(b.high_1), low_2(b.low_2), high_2(b.high_2);
    for (int32_t g = 0; g < kFitGroups<A>; ++g) {
      EdgeLanes<A> lanes{0, sum_1[g], square_1[g], sum_2[g], square_2[g]};  // kept in registers
      const auto add_one = [&](int32_t k, Mask<A> in) OVT_INLINED {
        Float<A> c1, c2;
        turned(k, c1, c2);
        lanes.add(in, min_of(c1 - low_1, high_1 - c1), min_of(c2 - low_2, high_2 - c2));
      };
      int32_t k = g * kSize<A>;
      for (; k + kSize<A> <= n; k += kLanes) add_one(k, Mask<A>(true));
      if (k < n) add_one(k, Mask<A>::first(n - k));
      count_1 += lanes.count_1;
      sum_1[g] = lanes.sum_1, square_1[g] = lanes.square_1;
      sum_2[g] = lanes.sum_2, square_2[g] = lanes.square_2;
    }
  }
  OVT_INLINE EdgeSums sums() {
    float own[4];
    lane_sums(sum_1, square_1, sum_2, square_2, own);
    return {float(count_1), own[0], own[1], own[2], own[3]};
  }
};

template <class A>
EdgeSums sum_edges(const void* context, HeadingAxes axes) noexcept {
  // The const_cast is safe: one thread calls the measures, one at a time, so they may use the points' scratch.
  FitPoints<A>& points = *static_cast<FitPoints<A>*>(const_cast<void*>(context));
  const HeadingBounds bounds = turn_points(points, axes);
  EdgeGroups<A> edges;
  edges.add(points.count, bounds, [&](int32_t k, Float<A>& c1, Float<A>& c2) OVT_INLINED {
    c1 = Float<A>::load(points.first_m + k), c2 = Float<A>::load(points.second_m + k);
  });
  return edges.sums();
}

// The cost of all whole degrees for few points, which would leave most lanes of the loops above empty. Here a lane is a
// heading, and the reference's 16 lanes are 16 registers in memory. A cluster of ten points costs a tenth.
inline constexpr int32_t kFewPoints = 48;

template <class A>
OVT_INLINE void cost_of_few(const FitPoints<A>& points, const float* degree_cos, const float* degree_sin, float* cost) {
  constexpr float kInfinity = std::numeric_limits<float>::infinity();
  const Float<A> c = Float<A>::load(degree_cos), s = Float<A>::load(degree_sin), zero(0.0f);
  Float<A> first[kFewPoints], second[kFewPoints];
  Float<A> low_1(kInfinity), high_1(-kInfinity), low_2(kInfinity), high_2(-kInfinity);
  for (int32_t k = 0; k < points.count; ++k) {
    const Float<A> x(points.x_m[k]), y(points.y_m[k]);
    const Float<A> c1 = x * c + y * s, c2 = y * c - x * s;
    first[k] = c1, second[k] = c2;
    low_1 = min_of(low_1, c1), high_1 = max_of(high_1, c1);
    low_2 = min_of(low_2, c2), high_2 = max_of(high_2, c2);
  }
  struct {
    Float<A> count_1, sum_1, square_1, sum_2, square_2;
  } lane[kLanes];
  const int32_t lanes = points.count < kLanes ? points.count : kLanes;  // the other lanes would stay +0
  for (int32_t k = 0; k < points.count; ++k) {
    const Float<A> d1 = min_of(first[k] - low_1, high_1 - first[k]), d2 = min_of(second[k] - low_2, high_2 - second[k]);
    const Mask<A> closer_2 = d2 < d1;
    const Float<A> in_1 = select(closer_2, zero, d1), in_2 = select(closer_2, d2, zero);
    const Float<A> one = select(closer_2, zero, Float<A>(1.0f)), square_1 = in_1 * in_1, square_2 = in_2 * in_2;
    auto& l = lane[k % kLanes];
    if (k < kLanes) {
      l = {zero + one, zero + in_1, zero + square_1, zero + in_2, zero + square_2};
    } else {
      l = {l.count_1 + one, l.sum_1 + in_1, l.square_1 + square_1, l.sum_2 + in_2, l.square_2 + square_2};
    }
  }
  for (int32_t apart = kLanes / 2; apart > 0; apart /= 2)
    for (int32_t i = 0; i < apart && i + apart < lanes; ++i) {
      auto &l = lane[i], &m = lane[i + apart];
      l = {l.count_1 + m.count_1, l.sum_1 + m.sum_1, l.square_1 + m.square_1, l.sum_2 + m.sum_2,
           l.square_2 + m.square_2};
    }
  const auto& e = lane[0];
  const Float<A> in_2 = Float<A>(float(points.count)) - e.count_1;
  (variance_of(e.count_1, e.sum_1, e.square_1) + variance_of(in_2, e.sum_2, e.square_2)).store(cost);
}

// All whole degrees, if one register holds all 16 lanes. While it sums the edges of one heading, it rotates the points
// to the next heading: the two tasks use different units of the processor.
template <class A>
OVT_INLINE void cost_by_turns(FitPoints<A>& points, float* cost) {
  constexpr float kInfinity = std::numeric_limits<float>::infinity();
  HeadingBounds b = turn_points(points, {kHeadingGrid.degree_cos[0], kHeadingGrid.degree_sin[0]});
  const int32_t whole = points.count / kSize<A> * kSize<A>;
  float counts[kDegreesPadded], sums[4][kDegreesPadded];
  for (int32_t d = 0; d < kDegreeCount; ++d) {
    const HeadingAxes next = {kHeadingGrid.degree_cos[d + 1],
                              kHeadingGrid.degree_sin[d + 1]};  // the last value is not used
    const Float<A> low_1(b.low_1), high_1(b.high_1), low_2(b.low_2), high_2(b.high_2), c(next.c), s(next.s);
    Float<A> next_low_1(kInfinity), next_high_1(-kInfinity), next_low_2(kInfinity), next_high_2(-kInfinity);
    EdgeLanes<A> lanes;
    const auto step = [&](int32_t k, Mask<A> in) OVT_INLINED {
      const Float<A> c1 = Float<A>::load(points.first_m + k), c2 = Float<A>::load(points.second_m + k);
      lanes.add(in, min_of(c1 - low_1, high_1 - c1), min_of(c2 - low_2, high_2 - c2));
      const Float<A> x = Float<A>::load(points.x_m + k), y = Float<A>::load(points.y_m + k);
      const Float<A> n1 = x * c + y * s, n2 = y * c - x * s;
      n1.store(points.first_m + k);
      n2.store(points.second_m + k);
      next_low_1 = min_of(next_low_1, n1);
      next_high_1 = max_of(next_high_1, n1);
      next_low_2 = min_of(next_low_2, n2);
      next_high_2 = max_of(next_high_2, n2);
    };
    for (int32_t k = 0; k < whole; k += kSize<A>) step(k, Mask<A>(true));
    if (whole < points.count) step(whole, Mask<A>::first(points.count - whole));
    float own[4];
    lane_sums(&lanes.sum_1, &lanes.square_1, &lanes.sum_2, &lanes.square_2, own);
    counts[d] = float(lanes.count_1);
    for (int32_t k = 0; k < 4; ++k) sums[k][d] = own[k];
    b = {any_lane_min(next_low_1), any_lane_max(next_high_1), any_lane_min(next_low_2), any_lane_max(next_high_2)};
  }
  for (int32_t d = kDegreeCount; d < kDegreesPadded; ++d)
    counts[d] = sums[0][d] = sums[1][d] = sums[2][d] = sums[3][d] = 0.0f;
  for (int32_t d = 0; d < kDegreeCount; d += kSize<A>) {
    const Float<A> in_1 = Float<A>::load(counts + d), in_2 = Float<A>(float(points.count)) - in_1;
    (variance_of(in_1, Float<A>::load(sums[0] + d), Float<A>::load(sums[1] + d)) +
     variance_of(in_2, Float<A>::load(sums[2] + d), Float<A>::load(sums[3] + d)))
        .store(cost + d);
  }
}

template <class A>
void cost_degrees(const void* context, float* cost) noexcept {
  const FitPoints<A>& points = *static_cast<const FitPoints<A>*>(context);
  if (points.count <= kFewPoints) {
    for (int32_t d = 0; d < kDegreeCount; d += kSize<A>)
      cost_of_few(points, kHeadingGrid.degree_cos + d, kHeadingGrid.degree_sin + d, cost + d);
    return;
  }
  if constexpr (kSize<A> == kLanes) return cost_by_turns(const_cast<FitPoints<A>&>(points), cost);
  for (int32_t d = 0; d < kDegreeCount; ++d)
    cost[d] =
        edge_variance(sum_edges<A>(context, {kHeadingGrid.degree_cos[d], kHeadingGrid.degree_sin[d]}), points.count);
}

template <class A>
OVT_INLINE int32_t count_in_block(const float* block_x, const float* block_y, int32_t n, HeadingAxes axes,
                                  HeadingBox box) {
  int32_t inside = 0;
  for (int32_t k = 0; k < n; k += kSize<A>) {
    const Float<A> x = Float<A>::load(block_x + k), y = Float<A>::load(block_y + k);
    const Mask<A> in = (abs_of(axes.first(x, y) - Float<A>(box.center_1)) <= Float<A>(box.reach_1)) &
                       (abs_of(axes.second(x, y) - Float<A>(box.center_2)) <= Float<A>(box.reach_2)) &
                       Mask<A>::first(n - k);
    inside += count_bits(in.bits());
  }
  return inside;
}
template <class A>
int32_t count_inside(const void* context, HeadingAxes axes, HeadingBox box) noexcept {
  const FitPoints<A>& points = *static_cast<const FitPoints<A>*>(context);
  return count_in_block<A>(points.x_m, points.y_m, points.count, axes, box);
}

// A car alongside has thousands of points. This form neither copies them all nor stores rotated points: it copies one
// block at a time and evaluates all requested headings while the block is in L1.
template <class A>
struct ManyPoints {
  static constexpr int32_t kBlock = 512;  // a multiple of kLanes, so a point has the same lane in its block
  const float *x_m, *y_m;
  int32_t count;

  template <class F>
  OVT_INLINE void each_block(F&& work) const {
    alignas(64) float block_x[kBlock], block_y[kBlock];
    for (int32_t begin = 0; begin < count; begin += kBlock) {
      const int32_t n = count - begin < kBlock ? count - begin : kBlock;
      copy_offsets<A>(x_m + begin, y_m + begin, n, x_m[0], y_m[0], block_x, block_y);
      work(block_x, block_y, n);
    }
  }
};

// One heading's bounds for callers that ignore the sign of a zero: see turn_points.
template <class A>
struct ManyBounds {
  Float<A> low_1{BoundLanes<A>::kInfinity}, high_1{-BoundLanes<A>::kInfinity};
  Float<A> low_2{BoundLanes<A>::kInfinity}, high_2{-BoundLanes<A>::kInfinity};

  OVT_INLINE void add(const float* block_x, const float* block_y, int32_t n, HeadingAxes axes) {
    ManyBounds b = *this;
    for (int32_t k = 0; k < n; k += kSize<A>) {
      const Float<A> x = Float<A>::load(block_x + k), y = Float<A>::load(block_y + k);
      const Float<A> c1 = axes.first(x, y), c2 = axes.second(x, y);
      b.low_1 = min_of(b.low_1, c1);
      b.high_1 = max_of(b.high_1, c1);
      b.low_2 = min_of(b.low_2, c2);
      b.high_2 = max_of(b.high_2, c2);
    }
    *this = b;
  }
  OVT_INLINE HeadingBounds bounds() const {
    return {any_lane_min(low_1), any_lane_max(high_1), any_lane_min(low_2), any_lane_max(high_2)};
  }
};

template <class A>
HeadingBounds bound_many(const void* context, HeadingAxes axes) noexcept {
  BoundLanes<A> lanes;
  static_cast<const ManyPoints<A>*>(context)->each_block([&](const float* x, const float* y, int32_t n)
                                                             OVT_INLINED { lanes.add(x, y, n, axes); });
  return lanes.bounds();
}

// The sums of kHeadings headings, each block read once for all of them.
template <class A, int32_t kHeadings>
OVT_INLINE void sum_headings(const ManyPoints<A>& points, const HeadingAxes* axes, EdgeSums* sums) {
  ManyBounds<A> bounds[kHeadings];
  points.each_block([&](const float* x, const float* y, int32_t n) OVT_INLINED {
    for (int32_t h = 0; h < kHeadings; ++h) bounds[h].add(x, y, n, axes[h]);
  });
  HeadingBounds known[kHeadings];
  for (int32_t h = 0; h < kHeadings; ++h) known[h] = bounds[h].bounds();
  EdgeGroups<A> edges[kHeadings];
  points.each_block([&](const float* block_x, const float* block_y, int32_t n) OVT_INLINED {
    for (int32_t h = 0; h < kHeadings; ++h)
      edges[h].add(n, known[h], [&](int32_t k, Float<A>& c1, Float<A>& c2) OVT_INLINED {
        const Float<A> x = Float<A>::load(block_x + k), y = Float<A>::load(block_y + k);
        c1 = axes[h].first(x, y), c2 = axes[h].second(x, y);
      });
  });
  for (int32_t h = 0; h < kHeadings; ++h) sums[h] = edges[h].sums();
}

template <class A>
EdgeSums sum_many(const void* context, HeadingAxes axes) noexcept {
  EdgeSums sums;
  sum_headings<A, 1>(*static_cast<const ManyPoints<A>*>(context), &axes, &sums);
  return sums;
}

template <class A>
void cost_many(const void* context, float* cost) noexcept {
  const ManyPoints<A>& points = *static_cast<const ManyPoints<A>*>(context);
  HeadingAxes axes[kDegreeCount];
  for (int32_t d = 0; d < kDegreeCount; ++d) axes[d] = {kHeadingGrid.degree_cos[d], kHeadingGrid.degree_sin[d]};
  EdgeSums sums[kDegreeCount];
  sum_headings<A, kDegreeCount>(points, axes, sums);
  for (int32_t d = 0; d < kDegreeCount; ++d) cost[d] = edge_variance(sums[d], points.count);
}

template <class A>
int32_t count_inside_many(const void* context, HeadingAxes axes, HeadingBox box) noexcept {
  int32_t inside = 0;
  static_cast<const ManyPoints<A>*>(context)->each_block(
      [&](const float* x, const float* y, int32_t n) OVT_INLINED { inside += count_in_block<A>(x, y, n, axes, box); });
  return inside;
}

// Not inlined: its large stack must not be allocated for clusters with more points.
template <class A>
[[gnu::noinline]] RectangleFit fit_copied(const FitRectangleParams& params, const float* x_m, const float* y_m,
                                          int32_t count, float heading_ref_rad, float sensor_x_m,
                                          float sensor_y_m) noexcept {
  FitPoints<A> points;
  points.read(x_m, y_m, count);
  return fit_rectangle_by({&points, &cost_degrees<A>, &bound_points<A>, &sum_edges<A>, &count_inside<A>}, params, x_m,
                          y_m, count, heading_ref_rad, sensor_x_m, sensor_y_m);
}

template <class A>
RectangleFit fit_rectangle(const FitRectangleParams& params, const float* x_m, const float* y_m, int32_t count,
                           float heading_ref_rad, float sensor_x_m, float sensor_y_m) noexcept {
  if (count <= kMostFitPoints) return fit_copied<A>(params, x_m, y_m, count, heading_ref_rad, sensor_x_m, sensor_y_m);
  const ManyPoints<A> many{x_m, y_m, count};
  return fit_rectangle_by({&many, &cost_many<A>, &bound_many<A>, &sum_many<A>, &count_inside_many<A>}, params, x_m, y_m,
                          count, heading_ref_rad, sensor_x_m, sensor_y_m);
}

}  // namespace overtake::simd
