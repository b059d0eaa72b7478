// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// Ground removal by height: decides each pixel without its neighbours. Only the tests' method `plain` uses this kernel.
#pragma once

#include "core/plane.h"
#include "core/sensor_model.h"

namespace overtake {

// Pixels above this height are non-ground. The road is the plane z = 0 of the vehicle frame.
inline constexpr float kRoadHeight_m = 0.3f;

// Keeps the pixels above kRoadHeight_m. Assumes a level sensor: a pixel's height is the sensor's height plus range *
// sin(elevation). Ignores roll, pitch and banking.
//   reads    range_filled_m elevation_filled_rad of at most pi/2
//   writes   range_repaired_m elevation_repaired_rad (0 where not kept) nonground_repaired, every pixel
//   cost     one sine per pixel         agrees  exactly on every ISA
namespace ref {
void keep_above_road(const Transform& T_vehicle_sensor, Plane<const float> range_filled_m,
                     Plane<const float> elevation_filled_rad, Plane<float> range_repaired_m,
                     Plane<float> elevation_repaired_rad, BitPlane nonground_repaired) noexcept;
}

}  // namespace overtake
