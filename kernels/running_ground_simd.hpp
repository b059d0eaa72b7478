// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// Section 5b: ground removal by a running ground height, 64 columns at a time: the walks of several vectors overlap,
// because each walk is a chain of dependent operations.
#pragma once

#include "kernels/running_ground.h"
#include "kernels/running_ground_pixel.h"
#include "kernels/simd.h"

namespace overtake::simd {

// The pieces of a block's two rays.
template <class A>
struct RoadPieces {
  const float *offset_m, *slope;
  Float<A> weight;  // of the right ray, for each column

  OVT_INLINE Float<A> mix(Float<A> left, Float<A> right) const { return left + weight * (right - left); }
  OVT_INLINE static Float<A> lookup(const float* table, Int<A> piece) {
    if constexpr (kSize<A> == kNodes) {
      return float_of_bits(permute(bits_of(Float<A>::load(table)), piece));
    } else if constexpr (kSize<A> * 2 == kNodes) {
      const Int<A> low = bits_of(Float<A>::load(table)), high = bits_of(Float<A>::load(table + kSize<A>));
      return float_of_bits(permute(low, high, piece));
    } else {
      return gather(table, piece);
    }
  }
  OVT_INLINE Float<A> road_z(Float<A> distance) const {
    const Float<A> scaled = sqrt_of(distance * Float<A>(1.0f / kNodeScale_m));
    const Int<A> piece = to_int(min_of(scaled, Float<A>(float(kNodes - 1))));
    return mix(lookup(offset_m, piece), lookup(offset_m + kNodes, piece)) +
           mix(lookup(slope, piece), lookup(slope + kNodes, piece)) * distance;
  }
};

template <class A>
void running_ground(const RunningGroundParams& params, const RoadSurface& road, Plane<const float> range_filled_m,
                    Plane<const float> elevation_filled_rad, Plane<float> height_m, BitPlane nonground,
                    BitPlane steep) noexcept {
  constexpr int32_t kVectors = 64 / kSize<A>;
  static_assert(kRayColumns % kSize<A> == 0);
  const Float<A> zero(0.0f), half(0.5f), step(1.0f / kRayColumns);
  const int32_t rows = range_filled_m.rows, cols = range_filled_m.cols;
  for (int32_t w = 0; w < nonground.words_per_row; ++w) {
    const int32_t begin = 64 * w, end = begin + 64 < cols ? begin + 64 : cols;
    const uint64_t inside = end - begin < 64 ? (uint64_t(1) << (end - begin)) - 1 : ~uint64_t(0);
    const int32_t vectors = (end - begin + kSize<A> - 1) / kSize<A>;
    GroundBlock block[kVectors];
    RoadPieces<A> pieces[kVectors];
    GroundState<Float<A>> state[kVectors];
    Float<A> level[kVectors];
    Mask<A> below[kVectors];
    for (int32_t v = 0; v < vectors; ++v) {
      const int32_t c = begin + v * kSize<A>, ray = c / kRayColumns;
      block[v] = make_ground_block(params, road.known[ray] + road.known[ray + 1] == 2.0f);
      pieces[v] = {road.offset_m + ray * kNodes, road.slope + ray * kNodes,
                   (to_float(Int<A>::count_from(c % kRayColumns)) + half) * step};
      level[v] = pieces[v].mix(Float<A>(road.level_slope[ray]), Float<A>(road.level_slope[ray + 1])) +
                 Float<A>(params.level_slope_slack);
      state[v] = start_ground(pieces[v].road_z(zero));
      below[v] = Mask<A>(false);
    }
    for (int32_t r = rows - 1; r >= 0; --r) {
      uint64_t obstacles = 0, pairs = 0;
      for (int32_t v = 0; v < vectors; ++v) {
        const int32_t c = begin + v * kSize<A>;
        const Float<A> range = Float<A>::load(range_filled_m.row(r) + c);
        const Mask<A> exists = range > zero;
        Float<A> sine, cosine;
        sin_cos_small_of(Float<A>::load(elevation_filled_rad.row(r) + c), sine, cosine);
        const Float<A> distance = range * cosine;
        const auto pixel = walk_ground(block[v], distance, range * sine, pieces[v].road_z(distance), level[v], exists,
                                       below[v], state[v]);
        keep(exists, pixel.height).store(height_m.row(r) + c);
        obstacles |= uint64_t((exists & ~pixel.ground).bits()) << (c - begin);
        pairs |= uint64_t(pixel.steep.bits()) << (c - begin);
        below[v] = exists;
      }
      nonground.row(r)[w] = obstacles & inside;
      steep.row(r)[w] = pairs & inside;
    }
    for (int32_t r = 0; r + 1 < rows; ++r) nonground.row(r + 1)[w] |= nonground.row(r)[w] & steep.row(r)[w];
  }
}

}  // namespace overtake::simd
