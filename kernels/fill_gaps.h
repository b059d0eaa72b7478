// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// Section 2 of kernels/README.md: fills gaps of the range image.
#pragma once

#include "core/plane.h"

namespace overtake {

// An empty pixel takes the mean range and elevation of the pixels directly above and below when both have a return and
// their ranges differ by less than max(limit_m, limit_share * nearer). Reads the original image only, so the order of
// filling does not matter. Filled pixels: range_filled > 0 and range == kNoReturn.
//   reads    range_m elevation_rad      writes  range_filled_m elevation_filled_rad, every pixel, must not alias
//   cost     one pass                   agrees  exactly on every ISA
struct FillGapsParams {
  float limit_m, limit_share;
};
namespace ref {
void fill_gaps(const FillGapsParams& params, Plane<const float> range_m, Plane<const float> elevation_rad,
               Plane<float> range_filled_m, Plane<float> elevation_filled_rad, ColumnSpan columns = {}) noexcept;
}

}  // namespace overtake
