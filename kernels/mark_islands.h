// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// Section 5b of kernels/README.md: a car of which one row is seen, as low as the road may be.
#pragma once

#include "core/plane.h"

namespace overtake {

struct IslandLimits {
  static constexpr float kFrom_m = 60.0f;  // nearer, a car has several rows
  static constexpr float kLow_m = 0.15f;   // height over the running ground from which ground is doubtful
  static constexpr float kDepth_m = 1.5f;  // from one pixel of an island to the next
  static constexpr float kGap_m = 1.0f;    // wide enough for nothing to be beside an island
  static constexpr float kLeast_m = 0.6f;  // its width
  static constexpr float kMost_m = 2.8f;   // ... at most: a car at an angle
  static constexpr int32_t kLeastPixels = 3;
  static constexpr float kShare = 0.4f;  // of its columns that return from it
};

// Far away a car may show one row of beams, at a height that the road may have there as well. But the road goes on to
// the sides of the row, and a car does not: beside an island the row passes over to what is farther away, or returns
// nothing. The pixels of an island become non-ground.
//
//      ranges of a row:   103  104  105   -   82   -  82  83  82   -   112  113      island: 82 82 83 82
//
// Each pixel that is ground, from kFrom_m on and kLow_m over the running ground, may be one of an island. It goes on to
// either side with the next pixel that is not more than kDepth_m farther, until kGap_m has none. A pixel that is more
// than kDepth_m nearer hides a part: no island. Pixels are asked from the left to the right.
//   reads    range_filled_m height_m nonground      writes   nonground: sets bits
//   cost     two comparisons a pixel                agrees   exactly on every ISA
namespace ref {
void mark_islands(bool wraps, float pitch_rad, Plane<const float> range_filled_m, Plane<const float> height_m,
                  BitPlane nonground) noexcept;

// The island of one such pixel: sets its bits. Returns how many columns to the right belong to the same surface, an
// island or too wide for one: none of their pixels is asked again.
int32_t mark_island_of(bool wraps, float pitch_rad, Plane<const float> range_filled_m, int32_t r, int32_t c,
                       BitPlane nonground) noexcept;
}  // namespace ref

}  // namespace overtake
