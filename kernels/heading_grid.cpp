// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
#include "kernels/heading_grid.h"

namespace overtake {

HeadingGrid::HeadingGrid() noexcept {
  for (int32_t i = 0; i < kHeadingCount; ++i) {
    double s, c;
    sin_cos_f64(grid_heading_rad(i), s, c);
    sin[i] = float(s);
    cos[i] = float(c);
  }
  for (int32_t d = 0; d < kDegreesPadded; ++d) {
    degree_cos[d] = d < kDegreeCount ? cos[d * kHeadingsPerDegree] : 0.0f;
    degree_sin[d] = d < kDegreeCount ? sin[d * kHeadingsPerDegree] : 0.0f;
  }
}

const HeadingGrid kHeadingGrid;

}  // namespace overtake
