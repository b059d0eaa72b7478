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
}

const HeadingGrid kHeadingGrid;

}  // namespace overtake
