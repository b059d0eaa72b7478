// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// Section 3: angle image (eq. 1).
//
// Works down stripes of kRowAlign columns and keeps the values of the row above, so that each pixel's sine and cosine
// are computed once.
#include "kernels/angle_image.h"

#include <algorithm>
#include <cmath>

#include "core/math.h"

namespace overtake::ref {

void angle_image(const AngleImageParams& params, Plane<const float> range_filled_m,
                 Plane<const float> elevation_filled_rad, Plane<float> angle_rad, ColumnSpan columns) noexcept {
  const int32_t rows = range_filled_m.rows;
  const ColumnSpan own_columns = columns.within(range_filled_m.cols);
  for (int32_t c0 = own_columns.first; c0 < own_columns.last; c0 += kRowAlign) {
    const int32_t width = std::min(kRowAlign, own_columns.last - c0);
    float h_above_m[kRowAlign] = {}, z_above_m[kRowAlign] = {};
    for (int32_t r = 0; r < rows; ++r)
      for (int32_t i = 0; i < width; ++i) {
        const int32_t c = c0 + i;
        const float range_m = range_filled_m.row(r)[c], e = elevation_filled_rad.row(r)[c];
        float sin_e, cos_e;
        sin_cos_small_f32(e, sin_e, cos_e);
        const float h_m = range_m * cos_e, z_m = range_m * sin_e;
        if (r > 0) {
          const float range_above_m = range_filled_m.row(r - 1)[c], e_above = elevation_filled_rad.row(r - 1)[c];
          // The printed fraction is inverted; this way 0 is level and pi/2 upright.
          const float angle = atan2_quarter_f32(std::fabs(z_above_m[i] - z_m), std::fabs(h_above_m[i] - h_m));
          const bool missing = range_above_m == kNoReturn || range_m == kNoReturn;
          const bool touching = std::fabs(e_above - e) < params.skip_elevation_rad;
          angle_rad.row(r - 1)[c] = missing ? kAngleUndefined : touching ? kAngleSkipped : angle;
        }
        h_above_m[i] = h_m;
        z_above_m[i] = z_m;
      }
  }
  if (rows > 0)
    std::fill(angle_rad.row(rows - 1) + own_columns.first, angle_rad.row(rows - 1) + own_columns.last, kAngleUndefined);
}

}  // namespace overtake::ref
