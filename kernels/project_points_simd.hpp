// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// Section 1: points to spherical coordinates. The arithmetic of two atan2 per point takes most of the time; the two
// divisions and two roots run in parallel with it. Blocks of points alternate with the sums of their layers, which need
// other registers and find the block in L1.
//
// Sums per layer: points come ring by ring, or as the interleaved rings of two heads. So most vectors hold the one or
// two layers of the vector before, whose sums stay in registers. All other points (ends of rings, firing order, any
// order) are added in memory one by one. The sums are integers, so both ways may alternate.
#pragma once

#include <limits>

#include "core/math.h"
#include "kernels/float_pair.h"
#include "kernels/project_points.h"
#include "kernels/simd.h"

namespace overtake::simd {

OVT_INLINE void add_to_layer(LayerSums& sums, int32_t layer, int32_t count, int64_t elevation) {
  if (sums.point_count[layer] == 0) sums.touched[sums.touched_count++] = layer;
  sums.point_count[layer] += count;
  sums.elevation_sum[layer] += elevation;
}

// The sums of one layer, in registers.
template <class A>
struct LayerRun {
  Int<A> layer{kNoLayer}, count{0}, sum{0};

  OVT_INLINE void add(Mask<A> in, Int<A> units) {
    count = count + select(in, Int<A>(1), Int<A>(0));
    sum = sum + select(in, units, Int<A>(0));
  }
  // Stores the sums and starts those of another layer.
  OVT_INLINE void turn_to(int32_t next, LayerSums& sums) {
    int32_t counts[kSize<A>], lanes[kSize<A>];
    count.store(counts);
    sum.store(lanes);
    int64_t total = 0;
    int32_t points = 0;
    for (int32_t i = 0; i < kSize<A>; ++i) points += counts[i], total += lanes[i];
    if (points > 0) {
      layer.store(lanes);
      add_to_layer(sums, lanes[0], points, total);
    }
    layer = Int<A>(next);
    count = sum = Int<A>(0);
  }
};

// An elevation is at most pi/2 2^24 units: a lane holds the sum of 80. Whole blocks share the registers of one run.
inline constexpr int32_t kProjectVectors = 64;

template <class A>
OVT_INLINE void sum_layers(const ScanTable& scan, const PointTable& points, int32_t begin, int32_t end,
                           LayerSums& sums_out) {
  const int32_t* layers = scan.layer;
  const float* elevations = points.elevation_rad;
  const int32_t* columns = points.column;
  LayerSums sums = sums_out;
  LayerRun<A> a, b;
  int32_t layer_a = kNoLayer, layer_b = kNoLayer;
  for (int32_t i = begin; i < end; i += kSize<A>) {
    const Int<A> layer = Int<A>::load(layers + i);
    const Mask<A> valid = (Int<A>::load(columns + i) > Int<A>(-1)) & Mask<A>::first(end - i);
    const Int<A> units = to_int(Float<A>::load(elevations + i) * Float<A>(kElevationUnit));
    const Mask<A> in_a = valid & (layer == a.layer), in_b = valid & ~in_a & (layer == b.layer);  // may be one layer
    if (!(valid & ~(in_a | in_b)).any()) {
      a.add(in_a, units);
      b.add(in_b, units);
      continue;
    }
    int32_t unit[kSize<A>];
    units.store(unit);
    if (valid.bits() == Mask<A>(true).bits()) {
      for (int32_t l = 0; l < kSize<A>; ++l) add_to_layer(sums, layers[i + l], 1, unit[l]);
    } else {
      for (uint32_t bits = valid.bits(); bits != 0; bits &= bits - 1) {
        const int32_t l = lowest_bit(bits);
        add_to_layer(sums, layers[i + l], 1, unit[l]);
      }
    }
    // The layers of the last two points are the best guess for the next vector, unless every vector has new layers.
    const int32_t last = layers[i + kSize<A> - 1], before = layers[i + kSize<A> - 2];
    const int32_t mid = layers[i + kSize<A> - 3];
    if (mid != last && mid != before) continue;
    const bool swap = last == layer_a || before == layer_b;
    const int32_t next_a = swap ? last : before, next_b = swap ? before : last;
    if (next_a != layer_a) a.turn_to(layer_a = next_a, sums);
    if (next_b != layer_b) b.turn_to(layer_b = next_b, sums);
  }
  a.turn_to(kNoLayer, sums);
  b.turn_to(kNoLayer, sums);
  sums_out.touched_count = sums.touched_count;
}

// The sensor's parameters, each in all lanes.
template <class A>
struct Projector {
  static constexpr float kFarthest_m = 1e18f, kNearest_m = 1e-12f;  // as in the reference
  Float<A> nearest, farthest, nearest_at_all, left, inverse_pitch, cols;
  Int<A> layer_below, layer_last, outside;

