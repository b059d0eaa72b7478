// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// Stage 5: ground removal.
#include "kernels/mark_ground.h"

#include "core/check.h"

namespace overtake::ref {

void mark_ground(const MarkGroundParams& params, int32_t row_count, Plane<const float> angle_smooth_rad,
                 Plane<const float> range_filled_m, Plane<const int32_t> pixel_point, BitPlane nonground) noexcept {
  OVT_CHECK(row_count >= 0 && row_count <= nonground.rows);
  for (int32_t r = 0; r < nonground.rows; ++r) {
    nonground.clear_row(r);
    if (r >= row_count - 1) continue;  // the bottom row, and rows without a layer in this scan
    for (int32_t c = 0; c < nonground.cols; ++c) {
      const float angle = angle_smooth_rad.row(r)[c];
      const bool steep = angle > params.threshold_rad;
      // Under a far car the next row is often empty, and "there is no chance of regaining a false negative".
      const bool unknown = angle == kAngleUndefined && pixel_point.row(r)[c] != kNoPoint;
      if (range_filled_m.row(r)[c] > 0.0f && (steep || unknown)) nonground.set(r, c);
    }
  }
}

}  // namespace overtake::ref
