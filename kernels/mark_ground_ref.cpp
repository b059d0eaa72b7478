// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// Section 5: ground removal.
#include "kernels/mark_ground.h"

#include "core/check.h"

namespace overtake::ref {

void mark_ground(const MarkGroundParams& params, int32_t row_count, Plane<const float> angle_smooth_rad,
                 Plane<const float> range_filled_m, Plane<const int32_t> pixel_point, BitPlane nonground,
                 ColumnSpan columns) noexcept {
  OVT_CHECK(row_count >= 0 && row_count <= nonground.rows + 1);
  const ColumnSpan own = columns.within(nonground.cols);
  for (int32_t w = own.first_word(); w < own.end_word(); ++w) {
    const int32_t begin = 64 * w, end = begin + 64 < nonground.cols ? begin + 64 : nonground.cols;
    uint64_t below = 0;  // columns with a return in a lower row
    for (int32_t r = nonground.rows - 1; r >= 0; --r) {
      uint64_t word = 0, returns = 0;
      for (int32_t c = begin; c < end; ++c) {
        const uint64_t bit = uint64_t(1) << (c - begin);
        const float angle = angle_smooth_rad.row(r)[c];
        const bool has_return = pixel_point.row(r)[c] != kNoPoint;
        const bool steep = angle > params.threshold_rad;
        // Under a far car the next row is often empty, and "there is no chance of regaining a false negative" (paper).
        const bool unknown = angle == kAngleUndefined && has_return && (below & bit);
        if (range_filled_m.row(r)[c] > 0.0f && (steep || unknown)) word |= bit;
        if (has_return) returns |= bit;
      }
      nonground.row(r)[w] = r < row_count - 1 ? word : 0;  // the last row has no pair below
      below |= returns;
    }
  }
}

}  // namespace overtake::ref
