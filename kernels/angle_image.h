// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// Section 3 of kernels/README.md: angle image (eq. 1, with its fraction inverted and absolute values).
#pragma once

#include "core/range_image.h"

namespace overtake {

// a = atan2(|z_i - z_i+1|, |h_i - h_i+1|), h = r cos e, z = r sin e: 0 level, pi/2 upright.
//   reads    range_filled_m elevation_filled_rad [rows x cols]
//   writes   angle_rad rows 0 .. rows-2: the angle; kAngleUndefined where a pixel of the pair is missing; kAngleSkipped
//            where |e_i - e_i+1| < skip_elevation_rad. The last row has no pair: kAngleUndefined
//   cost     one sin/cos a pixel, one atan2 a pair     agrees  exactly on every ISA
struct AngleImageParams {
  float skip_elevation_rad;
};
namespace ref {
void angle_image(const AngleImageParams& params, Plane<const float> range_filled_m,
                 Plane<const float> elevation_filled_rad, Plane<float> angle_rad, ColumnSpan columns = {}) noexcept;
}

}  // namespace overtake
