// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// Section 1: assigns points to pixels, in three steps.
//
//   1  block by block: computes the pixels of kSize points at a time; then every point claims its pixel, so that the
//      last point holds it
//   2  compares each point that does not hold its pixel (a few percent) with the point that does
//   3  copies range and elevation of the winners, in tiles of kSize columns and all rows: the points of a tile lie near
//      each other in memory, whether they came ring by ring or column by column
//
// The winner of two points follows a total order (intensity, range, input order), so the order of comparisons does not
// matter. A point without a pixel claims the lead of row 0 (plane.h).
#pragma once

#include "core/math.h"
#include "kernels/near_rows.h"
#include "kernels/scatter_points.h"
#include "kernels/simd.h"

namespace overtake::simd {

// Compares a point that does not hold its pixel with the one that does: the brightest point is the least likely dust.
// Ties: the nearest, then the first in input order.
OVT_INLINE void challenge_winner(const float* intensity, const float* range_m, int32_t i, int32_t* winner,
                                 uint8_t* lost) {
  const int32_t other = *winner;
  const float light = intensity[i], other_light = intensity[other], near = range_m[i], other_near = range_m[other];
  const bool first = (near < other_near) | ((near == other_near) & (i < other));
  const bool wins = (light > other_light) | ((light == other_light) & first);
  *winner = wins ? i : other;
  lost[wins ? other : i] = 1;
}

template <class A>
void scatter_points(const ScanTable& scan, const int32_t* row_of_layer, PointTable& points,
                    RangeImages& images) noexcept {
  const Plane<int32_t> winner = images.pixel_point;
  for (int32_t r = 0; r < winner.rows; ++r)
    for (int32_t c = 0; c < winner.cols; c += kSize<A>) Int<A>(kNoPoint).store(winner.row(r) + c);

  const int32_t count = points.count, *layers = scan.layer, *columns = points.column;
  const float *intensity = scan.intensity, *range_m = points.range_m, *elevation_rad = points.elevation_rad;
  int32_t *pixels = points.pixel, *winners = winner.data;
  uint8_t *reasons = points.reason, *lost = points.lost;
  winners[-1] = kNoPoint;
  const Int<A> none(-1), stride(winner.stride);
  Int<A> layer_a(kNoLayer), layer_b(kNoLayer), row_a(-1), row_b(-1);
  // First the pixels of a block, then its claims: pending scattered stores delay wide loads with the same low address
  // bits.
  constexpr int32_t kBlock = 512;
  for (int32_t i = 0, claimed = 0; i < count; i += kSize<A>) {
    const Int<A> column = Int<A>::load(columns + i);
    const Mask<A> valid = (column > none) & Mask<A>::first(count - i);
    const Int<A> layer = select(valid, Int<A>::load(layers + i), Int<A>(0));
    // Most vectors hold the layers of one ring, or of the interleaved rings of two heads.
    if ((valid & ~((layer == layer_a) | (layer == layer_b))).any()) {
      const int32_t last = count - i < kSize<A> ? count - 1 : i + kSize<A> - 1, before = last > 0 ? last - 1 : last;
      layer_a = Int<A>(layers[last]), layer_b = Int<A>(layers[before]);
      row_a = Int<A>(layers[last] < 0 ? -1 : row_of_layer[layers[last]]);
      row_b = Int<A>(layers[before] < 0 ? -1 : row_of_layer[layers[before]]);
    }
    Int<A> row = select(layer == layer_a, row_a, row_b);
    if ((valid & ~((layer == layer_a) | (layer == layer_b))).any()) row = gather(row_of_layer, layer);
    row = select(valid, row, none);
    const Mask<A> dropped = valid & (row < Int<A>(0));
    if (dropped.any())
      store_bytes(select(dropped, Int<A>(int32_t(Reason::kLayerDropped)), load_bytes<A>(reasons + i)), reasons + i);
    const Int<A> pixel = select(row < Int<A>(0), none, row * stride + column);
    pixel.store(pixels + i);
    store_bytes(Int<A>(0), lost + i);

    const int32_t end = i + kSize<A> < count ? i + kSize<A> : count;
    if (end % kBlock != 0 && end != count) continue;
    for (; claimed < end; ++claimed) winners[pixels[claimed]] = claimed;
  }

  // A few vectors at a time: most groups of four contain a point that lost its pixel.
  for (int32_t i = 0; i < count; i += 4 * kSize<A>) {
    uint64_t late = 0;
    for (int32_t k = 0; k < 4 * kSize<A> && i + k < count; k += kSize<A>) {
      const Int<A> pixel = Int<A>::load(pixels + i + k);
      const Mask<A> held = gather(winners, pixel) == Int<A>::count_from(i + k);
      late |= uint64_t(((pixel > none) & ~held & Mask<A>::first(count - i - k)).bits()) << k;
    }
    for (; late != 0; late &= late - 1) {
      const int32_t l = i + lowest_bit(late);
      challenge_winner(intensity, range_m, l, winners + pixels[l], lost);
    }
  }

  const Float<A> no_return(kNoReturn), level(0.0f);
  for (int32_t c = 0; c < winner.cols; c += kSize<A>)
    for (int32_t r = 0; r < winner.rows; ++r) {
      const Int<A> point = Int<A>::load(winner.row(r) + c);
      const Mask<A> has = (point > none) & Mask<A>::first(winner.cols - c);
      Float<A> range = no_return, elevation = level;
      if (has.any()) {
        const NearRows<A> rows(winner.row(r) + c, has, points.capacity);
        range = select(has, rows.get(range_m), no_return);
        elevation = select(has, rows.get(elevation_rad), level);
      }
      range.store(images.range_m.row(r) + c);
      elevation.store(images.elevation_rad.row(r) + c);
    }
}

}  // namespace overtake::simd
