// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// Merging across sensors: a point of one column against as many of the other as there are lanes.
#pragma once

#include "kernels/merge_seams.h"
#include "kernels/simd.h"

namespace overtake::simd {

template <class A>
int32_t find_near(const float* const column[3], int32_t begin, int32_t end, const float place[3], float limit) {
  const float *const column_x = column[0], *const column_y = column[1], *const column_z = column[2];
  const Float<A> x(place[0]), y(place[1]), z(place[2]), near_limit(limit);
  for (int32_t i = begin & ~(kSize<A> - 1); i < end; i += kSize<A>) {  // whole vectors: nothing beyond is read
    const Float<A> dx = x - Float<A>::load(column_x + i), dy = y - Float<A>::load(column_y + i),
                   dz = z - Float<A>::load(column_z + i);
    const Mask<A> asked = Mask<A>::first(end - i) & ~Mask<A>::first(begin - i);
    const Mask<A> is_near = ((dx * dx + dy * dy) + dz * dz < near_limit) & asked;
    if (const uint32_t bits = is_near.bits()) return i + lowest_bit(bits);
  }
  return end;
}

template <class A>
int32_t merge_seams(const MergeSeamsParams& params, const SeamSide* sides, int32_t sensor_count, MemberTable& members,
                    MergedTable& merged, SeamScratch& scratch) noexcept {
  return merge_seams_by(&find_near<A>, params, sides, sensor_count, members, merged, scratch);
}

}  // namespace overtake::simd
