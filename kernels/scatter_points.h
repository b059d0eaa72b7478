// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// Section 1 of kernels/README.md: assigns points to pixels, and selects the winner of each pixel.
#pragma once

#include "core/point_table.h"
#include "core/range_image.h"

namespace overtake {

// Several points on one pixel: the highest intensity wins (least likely dust); ties: nearer, then first in input order.
//   reads    scan layer intensity; points range_m elevation_rad column; row_of_layer
//   writes   images range_m elevation_rad pixel_point, every pixel [rows x cols]; points pixel, lost, label = ground
//            (none without a pixel; label_points gives some of them another), and reason = kLayerDropped (then
//            pixel = -1)
//   cost     one scattered record per point            agrees  exactly on every ISA
namespace ref {
void scatter_points(const ScanTable& scan, const int32_t* row_of_layer, PointTable& points,
                    RangeImages& images) noexcept;
}

}  // namespace overtake
