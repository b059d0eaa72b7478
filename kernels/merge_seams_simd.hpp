// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// Merging across sensors: compares one point of a column with kSize points of the other.
#pragma once

#include "kernels/merge_seams.h"
#include "kernels/simd.h"

namespace overtake::simd {

template <class A>
uint32_t near_bits(const float* const column[3], int32_t begin, const float place[3], float limit) {
  const Float<A> x(place[0]), y(place[1]), z(place[2]), near_limit(limit);
  uint32_t bits = 0;
  for (int32_t k = 0; k < kRowAlign; k += kSize<A>) {
    const Float<A> dx = x - Float<A>::load(column[0] + begin + k), dy = y - Float<A>::load(column[1] + begin + k),
                   dz = z - Float<A>::load(column[2] + begin + k);
    bits |= uint32_t(((dx * dx + dy * dy) + dz * dz < near_limit).bits()) << k;
  }
  return bits;
}

template <class A>
int32_t merge_seams(const MergeSeamsParams& params, const SeamSide* sides, int32_t sensor_count, MemberTable& members,
                    FrameClusterTable& merged, SeamScratch& scratch) noexcept {
  return merge_seams_by(&near_bits<A>, params, sides, sensor_count, members, merged, scratch);
}

}  // namespace overtake::simd
