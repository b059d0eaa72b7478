// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// Section 5 of kernels/README.md: ground removal.
#pragma once

#include "core/range_image.h"

namespace overtake {

// Non-ground where the smoothed angle of the pair (i, i + 1) exceeds the threshold; the pair decides the upper pixel i.
//   reads    angle_smooth_rad; range_filled_m (which pixels exist); pixel_point (which pixels have a return)
//   writes   nonground, every word
//   rules    - a pixel without range is ground (bit 0)
//            - a pixel with an undefined pair is non-ground if it has a return and its column has a return in a lower
//              row; a filled pixel with an undefined pair is ground. Without the lower return, the rim of the own car's
//              shadow would be a ring of obstacles
//            - all rows from row_count - 1 on are ground: no pair lies below them (row_count is one more than the rows
//              if other rows follow)
//   agrees   exactly on every ISA
struct MarkGroundParams {
  float threshold_rad;  // th_gnd
};
namespace ref {
void mark_ground(const MarkGroundParams& params, int32_t row_count, Plane<const float> angle_smooth_rad,
                 Plane<const float> range_filled_m, Plane<const int32_t> pixel_point, BitPlane nonground,
                 ColumnSpan columns = {}) noexcept;
}

}  // namespace overtake
