// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// Section 7: links neighbouring pixels of one object (eq. 2; Bogoslavskyi & Stachniss 2016).
//
//        A           beta is the angle at A between the beam OA and the line AB: nearly 0 where B lies far behind A
//        |\  beta    or far before it, large along one surface. O is the sensor, alpha the angle between the beams.
//     d1 | \_
//        |   B
//        | / d2
//        O   alpha
#include "kernels/link_pixels.h"

#include <algorithm>
#include <cmath>

#include "core/math.h"

namespace overtake::ref {

void link_pixels(const LinkPixelsParams& params, Plane<const float> range_repaired_m,
                 Plane<const float> elevation_repaired_rad, ConstBitPlane nonground_repaired, BitPlane link_right,
                 BitPlane link_down, ColumnSpan columns) noexcept {
  const int32_t rows = range_repaired_m.rows, cols = range_repaired_m.cols;
  const ColumnSpan own = columns.within(cols);
  for (int32_t r = 0; r < rows; ++r) {
    for (int32_t w = own.first_word(); w < own.end_word(); ++w) link_right.row(r)[w] = link_down.row(r)[w] = 0;
    const float *range_m = range_repaired_m.row(r), *elevation_rad = elevation_repaired_rad.row(r);
    for (int32_t c = own.first; c < own.last; ++c) {
      if (!nonground_repaired.test(r, c)) continue;

      const int32_t right = c + 1 < cols ? c + 1 : params.wraps ? 0 : -1;
      if (right >= 0 && right != c && nonground_repaired.test(r, right) &&
          pixels_join(range_m[c], range_m[right], params.sin_pitch, params.cos_pitch, params.tan_threshold))
        link_right.set(r, c);

      if (r + 1 < rows && nonground_repaired.test(r + 1, c)) {
        const float alpha = std::min(std::fabs(elevation_rad[c] - elevation_repaired_rad.row(r + 1)[c]), kHalfPiF);
        float sin_alpha, cos_alpha;
        sin_cos_small_f32(alpha, sin_alpha, cos_alpha);
        if (pixels_join(range_m[c], range_repaired_m.row(r + 1)[c], sin_alpha, cos_alpha, params.tan_threshold))
          link_down.set(r, c);
      }
    }
  }
}

}  // namespace overtake::ref
