// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// The scale of intensities comes from the scan itself: sensors report 0..1, 0..255 or anything else.
#include <algorithm>
#include <bit>
#include <cmath>
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

uint32_t key_of(float intensity) {  // NaN and signs sort as in a total order
  const uint32_t bits = std::bit_cast<uint32_t>(intensity);
  return bits & 0x80000000u ? ~bits : bits | 0x80000000u;
}

// Intensities of one part of the ground, and its mean range.
struct Ground {
  uint32_t key[kGroundSamples];
  int32_t count = 0;
  float sum_m = 0.0f;

  void add(float intensity, float range_m) { key[count++] = key_of(intensity), sum_m += range_m; }
  float median() { return select_rank(key, count, count / 2); }
  float mean_m() const { return sum_m / float(count); }
};

// At most kGroundSamples points on the ground.
class Samples {
 public:
  explicit Samples(const ScanTable& scan) : scan_(scan) {}
  bool full() const { return count_ == kGroundSamples; }
  void add(int32_t point) { point_[count_++] = point; }
  GroundLight median() const {
    if (count_ == 0) return {};
    GroundLight ground{.is_signal = falls_with_range()};
    uint32_t key[kGroundSamples];
    for (int32_t i = 0; i < count_; ++i) key[i] = key_of(ground.of(scan_, point_[i]));
    ground.light = select_rank(key, count_, count_ / 2);
    return ground;
  }

 private:
  // By every second sample: the ground nearer than the mean of their ranges is brighter than the ground behind it by
  // more than the 1.5th power of the ranges' ratio.
  bool falls_with_range() const {
    constexpr int32_t kEnough = 8;
    constexpr float kApart = 1.25f;
    float range_m[kGroundSamples], sum_m = 0.0f;
    int32_t number = 0;
    for (int32_t i = 0; i < count_; i += 2) {
      const float x = scan_.x_m[point_[i]], y = scan_.y_m[point_[i]], z = scan_.z_m[point_[i]];
      range_m[number] = std::sqrt(x * x + y * y + z * z);
      sum_m += range_m[number++];
    }
    Ground near, far;
    for (int32_t k = 0; k < number; ++k)
      (range_m[k] * float(number) < sum_m ? near : far).add(scan_.intensity[point_[2 * k]], range_m[k]);
    if (near.count < kEnough || far.count < kEnough || far.mean_m() < kApart * near.mean_m()) return false;
    const float light = near.median(), far_light = far.median(), ratio = far.mean_m() / near.mean_m();
    return light > 0.0f && light * light > far_light * far_light * ratio * ratio * ratio;
  }

  const ScanTable& scan_;
  int32_t point_[kGroundSamples];
  int32_t count_ = 0;
};

}  // namespace

GroundLight find_ground_light(const ScanTable& scan, Plane<const int32_t> pixel_point,
                              ConstBitPlane nonground) noexcept {
  constexpr int32_t kShift = 37;  // of the columns from row to row
  const int32_t rows = pixel_point.rows, cols = pixel_point.cols;
  const int32_t most = rows > 0 ? std::max(kGroundSamples / rows, 1) : 1, step = std::max((cols + most - 1) / most, 1);
  Samples samples(scan);
  for (int32_t r = 0; r < rows && !samples.full(); ++r)
    for (int32_t c = r * kShift % step; c < cols && !samples.full(); c += step) {
      const int32_t point = pixel_point.row(r)[c];
      if (point != kNoPoint && !nonground.test(r, c)) samples.add(point);
    }
  return samples.median();
}

GroundLight find_ground_light(const ScanTable& scan, const int32_t* labels) noexcept {
  const int32_t step = std::max(1, (scan.count + kGroundSamples - 1) / kGroundSamples);
  Samples samples(scan);
  for (int32_t first = 0; first < scan.count && !samples.full(); first += step) {
    // At another place of each step: a scan may have its lines side by side, point after point.
    constexpr uint32_t kGolden = 2'654'435'769;  // 2^32 times the golden section
    const auto i = first + int32_t(uint64_t(uint32_t(first / step) * kGolden) * uint32_t(step) >> 32);
    if (i < scan.count && labels[i] == kLabelGround) samples.add(i);
  }
  return samples.median();
}

}  // namespace overtake