  OVT_INLINE explicit Projector(const SensorModel& sensor)
      : nearest(sensor.range_min_m),
        farthest(sensor.range_max_m < kFarthest_m ? sensor.range_max_m : kFarthest_m),
        nearest_at_all(sensor.range_min_m > 0.5f * kNearest_m ? sensor.range_min_m : 0.5f * kNearest_m),
        left(sensor.azimuth_left_rad),
        inverse_pitch(sensor.inverse_pitch),
        cols(float(sensor.cols)),
        layer_below((sensor.layer_first > 0 ? sensor.layer_first : 0) - 1),
        layer_last(sensor.layer_last),
        outside(sensor.wraps ? 0 : -1) {}

  OVT_INLINE Mask<A> layer_fits(Int<A> layer) const { return (layer > layer_below) & ~(layer > layer_last); }

  // Columns from the left edge: see the reference.
  OVT_INLINE Int<A> column_of(Float<A> azimuth) const {
    const Float<A> zero(0.0f), turn(kTwoPiF);
    const Float<A> d = left - azimuth;
    const Float<A> position = select(d < zero, d + turn, select(d >= turn, d - turn, d)) * inverse_pitch;
    return select((position >= zero) & (position < cols), to_int(position), outside);
  }

  // The first reason that holds wins, so the tests run in reverse order. x, y, z are the input values.
  OVT_INLINE Int<A> reason_of(Float<A> x, Float<A> y, Float<A> z, Float<A> range, Int<A> layer, Int<A> column) const {
    const auto is = [](Reason reason) OVT_INLINED { return Int<A>(int32_t(reason)); };
    const Float<A> largest(std::numeric_limits<float>::max());
    const Mask<A> finite = (abs_of(x) <= largest) & (abs_of(y) <= largest) & (abs_of(z) <= largest);
    const Float<A> coordinate = max_of(max_of(abs_of(x), abs_of(y)), abs_of(z));
    Int<A> reason = select(column < Int<A>(0), is(Reason::kOutsideAzimuth), is(Reason::kLabelled));
    reason = select(layer_fits(layer), reason, is(Reason::kBadLayer));
    reason = select(~(range < nearest) & (range <= farthest), reason, is(Reason::kRangeLimit));
    reason = select(coordinate < Float<A>(kNearest_m), is(Reason::kZeroRange), reason);
    return select(finite, reason, is(Reason::kNotFinite));
  }
};

// A coordinate below the reference's limit becomes 0. Such coordinates are rare.
template <class A>
OVT_INLINE void clear_tiny(Float<A>& x, Float<A>& y, Float<A>& z) {
  const Float<A> zero(0.0f), limit(Projector<A>::kNearest_m);
  if (!(min_of(min_of(abs_of(x), abs_of(y)), abs_of(z)) < limit).any()) return;
  x = select(abs_of(x) < limit, zero, x);
  y = select(abs_of(y) < limit, zero, y);
  z = select(abs_of(z) < limit, zero, z);
}

// A point is good when its range lies within the limits. NaN, infinity and 0 do not, and no coordinate is longer than
// the range. Only vectors with a point that is not good compute reasons.
template <class A>
void project_points(const SensorModel& sensor, const ScanTable& scan, PointTable& points, LayerSums& sums) noexcept {
  OVT_CHECK(scan.count <= points.capacity);
  const int32_t count = points.count = scan.count;
  sums.touched_count = 0;
  const Projector<A> to(sensor);
  const float *x_m = scan.x_m, *y_m = scan.y_m, *z_m = scan.z_m;
  const int32_t* layers = scan.layer;
  float *range_m = points.range_m, *elevation_rad = points.elevation_rad;
  int32_t* columns = points.column;
  uint8_t* reasons = points.reason;

  for (int32_t begin = 0; begin < count; begin += kProjectVectors * kSize<A>) {
    const int32_t end = begin + kProjectVectors * kSize<A> < count ? begin + kProjectVectors * kSize<A> : count;
    for (int32_t i = begin; i < end; i += 2 * kSize<A>) {
      // Two vectors, with both of their arctangents, side by side: each is one long chain of dependent operations. The
      // last vector may be its own neighbour.
      const int32_t at[2] = {i, i + kSize<A> < end ? i + kSize<A> : i};
      Float<A> x[2], y[2], z[2], level[2], distance[2];
#pragma GCC unroll 2
      for (int32_t v = 0; v < 2; ++v) {
        x[v] = Float<A>::load(x_m + at[v]), y[v] = Float<A>::load(y_m + at[v]), z[v] = Float<A>::load(z_m + at[v]);
        clear_tiny(x[v], y[v], z[v]);
        level[v] = x[v] * x[v] + y[v] * y[v];
        distance[v] = sqrt_of(level[v]);
      }
      using Angles = Pair<FloatPair<A>, typename FloatPair<A>::Masks>;
      const Float<A> least(Projector<A>::kNearest_m);
      const auto longer = [&](int32_t v) OVT_INLINED { return max_of(max_of(abs_of(x[v]), abs_of(y[v])), least); };
      const auto farther = [&](int32_t v) OVT_INLINED { return max_of(distance[v], abs_of(z[v])); };
      const Angles angle = angle_in_quarter(Angles({abs_of(z[0]), abs_of(z[1])}, {abs_of(y[0]), abs_of(y[1])}),
                                            Angles({distance[0], distance[1]}, {abs_of(x[0]), abs_of(x[1])}),
                                            Angles({farther(0), farther(1)}, {longer(0), longer(1)}));
      const Float<A> zero(0.0f);
#pragma GCC unroll 2
      for (int32_t v = 0; v < 2; ++v) {
        const Float<A> up = v == 0 ? angle.a.a : angle.a.b;
        Float<A> range = sqrt_of(level[v] + z[v] * z[v]);
        Float<A> elevation = select(z[v] < zero, zero - up, up);
        Int<A> column = to.column_of(turn_all_round(v == 0 ? angle.b.a : angle.b.b, y[v], x[v]));
        const Int<A> layer = Int<A>::load(layers + at[v]);
        const Mask<A> in_range = (range >= to.nearest_at_all) & (range <= to.farthest);
        const Mask<A> good = in_range & to.layer_fits(layer) & (column > Int<A>(-1));
        Int<A> reason{int32_t(Reason::kLabelled)};
        if ((~good).any()) {
          const Float<A> x_in = Float<A>::load(x_m + at[v]), y_in = Float<A>::load(y_m + at[v]);
          reason = to.reason_of(x_in, y_in, Float<A>::load(z_m + at[v]), range, layer, column);
          range = keep(good, range);
          elevation = keep(good, elevation);
          column = select(good, column, Int<A>(-1));
        }
        range.store(range_m + at[v]);
        elevation.store(elevation_rad + at[v]);
        column.store(columns + at[v]);
        store_bytes(reason, reasons + at[v]);
      }
    }
    sum_layers<A>(scan, points, begin, end, sums);
  }
}

}  // namespace overtake::simd
