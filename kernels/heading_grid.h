// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// Sines and cosines of the headings that fit_rectangle tries: [0, 90) deg in steps of 1/16 deg. The grid contains the
// 1 deg steps and all refinements by halves, so a heading is an index, and wrapping at 90 deg is exact.
#pragma once

#include <cstdint>

#include "core/math.h"

namespace overtake {

inline constexpr int32_t kHeadingsPerDegree = 16;
inline constexpr int32_t kDegreeCount = 90;
inline constexpr int32_t kDegreesPadded = 96;  // a multiple of the vector size
inline constexpr int32_t kHeadingCount = kDegreeCount * kHeadingsPerDegree;

// Filled when the program or the shared library is loaded; read-only afterwards.
struct HeadingGrid {
  float cos[kHeadingCount], sin[kHeadingCount];
  alignas(64) float degree_cos[kDegreesPadded], degree_sin[kDegreesPadded];  // whole degrees, zero-padded
  HeadingGrid() noexcept;
};
extern const HeadingGrid kHeadingGrid;

OVT_INLINE double grid_heading_rad(int32_t index) { return double(index) * (kHalfPi / kHeadingCount); }

}  // namespace overtake
