// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// Sums, minima and maxima with one fixed order of operations. Float addition in another order gives other bytes, so the
// order is part of the result. Value k goes to lane k % 16 (one AVX-512 register, two of AVX2, four of SSE and NEON).
// Each lane adds its values in order of k. Then the lanes are added pairwise: 8, 4, 2 and 1 apart. The references and
// the vector forms share this order.
//
//   k:      0  1 ... 15 | 16 17 ... 31 | 32 ...          lane l = v[l] + v[l + 16] + v[l + 32] + ...
//   fold:   l + (l + 8), l < 8;  l + (l + 4), l < 4;  l + (l + 2), l < 2;  0 + 1
//
// Minima and maxima use the same order, because it also decides between -0 and +0. Lanes without a value keep their
// start value (sum +0, minimum +inf, maximum -inf), as a vector's masked tail does.
#pragma once

#include <cstdint>

#include "core/check.h"

namespace overtake {

inline constexpr int32_t kLanes = 16;

template <class T>
struct Lanes {
  T lane[kLanes];

  OVT_INLINE explicit Lanes(T start) {
    for (int32_t l = 0; l < kLanes; ++l) lane[l] = start;
  }
  OVT_INLINE T& operator[](int32_t l) { return lane[l]; }
};

template <class T>
OVT_INLINE T lane_sum(Lanes<T> v) {
  for (int32_t apart = kLanes / 2; apart > 0; apart /= 2)
    for (int32_t l = 0; l < apart; ++l) v[l] = v[l] + v[l + apart];
  return v[0];
}

template <class T>
OVT_INLINE T lane_min(Lanes<T> v) {
  for (int32_t apart = kLanes / 2; apart > 0; apart /= 2)
    for (int32_t l = 0; l < apart; ++l) v[l] = v[l] < v[l + apart] ? v[l] : v[l + apart];
  return v[0];
}

template <class T>
OVT_INLINE T lane_max(Lanes<T> v) {
  for (int32_t apart = kLanes / 2; apart > 0; apart /= 2)
    for (int32_t l = 0; l < apart; ++l) v[l] = v[l] > v[l + apart] ? v[l] : v[l + apart];
  return v[0];
}

// Calls f(k, lane) for k = 0 .. count - 1. Whole blocks use a loop of constant length, which compilers vectorise.
template <class F>
OVT_INLINE void for_each_in_lanes(int32_t count, F&& f) {
  int32_t k = 0;
  for (; k + kLanes <= count; k += kLanes)
    for (int32_t l = 0; l < kLanes; ++l) f(k + l, l);
  for (int32_t l = 0; k + l < count; ++l) f(k + l, l);
}

}  // namespace overtake
