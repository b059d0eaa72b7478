// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// Section 1: assigns points to pixels, block by block. Computes the pixels of kSize points at a time. Then each point
// of the block claims its pixel, writes its range and elevation there, and lists the point that it displaces (a few in
// a hundred), and at last these are compared with the points that hold their pixels.
//
// The winner of two points follows a total order (intensity, range, input order), so the order of comparisons does not
// matter. A point without a pixel claims the lead of row 0 (plane.h).
#pragma once

#include "core/math.h"
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

// Rows of layers. Most vectors hold the layers of one ring, or of the interleaved rings of two heads: those of the last
// two points of the vector before that had others.
template <class A>
struct RowFinder {
  const int32_t *layers, *row_of_layer;
  int32_t count;
  Int<A> layer_a{kNoLayer}, layer_b{kNoLayer}, row_a{-1}, row_b{-1};

  OVT_INLINE int32_t row_of(int32_t layer) const { return layer < 0 ? -1 : row_of_layer[layer]; }
  OVT_INLINE Int<A> find(int32_t i, Mask<A> valid) {
    const Int<A> layer = select(valid, Int<A>::load(layers + i), Int<A>(0));
    if ((valid & ~((layer == layer_a) | (layer == layer_b))).any()) {
      const int32_t last = count - i < kSize<A> ? count - 1 : i + kSize<A> - 1, before = last > 0 ? last - 1 : last;
      layer_a = Int<A>(layers[last]), layer_b = Int<A>(layers[before]);
      row_a = Int<A>(row_of(layers[last])), row_b = Int<A>(row_of(layers[before]));
    }
    if ((valid & ~((layer == layer_a) | (layer == layer_b))).any()) return gather(row_of_layer, layer);
    return select(layer == layer_a, row_a, row_b);
  }
};

template <class A>
void scatter_points(const ScanTable& scan, const int32_t* row_of_layer, PointTable& points,
                    RangeImages& images) noexcept {
  const Plane<int32_t> winner = images.pixel_point;
  for (int32_t r = 0; r < winner.rows; ++r)
    for (int32_t c = 0; c < winner.cols; c += kSize<A>) {
      Int<A>(kNoPoint).store(winner.row(r) + c);
      Float<A>(kNoReturn).store(images.range_m.row(r) + c);
      Float<A>(0.0f).store(images.elevation_rad.row(r) + c);
    }

  const int32_t count = points.count, *columns = points.column;
  const float *intensity = scan.intensity, *range_m = points.range_m, *elevation_rad = points.elevation_rad;
  static_assert(kLabelGround == 0 && kLabelNone == -1);
  int32_t *pixels = points.pixel, *labels = points.label, *winners = winner.data;
  float *winner_range_m = images.range_m.data, *winner_elevation_rad = images.elevation_rad.data;
  uint8_t *reasons = points.reason, *lost = points.lost;
  const Int<A> none(-1), stride(winner.stride);
  RowFinder<A> rows{scan.layer, row_of_layer, count};
  constexpr int32_t kBlock = 512;
  for (int32_t begin = 0; begin < count; begin += kBlock) {
    const int32_t end = begin + kBlock < count ? begin + kBlock : count;
    // All pixels of a block before its claims: pending scattered stores delay wide loads with the same low address
    // bits.
    for (int32_t i = begin; i < end; i += kSize<A>) {
      const Int<A> column = Int<A>::load(columns + i);
      const Mask<A> valid = (column > none) & Mask<A>::first(count - i);
      const Int<A> row = select(valid, rows.find(i, valid), none);
      const Mask<A> dropped = valid & (row < Int<A>(0));
      if (dropped.any())
        store_bytes(select(dropped, Int<A>(int32_t(Reason::kLayerDropped)), load_bytes<A>(reasons + i)), reasons + i);
      const Int<A> pixel = select(row < Int<A>(0), none, row * stride + column);
      pixel.store(pixels + i);
      (pixel >> 31).store(labels + i);  // of a point without a pixel: all bits
      store_bytes(Int<A>(0), lost + i);
    }

    int32_t displaced[kBlock], found = 0;
    for (int32_t i = begin; i < end; ++i) {
      const int32_t pixel = pixels[i], other = winners[pixel];
      winners[pixel] = i;
      winner_range_m[pixel] = range_m[i], winner_elevation_rad[pixel] = elevation_rad[i];
      displaced[found] = other;
      found += 1 + ((other | pixel) >> 31);  // by one if both are there
    }
    for (int32_t k = 0; k < found; ++k) {
      const int32_t pixel = pixels[displaced[k]];
      challenge_winner(intensity, range_m, displaced[k], winners + pixel, lost);
      const int32_t i = winners[pixel];
      winner_range_m[pixel] = range_m[i], winner_elevation_rad[pixel] = elevation_rad[i];
    }
  }
}

}  // namespace overtake::simd
