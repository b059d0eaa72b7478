// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// Section 6 of kernels/README.md: repair of the non-ground range image, NGRIR (eq. 3, with its indices completed).
#pragma once

#include "core/plane.h"

namespace overtake {

// For every pixel that is not non-ground: N = the pairs (j-k, j+k), 1 <= k <= half_window, with both pixels non-ground
// and |r_j-k - r_j+k| < range_limit_m. If N is not empty, the pixel becomes non-ground with the mean range and
// elevation of N's pixels (pairs are summed from k = 1 on). Pairs that leave the image count only if columns wrap.
//   reads    range_filled_m elevation_filled_rad nonground (the original mask only: the order does not matter)
//   writes   range_repaired_m elevation_repaired_rad (non-ground pixels keep theirs, all others 0), nonground_repaired
//   cost     half_window pairs per pixel, skipped where no word has a bit    agrees  exactly on every ISA
struct RepairRangeParams {
  int32_t half_window;  // (window - 1) / 2
  float range_limit_m;  // th_r
  bool wraps;
};
inline constexpr int32_t kMaxRepairHalfWindow = 15;
namespace ref {
void repair_range(const RepairRangeParams& params, Plane<const float> range_filled_m,
                  Plane<const float> elevation_filled_rad, ConstBitPlane nonground, Plane<float> range_repaired_m,
                  Plane<float> elevation_repaired_rad, BitPlane nonground_repaired, ColumnSpan columns = {}) noexcept;
}

}  // namespace overtake
