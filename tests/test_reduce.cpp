// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
#include "core/reduce.h"

#include <doctest/doctest.h>

#include <bit>
#include <cmath>
#include <limits>
#include <random>
#include <vector>

using namespace overtake;

namespace {

constexpr float kInfinity = std::numeric_limits<float>::infinity();

float sum(const std::vector<float>& v) {
  Lanes<float> lanes(0.0f);
  for_each_in_lanes(int32_t(v.size()), [&](int32_t k, int32_t l) { lanes[l] = lanes[l] + v[size_t(k)]; });
  return lane_sum(lanes);
}

std::vector<float> random_values(uint32_t seed, size_t count, float low, float high) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<float> value(low, high);
  std::vector<float> v(count);
  for (float& x : v) x = value(random);
  return v;
}

}  // namespace

TEST_CASE("reduce: for_each_in_lanes visits every k once and in order, in lane k % 16") {
  for (int32_t count : {0, 1, 15, 16, 17, 31, 32, 33, 100}) {
    CAPTURE(count);
    int32_t next = 0;
    for_each_in_lanes(count, [&](int32_t k, int32_t l) {
      CHECK(k == next);
      CHECK(l == k % 16);
      ++next;
    });
    CHECK(next == count);
  }
}

TEST_CASE("reduce: lane_sum adds lanes 8, 4, 2 and 1 apart") {
  // The expected tree written out, with values whose sum depends on the order.
  for (uint32_t seed = 1; seed <= 20; ++seed) {
    CAPTURE(seed);
    std::mt19937 random(seed);
    std::uniform_real_distribution<float> mantissa(-1.0f, 1.0f);
    std::uniform_int_distribution<int> exponent(-12, 12);
    Lanes<float> v(0.0f);
    for (float& x : v.lane) x = std::ldexp(mantissa(random), exponent(random));
    const float* a = v.lane;
    const float e0 = (a[0] + a[8]) + (a[4] + a[12]), e1 = (a[1] + a[9]) + (a[5] + a[13]);
    const float e2 = (a[2] + a[10]) + (a[6] + a[14]), e3 = (a[3] + a[11]) + (a[7] + a[15]);
    const float tree = (e0 + e2) + (e1 + e3);
    CHECK(std::bit_cast<uint32_t>(lane_sum(v)) == std::bit_cast<uint32_t>(tree));
  }
}

TEST_CASE("reduce: a sum in 16 lanes separates large and small values as specified") {
  // In lane 0, a 1 added to 2^24 is lost; ones in another lane survive until the fold.
  std::vector<float> v(16 * 64, 0.0f);
  v[0] = 16777216.0f;
  for (size_t k = 1; k < 64; ++k) v[16 * k] = 1.0f;
  CHECK(sum(v) == 16777216.0f);
  for (size_t k = 1; k < 64; ++k) std::swap(v[16 * k], v[16 * k + 1]);
  CHECK(sum(v) == 16777216.0f + 63.0f + 1.0f);  // 63 is a tie to even
}

TEST_CASE("reduce: unused lanes do not change a sum") {
  const std::vector<float> v = random_values(3, 37, -5.0f, 5.0f);
  std::vector<float> padded = v;
  padded.resize(48, 0.0f);
  CHECK(std::bit_cast<uint32_t>(sum(v)) == std::bit_cast<uint32_t>(sum(padded)));
}

TEST_CASE("reduce: a sum of n values in 16 lanes is within (n / 16 + 5) roundings of the exact sum") {
  for (uint32_t seed = 1; seed <= 10; ++seed)
    for (size_t count : {size_t(1), size_t(16), size_t(17), size_t(1000), size_t(20000)}) {
      CAPTURE(seed);
      CAPTURE(count);
      const std::vector<float> v = random_values(seed, count, -100.0f, 300.0f);
      long double exact = 0, magnitude = 0;
      for (float x : v) exact += x, magnitude += std::fabs(x);
      const long double bound = (long double)(count / 16 + 5) * 0x1p-24L * magnitude;
      CHECK(std::fabs((long double)sum(v) - exact) <= bound);
      // The benefit of lanes: a plain loop has larger errors on long columns of one sign, typically tenfold.
      if (count < 20000) continue;
      float plain = 0;
      for (float x : v) plain += x;
      CHECK(std::fabs((long double)sum(v) - exact) <
            std::fabs((long double)plain - exact) + 1e-3L * magnitude * 0x1p-24L);
    }
}

TEST_CASE("reduce: lane_min and lane_max find extremes at any place, and give infinity when empty") {
  CHECK(lane_min(Lanes<float>(kInfinity)) == kInfinity);
  CHECK(lane_max(Lanes<float>(-kInfinity)) == -kInfinity);
  for (int32_t l = 0; l < kLanes; ++l) {
    CAPTURE(l);
    Lanes<float> v(1.0f);
    v[l] = -2.0f;
    CHECK(lane_min(v) == -2.0f);
    CHECK(lane_max(v) == 1.0f);
    v[l] = 3.0f;
    CHECK(lane_min(v) == 1.0f);
    CHECK(lane_max(v) == 3.0f);
  }
}
