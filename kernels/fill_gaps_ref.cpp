// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// Section 2: fills gaps of the range image.
#include "kernels/fill_gaps.h"

#include <algorithm>
#include <cmath>

namespace overtake::ref {

void fill_gaps(const FillGapsParams& params, Plane<const float> range_m, Plane<const float> elevation_rad,
               Plane<float> range_filled_m, Plane<float> elevation_filled_rad, ColumnSpan columns) noexcept {
  const ColumnSpan own_columns = columns.within(range_m.cols);
  for (int32_t r = 0; r < range_m.rows; ++r) {
    // The top and the bottom row have one neighbour only, so they are copied: they read themselves as the missing
    // neighbour, and a gap has no return.
    const int32_t above = std::max(r - 1, 0), below = std::min(r + 1, range_m.rows - 1);
    for (int32_t c = own_columns.first; c < own_columns.last; ++c) {
      const float own = range_m.row(r)[c], up = range_m.row(above)[c], down = range_m.row(below)[c];
      // Without the limit, a gap between a car and the wall behind it would become a phantom.
      const float limit_m = std::max(params.limit_m, params.limit_share * std::min(up, down));
      const bool fill = own == kNoReturn && up > 0.0f && down > 0.0f && std::fabs(up - down) < limit_m;
      const float mean_e = (elevation_rad.row(above)[c] + elevation_rad.row(below)[c]) * 0.5f;
      range_filled_m.row(r)[c] = fill ? (up + down) * 0.5f : own;
      elevation_filled_rad.row(r)[c] = fill ? mean_e : elevation_rad.row(r)[c];
    }
  }
}

}  // namespace overtake::ref
