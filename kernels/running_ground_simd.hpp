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
  OVT_INLINE RoadPlace<Float<A>> road_z(Float<A> distance) const {
    const Float<A> scaled = sqrt_of(distance * Float<A>(1.0f / kNodeScale_m));
    const Int<A> piece = to_int(min_of(scaled, Float<A>(float(kNodes - 1))));
    const Float<A> offset = mix(lookup(offset_m, piece), lookup(offset_m + kNodes, piece));
    return {offset + mix(lookup(slope, piece), lookup(slope + kNodes, piece)) * distance, offset};
  }
};

// The walks of kVectors vectors of columns from `begin` on. Writes their bits.
template <class A, int32_t kVectors>
OVT_INLINE void walk_columns(const RunningGroundParams& params, const RoadSurface& road,
                             Plane<const float> range_filled_m, Plane<const float> elevation_filled_rad, int32_t begin,
                             uint64_t inside, Plane<float> height_m, BitPlane nonground, BitPlane steep) {
  const Float<A> zero(0.0f), half(0.5f), step(1.0f / kRayColumns);
  const GroundBlock block = make_ground_block(params);
  RoadPieces<A> pieces[kVectors];
  GroundState<Float<A>> state[kVectors];
  Float<A> level[kVectors], known_m[kVectors];
  for (int32_t v = 0; v < kVectors; ++v) {
    const int32_t c = begin + v * kSize<A>, ray = c / kRayColumns;
    known_m[v] = Float<A>(min_of(road.known_m[ray], road.known_m[ray + 1]));
    pieces[v] = {road.offset_m + ray * kNodes, road.slope + ray * kNodes,
                 (to_float(Int<A>::count_from(c % kRayColumns)) + half) * step};
    level[v] = pieces[v].mix(Float<A>(road.level_slope[ray]), Float<A>(road.level_slope[ray + 1])) +
               Float<A>(params.level_slope_slack);
    state[v] = start_ground(pieces[v].road_z(zero).z);
  }
  const int32_t word = begin / 64, shift = begin % 64;
  // First what does not depend on the running ground, a few rows at once: only the walk itself waits for the row below.
  constexpr int32_t kRowsTogether = 8;
  struct Place {
    Float<A> distance, z, road_z, offset;
    Mask<A> exists;
    bool any;
  };
  Place places[kRowsTogether][kVectors];
  for (int32_t bottom = range_filled_m.rows - 1; bottom >= 0; bottom -= kRowsTogether) {
    const int32_t rows = bottom + 1 < kRowsTogether ? bottom + 1 : kRowsTogether;
    for (int32_t i = 0; i < rows; ++i)
#pragma GCC unroll 8
      for (int32_t v = 0; v < kVectors; ++v) {
        const int32_t c = begin + v * kSize<A>;
        Place& place = places[i][v];
        const Float<A> range = Float<A>::load(range_filled_m.row(bottom - i) + c);
        place.exists = range > zero;
        place.any = place.exists.any();
        if (!place.any) continue;  // most of the sky
        Float<A> sine, cosine;
        sin_cos_small_of(Float<A>::load(elevation_filled_rad.row(bottom - i) + c), sine, cosine);
        place.distance = range * cosine;
        place.z = range * sine;
        const RoadPlace<Float<A>> below = pieces[v].road_z(place.distance);
        place.road_z = below.z, place.offset = below.offset;
      }
    for (int32_t i = 0; i < rows; ++i) {
      const int32_t r = bottom - i;
      uint64_t obstacles = 0, pairs = 0;
#pragma GCC unroll 8
      for (int32_t v = 0; v < kVectors; ++v) {
        const int32_t c = begin + v * kSize<A>;
        const Place& place = places[i][v];
        if (!place.any) {
          zero.store(height_m.row(r) + c);
          state[v].below_above = Float<A>(kMissing_m);
          continue;
        }
        const auto pixel = walk_ground(block, place.distance, place.z, {place.road_z, place.offset}, level[v],
                                       known_m[v], place.exists, state[v]);
        pixel.height.store(height_m.row(r) + c);
        obstacles |= uint64_t((place.exists & ~pixel.ground).bits()) << (v * kSize<A>);
        pairs |= uint64_t(pixel.steep.bits()) << (v * kSize<A>);
      }
      const uint64_t keep_others = shift == 0 ? 0 : ~uint64_t(0) >> (64 - shift);
      nonground.row(r)[word] = (nonground.row(r)[word] & keep_others) | (obstacles & inside) << shift;
      steep.row(r)[word] = (steep.row(r)[word] & keep_others) | (pairs & inside) << shift;
    }
  }
}

template <class A>
void running_ground(const RunningGroundParams& params, const RoadSurface& road, Plane<const float> range_filled_m,
                    Plane<const float> elevation_filled_rad, Plane<float> height_m, BitPlane nonground, BitPlane steep,
                    ColumnSpan columns) noexcept {
  constexpr int32_t kVectors = 4;  // more walks at once need more registers than there are
  constexpr int32_t kTogether = kVectors * kSize<A>;
  static_assert(kTogether % kRayColumns == 0 && 64 % kTogether == 0);
  const int32_t rows = range_filled_m.rows;
  const ColumnSpan own = columns.within(range_filled_m.cols);
  for (int32_t begin = own.first; begin < own.last;) {
    const int32_t left = own.last - begin;
    const uint64_t inside = left < 64 ? (uint64_t(1) << left) - 1 : ~uint64_t(0);
    if (left > kTogether - kRayColumns) {
      walk_columns<A, kVectors>(params, road, range_filled_m, elevation_filled_rad, begin, inside, height_m, nonground,
                                steep);
      begin += kTogether;
    } else {
      walk_columns<A, kRayColumns / kSize<A>>(params, road, range_filled_m, elevation_filled_rad, begin, inside,
                                              height_m, nonground, steep);
      begin += kRayColumns;
    }
  }
  for (int32_t r = 0; r + 1 < rows; ++r)
    for (int32_t w = own.first_word(); w < own.end_word(); ++w)
      nonground.row(r + 1)[w] |= nonground.row(r)[w] & steep.row(r)[w];
}

}  // namespace overtake::simd
