// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// The scale of intensities comes from the scan itself: sensors report 0..1, 0..255 or anything else.
#include <algorithm>
#include <bit>
#include <cstdint>

#include "kernels/ground_light.h"

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

// Points on the ground, with their ranges.
struct Samples {
  int32_t count = 0;
  int32_t point[kGroundSamples];
  float range_m[kGroundSamples];
};

// The ground nearer than the mean of the ranges is brighter than the ground behind it by more than the 1.5th power of
// the ranges' ratio.
bool falls_with_range(const ScanTable& scan, const Samples& samples) {
  constexpr int32_t kEnough = 24;
  constexpr float kApart = 1.4f;
  float sum_m = 0.0f;
  for (int32_t i = 0; i < samples.count; ++i) sum_m += samples.range_m[i];
  Ground near, far;
  for (int32_t i = 0; i < samples.count; ++i) {
    const float range_m = samples.range_m[i];
    (range_m * float(samples.count) < sum_m ? near : far).add(scan.intensity[samples.point[i]], range_m);
  }
  if (near.count < kEnough || far.count < kEnough || far.mean_m() < kApart * near.mean_m()) return false;
  const float light = near.median(), far_light = far.median(), ratio = far.mean_m() / near.mean_m();
  return light > 0.0f && light * light > far_light * far_light * ratio * ratio * ratio;
}

}  // namespace

GroundLight find_ground_light(const ScanTable& scan, Plane<const float> range_filled_m,
                              Plane<const int32_t> pixel_point, ConstBitPlane nonground) noexcept {
  constexpr int32_t kShift = 37;  // of the columns from row to row
  const int32_t rows = pixel_point.rows, cols = pixel_point.cols;
  const int32_t most = rows > 0 ? std::max(kGroundSamples / rows, 1) : 1, step = std::max((cols + most - 1) / most, 1);
  Samples samples;
  for (int32_t r = 0; r < rows; ++r)
    for (int32_t c = r * kShift % step; c < cols && samples.count < kGroundSamples; c += step) {
      const int32_t point = pixel_point.row(r)[c];
      if (point == kNoPoint || nonground.test(r, c)) continue;
      samples.point[samples.count] = point;
      samples.range_m[samples.count++] = range_filled_m.row(r)[c];
    }
  GroundLight ground;
  if (samples.count == 0) return ground;
  ground.is_signal = falls_with_range(scan, samples);
  uint32_t key[kGroundSamples];
  for (int32_t i = 0; i < samples.count; ++i) key[i] = key_of(ground.of(scan, samples.point[i]));
  ground.light = select_rank(key, samples.count, samples.count / 2);
  return ground;
}

}  // namespace overtake
