// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// Section 5b: a car of which one row is seen. Words of 64 columns: few ground pixels are doubtful, and each of these is
// tried as in the reference.
#pragma once

#include "core/math.h"
#include "kernels/mark_islands.h"
#include "kernels/simd.h"

namespace overtake::simd {

template <class A>
void mark_islands(bool wraps, float pitch_rad, Plane<const float> range_filled_m, Plane<const float> height_m,
                  BitPlane nonground) noexcept {
  const Float<A> from(IslandLimits::kFrom_m), low(IslandLimits::kLow_m);
  const int32_t cols = range_filled_m.cols;
  for (int32_t r = 0; r < range_filled_m.rows; ++r) {
    const float *range_m = range_filled_m.row(r), *above_m = height_m.row(r);
    int32_t next = 0;  // the first column that is not done
    for (int32_t w = 0; w < nonground.words_per_row; ++w) {
      const int32_t first = 64 * w, here = cols - first < 64 ? cols - first : 64;
      uint64_t doubtful = 0;
      for (int32_t shift = 0; shift < here; shift += kSize<A>) {
        const Mask<A> is = (Float<A>::load(range_m + first + shift) >= from) &
                           (Float<A>::load(above_m + first + shift) >= low) & Mask<A>::first(here - shift);
        doubtful |= uint64_t(is.bits()) << shift;
      }
      for (doubtful &= ~nonground.row(r)[w]; doubtful != 0; doubtful &= doubtful - 1) {
        const int32_t c = first + lowest_bit(doubtful);
        if (c < next || nonground.test(r, c)) continue;
        next = c + 1 + ref::mark_island_of(wraps, pitch_rad, range_filled_m, r, c, nonground);
      }
    }
  }
}

}  // namespace overtake::simd
