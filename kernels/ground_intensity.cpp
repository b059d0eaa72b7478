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

// Of at most kGroundSamples intensities; NaN and signs sort as in a total order.
class Samples {
 public:
  bool full() const { return count_ == kGroundSamples; }
  void add(float intensity) {
    const uint32_t bits = std::bit_cast<uint32_t>(intensity);
    keys_[count_++] = bits & 0x80000000u ? ~bits : bits | 0x80000000u;
  }
  float median() { return count_ == 0 ? 0.0f : select_rank(keys_, count_, count_ / 2); }

 private:
  uint32_t keys_[kGroundSamples];
  int32_t count_ = 0;
};

}  // namespace

float find_ground_intensity(const ScanTable& scan, Plane<const int32_t> pixel_point, ConstBitPlane nonground) noexcept {
  constexpr int32_t kShift = 37;  // of the columns from row to row
  const int32_t rows = pixel_point.rows, cols = pixel_point.cols;
  const int32_t most = rows > 0 ? std::max(kGroundSamples / rows, 1) : 1, step = std::max((cols + most - 1) / most, 1);
  Samples samples;
  for (int32_t r = 0; r < rows && !samples.full(); ++r)
    for (int32_t c = r * kShift % step; c < cols && !samples.full(); c += step) {
      const int32_t point = pixel_point.row(r)[c];
      if (point != kNoPoint && !nonground.test(r, c)) samples.add(scan.intensity[point]);
    }
  return samples.median();
}

float find_ground_intensity(const ScanTable& scan, const int32_t* labels) noexcept {
  const int32_t step = std::max(1, (scan.count + kGroundSamples - 1) / kGroundSamples);
  Samples samples;
  for (int32_t first = 0; first < scan.count && !samples.full(); first += step) {
    // At another place of each step: a scan may have its lines side by side, point after point.
    constexpr uint32_t kGolden = 2'654'435'769;  // 2^32 times the golden section
    const auto i = first + int32_t(uint64_t(uint32_t(first / step) * kGolden) * uint32_t(step) >> 32);
    if (i < scan.count && labels[i] == kLabelGround) samples.add(scan.intensity[i]);
  }
  return samples.median();
}

}  // namespace overtake
