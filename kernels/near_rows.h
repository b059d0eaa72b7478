// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// Gathers from rows that lie near each other.
#pragma once

#include "kernels/simd.h"

namespace overtake::simd {

// Rows of a table that mostly lie near each other, because they came from the sensor one after the other. So a gather
// reads whole vectors of the columns and picks the rows from these. Works for the lanes of `in`, at least one; the
// other lanes are unspecified. `at` is the place of the rows in memory.
template <class A>
struct NearRows {
  static constexpr int32_t kWindow = 4 * kSize<A>;
  Int<A> row, offset;
  int32_t begin = 0;
  bool near = false;

  OVT_INLINE NearRows(const int32_t* at, Mask<A> in, int32_t capacity) {
    row = select(in, Int<A>::load(at), Int<A>(0));
    if constexpr (kPermutes<A>) {
      const uint32_t bits = in.bits();
      const int32_t first = at[lowest_bit(bits)], last = at[highest_bit(bits)];
      // The rows may rise or fall. Reading a window of whole cache lines is faster than placing a small one exactly.
      begin = (first + (last - first) / 2 - (kWindow - kSize<A>) / 2) & ~(kSize<A> - 1);
      const int32_t latest = (capacity & ~(kSize<A> - 1)) - kWindow;
      begin = begin < latest ? begin : latest;
      begin = begin > 0 ? begin : 0;
      offset = row - Int<A>(begin);
      near = capacity >= kWindow && !(in & ~((offset & Int<A>(~(kWindow - 1))) == Int<A>(0))).any();
    }
  }
  OVT_INLINE Int<A> get(const int32_t* column) const {
    if constexpr (kPermutes<A>)
      if (near) {
        const int32_t* v = column + begin;
        return permute(Int<A>::load(v), Int<A>::load(v + kSize<A>), Int<A>::load(v + 2 * kSize<A>),
                       Int<A>::load(v + 3 * kSize<A>), offset);
      }
    return gather(column, row);
  }
  OVT_INLINE Float<A> get(const float* column) const {
    if constexpr (kPermutes<A>)
      if (near) {
        const float* v = column + begin;
        return float_of_bits(permute(bits_of(Float<A>::load(v)), bits_of(Float<A>::load(v + kSize<A>)),
                                     bits_of(Float<A>::load(v + 2 * kSize<A>)),
                                     bits_of(Float<A>::load(v + 3 * kSize<A>)), offset));
      }
    return gather(column, row);
  }
};

}  // namespace overtake::simd
