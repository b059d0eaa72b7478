// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// Section 5c of kernels/README.md: smoke and dust are not obstacles.
#pragma once

#include "core/point_table.h"
#include "core/range_image.h"
#include "kernels/ground_light.h"

namespace overtake {

struct DropSmokeParams {
  float dark_share;  // smoke is darker than this share of the ground; 0: nothing is smoke
  float near_share;  // a larger share of the neighbours lies at about the same range: a surface
  float reach_m;     // neighbours: ranges that differ by less
};

inline constexpr int32_t kSmokeRows = 2, kSmokeCols = 6;           // window of neighbours, to either side
inline constexpr float kSurface_m = 0.05f, kSurfaceShare = 0.01f;  // largest difference of two ranges on one surface:
                                                                   // kSurface_m + kSurfaceShare * range
inline constexpr float kRoughShare = 0.5f;                         // of the neighbours of a pixel of smoke, at least

// Returns of smoke are dark, and their ranges jump from pixel to pixel in every direction. One of the two alone is
// common on cars (black parts, edges); a place where half of the pixels show both is smoke.
//   reads    scan x_m y_m z_m intensity; ground; points pixel (where pixel_point has the point); range_filled_m
//            pixel_point nonground
//   writes   smoke, every word; takes these pixels out of nonground
//   rules    - dark: below dark_share of the ground's light (GroundLight); also a filled gap that is non-ground. Low
//              smoke is ground for running_ground: here such pixels count, too
//            - neighbours: the pixels of a window (which ends at the edges of the image) within reach_m, if they are
//              non-ground or dark
//            - rough: dark, and at most near_share of its neighbours are on one surface with it
//            - smoke: dark, and at least kRoughShare of its neighbours are rough. A dark pixel without neighbours is
//              smoke, too, because NGRIR would join such pixels
//   scratch  considered rough
//   cost     an intensity a point, two windows a dark pixel     agrees  exactly on every ISA
namespace ref {
void drop_smoke(const DropSmokeParams& params, const ScanTable& scan, const GroundLight& ground,
                const int32_t* point_pixel, Plane<const float> range_filled_m, Plane<const int32_t> pixel_point,
                BitPlane nonground, BitPlane considered, BitPlane rough, BitPlane smoke) noexcept;
}

}  // namespace overtake
