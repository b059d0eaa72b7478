// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// The scale of intensities comes from the scan itself: sensors report 0..1, 0..255 or anything else.
#include <algorithm>
#include <bit>
#include <cstdint>

#include "kernels/drop_smoke.h"

namespace overtake {
namespace {

// The value that has `rank` smaller ones before it, when sorted. Finds it byte by byte: the time does not depend on the
// order of the values.
float select_rank(uint32_t* keys, int32_t count, int32_t rank) {
  uint32_t value = 0;
  for (int32_t shift = 24; shift >= 0; shift -= 8) {
    int32_t number[256] = {};
    for (int32_t i = 0; i < count; ++i) ++number[keys[i] >> shift & 0xff];
    uint32_t byte = 0;
    for (; rank >= number[byte]; ++byte) rank -= number[byte];
    value |= byte << shift;
    int32_t left = 0;
    for (int32_t i = 0; i < count; ++i) {
      keys[left] = keys[i];
      left += (keys[i] >> shift & 0xff) == byte;
    }
    count = left;
  }
  return std::bit_cast<float>(value & 0x80000000u ? value & 0x7fffffffu : ~value);
}

}  // namespace

float find_ground_intensity(const ScanTable& scan, Plane<const int32_t> pixel_point, ConstBitPlane nonground) noexcept {
  constexpr int32_t kShift = 37;  // of the columns from row to row
  const int32_t rows = pixel_point.rows, cols = pixel_point.cols;
  const int32_t most = rows > 0 ? std::max(kGroundSamples / rows, 1) : 1, step = std::max((cols + most - 1) / most, 1);
  uint32_t keys[kGroundSamples];  // sort like the intensities
  int32_t count = 0;
  for (int32_t r = 0; r < rows && count < kGroundSamples; ++r)
    for (int32_t c = r * kShift % step; c < cols && count < kGroundSamples; c += step) {
      const int32_t point = pixel_point.row(r)[c];
      if (point == kNoPoint || nonground.test(r, c)) continue;
      const uint32_t bits = std::bit_cast<uint32_t>(scan.intensity[point]);
      keys[count++] = bits & 0x80000000u ? ~bits : bits | 0x80000000u;
    }
  if (count == 0) return 0.0f;
  return select_rank(keys, count, count / 2);
}

}  // namespace overtake
