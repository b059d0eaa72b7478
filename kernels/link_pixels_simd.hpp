// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// Section 7: links neighbouring pixels of one object (eq. 2), on words of 64 columns. Reads ranges only where both
// pixels of a link are non-ground.
#pragma once

#include "core/math.h"
#include "kernels/link_pixels.h"
#include "kernels/simd.h"

namespace overtake::simd {

template <class A>
void link_pixels(const LinkPixelsParams& params, Plane<const float> range_repaired_m,
                 Plane<const float> elevation_repaired_rad, ConstBitPlane nonground_repaired, BitPlane link_right,
                 BitPlane link_down, ColumnSpan columns) noexcept {
  const int32_t rows = range_repaired_m.rows, cols = range_repaired_m.cols;
  const int32_t words_per_row = nonground_repaired.words_per_row;
  const ColumnSpan own_columns = columns.within(cols);
  const Float<A> tan_threshold(params.tan_threshold), sin_pitch(params.sin_pitch), cos_pitch(params.cos_pitch);
  const Float<A> upright(kHalfPiF);
  constexpr uint64_t kGroup = (uint64_t(1) << kSize<A>)-1;

  for (int32_t r = 0; r < rows; ++r) {
    const bool has_below = r + 1 < rows;
    const int32_t r_below = has_below ? r + 1 : r;
    const float *range_m = range_repaired_m.row(r), *below_m = range_repaired_m.row(r_below);
    const float *elevation_rad = elevation_repaired_rad.row(r), *e_below_rad = elevation_repaired_rad.row(r_below);
    const uint64_t *words = nonground_repaired.row(r), *words_below = nonground_repaired.row(r_below);
    uint64_t *right_out = link_right.row(r), *down_out = link_down.row(r);

    for (int32_t w = own_columns.first_word(); w < own_columns.end_word(); ++w) {
      const uint64_t own = words[w], next = w + 1 < words_per_row ? words[w + 1] << 63 : 0;
      const uint64_t right = own & ((own >> 1) | next);
      const uint64_t down = has_below ? own & words_below[w] : 0;
      uint64_t right_word = 0, down_word = 0;
      if ((right | down) != 0) {
        for (int32_t shift = 0; shift < 64; shift += kSize<A>) {
          if ((((right | down) >> shift) & kGroup) == 0) continue;
          const int32_t c = 64 * w + shift;
          const Float<A> own_m = Float<A>::load(range_m + c);
          const Mask<A> joins_right =
              pixels_join(own_m, Float<A>::load(range_m + c + 1), sin_pitch, cos_pitch, tan_threshold);
          right_word |= uint64_t(joins_right.bits()) << shift;
          if (((down >> shift) & kGroup) == 0) continue;
          const Float<A> alpha = abs_of(Float<A>::load(elevation_rad + c) - Float<A>::load(e_below_rad + c));
          Float<A> sin_alpha, cos_alpha;
          sin_cos_small_of(min_of(alpha, upright), sin_alpha, cos_alpha);
          const Mask<A> joins_down =
              pixels_join(own_m, Float<A>::load(below_m + c), sin_alpha, cos_alpha, tan_threshold);
          down_word |= uint64_t(joins_down.bits()) << shift;
        }
      }
      right_out[w] = right_word & right;
      down_out[w] = down_word & down;
    }

    if (own_columns.last == cols && params.wraps && cols > 1 && nonground_repaired.test(r, cols - 1) &&
        nonground_repaired.test(r, 0) &&
        pixels_join(range_m[cols - 1], range_m[0], params.sin_pitch, params.cos_pitch, params.tan_threshold))
      link_right.set(r, cols - 1);
  }
}

}  // namespace overtake::simd
