// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// Section 6: repair of the non-ground range image, NGRIR (eq. 3).
//
//   . # x # .     x = a pixel that is not non-ground, repaired by the pair (j-1, j+1)
//   # . x . #     or by the pair (j-2, j+2), if the two ranges agree
#include "kernels/repair_range.h"

#include <algorithm>
#include <cmath>

#include "core/check.h"

namespace overtake::ref {
namespace {

bool row_is_empty(ConstBitPlane bits, int32_t r) {
  uint64_t any = 0;
  for (int32_t w = 0; w < bits.words_per_row; ++w) any |= bits.row(r)[w];
  return any == 0;
}

}  // namespace

void repair_range(const RepairRangeParams& params, Plane<const float> range_filled_m,
                  Plane<const float> elevation_filled_rad, ConstBitPlane nonground, Plane<float> range_repaired_m,
                  Plane<float> elevation_repaired_rad, BitPlane nonground_repaired, ColumnSpan columns) noexcept {
  OVT_CHECK(params.half_window >= 0 && params.half_window <= kMaxRepairHalfWindow);
  const int32_t cols = nonground.cols;
  const ColumnSpan own = columns.within(cols);
  // On a narrow image that wraps, the two sides of the window must not meet: the pixels of a pair are always different.
  const int32_t half = params.wraps ? std::min(params.half_window, (cols - 1) / 2) : params.half_window;

  for (int32_t r = 0; r < nonground.rows; ++r) {
    const float *range_m = range_filled_m.row(r), *elevation_rad = elevation_filled_rad.row(r);
    float *range_out_m = range_repaired_m.row(r), *elevation_out_rad = elevation_repaired_rad.row(r);
    for (int32_t w = own.first_word(); w < own.end_word(); ++w) nonground_repaired.row(r)[w] = 0;
    if (row_is_empty(nonground, r)) {
      std::fill(range_out_m + own.first, range_out_m + own.last, 0.0f);
      std::fill(elevation_out_rad + own.first, elevation_out_rad + own.last, 0.0f);
      continue;
    }

    for (int32_t c = own.first; c < own.last; ++c) {
      if (nonground.test(r, c)) {
        range_out_m[c] = range_m[c];
        elevation_out_rad[c] = elevation_rad[c];
        nonground_repaired.set(r, c);
        continue;
      }
      float range_sum = 0.0f, elevation_sum = 0.0f, pixels = 0.0f;
      for (int32_t k = 1; k <= half; ++k) {
        int32_t left = c - k, right = c + k;
        if (params.wraps) {
          left = left < 0 ? left + cols : left;
          right = right >= cols ? right - cols : right;
        }
        if (left < 0 || right >= cols || !nonground.test(r, left) || !nonground.test(r, right)) continue;
        if (!(std::fabs(range_m[left] - range_m[right]) < params.range_limit_m)) continue;
        range_sum += range_m[left] + range_m[right];
        elevation_sum += elevation_rad[left] + elevation_rad[right];
        pixels += 2.0f;
      }
      const bool repaired = pixels > 0.0f;
      range_out_m[c] = repaired ? range_sum / pixels : 0.0f;
      elevation_out_rad[c] = repaired ? elevation_sum / pixels : 0.0f;
      if (repaired) nonground_repaired.set(r, c);
    }
  }
}

}  // namespace overtake::ref
