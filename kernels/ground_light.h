// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// Section 5c of kernels/README.md: how bright the ground of a scan is.
#pragma once

#include "core/point_table.h"
#include "core/range_image.h"

namespace overtake {

// What the intensities of a scan compare with. A reflectivity compares as it is. A signal falls with the square of the
// range, or faster on the ground, so its product with this square compares.
struct GroundLight {
  float light = 0.0f;      // the median of the ground; 0: no ground, or no intensities
  bool is_signal = false;  // the scan's intensities are no reflectivities

  float of(const ScanTable& scan, int32_t point) const {  // of a point
    const float x = scan.x_m[point], y = scan.y_m[point], z = scan.z_m[point];
    return is_signal ? scan.intensity[point] * (x * x + y * y + z * z) : scan.intensity[point];
  }
};

// Of at most kGroundSamples ground pixels that are spread over the image. They are signals if the ground is darker the
// farther away it is, by more than the 1.5th power of the range; recorded reflectivities of a road change with its
// power of 0.3 to -0.8.
//   reads  scan x_m y_m z_m intensity; range_filled_m pixel_point nonground
inline constexpr int32_t kGroundSamples = 512;
GroundLight find_ground_light(const ScanTable& scan, Plane<const float> range_filled_m,
                              Plane<const int32_t> pixel_point, ConstBitPlane nonground) noexcept;

}  // namespace overtake
