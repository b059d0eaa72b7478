// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// Stage 5: ground removal.
#pragma once

#include "core/range_image.h"

namespace overtake {

// Non-ground where the smoothed angle of the pair (i, i + 1) exceeds the threshold; the pair decides the upper pixel i.
//   reads    angle_smooth_rad; range_filled_m (which pixels exist); pixel_point (which hold a return of their own)
//   writes   nonground, every word
//   rules    a pixel without range is not non-ground; a pixel with a return of its own whose pair is undefined is
//            non-ground, a filled one is not; the bottom is ground: in each column the last pixel that holds a return
//            (below it there is nothing to judge by: the rim of what the own car hides would be obstacles all round),
//            and the last row in use (row_count - 1) with all below it
//   agrees   exactly on every ISA
struct MarkGroundParams {
  float threshold_rad;  // th_gnd
};
namespace ref {
void mark_ground(const MarkGroundParams& params, int32_t row_count, Plane<const float> angle_smooth_rad,
                 Plane<const float> range_filled_m, Plane<const int32_t> pixel_point, BitPlane nonground) noexcept;
}

}  // namespace overtake
