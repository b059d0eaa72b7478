// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// The scale of intensities comes from the scan itself: sensors report 0..1, 0..255 or anything else.
#include <algorithm>

#include "kernels/drop_smoke.h"

namespace overtake {

float find_ground_intensity(const ScanTable& scan, Plane<const int32_t> pixel_point, ConstBitPlane nonground) noexcept {
  constexpr int32_t kShift = 37;  // of the columns from row to row
  const int32_t rows = pixel_point.rows, cols = pixel_point.cols;
  const int32_t most = rows > 0 ? std::max(kGroundSamples / rows, 1) : 1, step = std::max((cols + most - 1) / most, 1);
  float samples[kGroundSamples];
  int32_t count = 0;
  for (int32_t r = 0; r < rows && count < kGroundSamples; ++r)
    for (int32_t c = r * kShift % step; c < cols && count < kGroundSamples; c += step) {
      const int32_t point = pixel_point.row(r)[c];
      if (point != kNoPoint && !nonground.test(r, c)) samples[count++] = scan.intensity[point];
    }
  if (count == 0) return 0.0f;
  std::nth_element(samples, samples + count / 2, samples + count);
  return samples[count / 2];
}

}  // namespace overtake
