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
  static constexpr float kGap_m = 1.0f;    // beside an island nothing of its range is so near
  static constexpr float kLeast_m = 0.6f;  // its width
  static constexpr float kMost_m = 2.8f;   // of a car at an angle
  static constexpr int32_t kLeastPixels = 3;
  static constexpr float kShare = 0.4f;  // of its columns, which have a pixel of it
};

// Far away a car may show one row of beams, at a height that the road may have there as well. But the road goes on to
// the sides of the row, and a car does not: beside an island the row passes over to what is farther away, or returns
// nothing. The pixels of an island become non-ground.
//
//      ranges of a row:   103  104  105   -   82   -  82  83  82   -   112  113      island: 82 82 83 82
//
// A ground pixel from kFrom_m on, and kLow_m over the running ground, may belong to an island: this one, and to either
// side the next pixel whose range differs by at most kDepth_m, and so on until there is none within kGap_m. Pixels
// farther away are passed by. A nearer one may hide a part: no island. The pixels of a row are tried from the left to
// the right.
//   reads    range_filled_m height_m nonground      writes   nonground: sets bits
//   cost     two comparisons a pixel, and up to kMost_m + kGap_m to either side of a doubtful one
//   agrees   exactly on every ISA
namespace ref {
void mark_islands(bool wraps, float pitch_rad, Plane<const float> range_filled_m, Plane<const float> height_m,
                  BitPlane nonground) noexcept;

// The island of one such pixel: sets its bits. Returns how many columns to the right need no further try: they belong
// to this island, or to a surface that is too wide for one.
int32_t mark_island_of(bool wraps, float pitch_rad, Plane<const float> range_filled_m, int32_t r, int32_t c,
                       BitPlane nonground) noexcept;
}  // namespace ref

}  // namespace overtake
