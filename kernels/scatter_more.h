// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// Section 1 of kernels/README.md: the pixels of scatter_points, some points after the other.
#pragma once

#include <cstdint>

#include "core/point_table.h"
#include "core/range_image.h"

namespace overtake {

// Makes every pixel empty, as scatter_points does before the first point.
void clear_pixels(RangeImages& images) noexcept;

// Scatters points [begin, end). After clear_pixels, calls over all points in their order write what one scatter_points
// writes. The winner of a pixel follows a total order (intensity, range, input order), so the cut does not matter.
//   reads    scan layer intensity; points range_m elevation_rad column; row_of_layer, a row of each layer of the points
//            with a column
//   writes   images range_m elevation_rad pixel_point; points pixel, label, lost (also of earlier points)
void scatter_more(const ScanTable& scan, const int32_t* row_of_layer, int32_t begin, int32_t end, PointTable& points,
                  RangeImages& images) noexcept;

}  // namespace overtake
