// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// Samples the expected road surface around a sensor for running_ground (core/road_surface.h).
#pragma once

#include "core/road_surface.h"
#include "core/sensor_model.h"
#include "kernels/kernel_table.h"
#include "pipeline/road/road_data.h"

namespace overtake {

// Computes the surface along every ray of the sensor's image:
//   - over the map, along rays whose stations are known up to 100 m: the learned height of the centre line, the cross
//     slope over the width of the road, level beyond its edges; known_m is where the ray leaves the road. A plane that
//     is fitted to what the scan's ground differs from it corrects the sensor's mounting and the ego pose
//   - over a map with banking whose heights are not known yet (first lap): the road that the map lets expect
//     (height_profile.h), plus a shape as below that is fitted to what the scan's ground differs from it
//   - else a shape z = a + b x + c n + q x^2 + e x n (n: distance from the vehicle's lane), fitted to the ground of the
//     scan itself, level where the scan shows too little of it; with an ego pose it is the difference to the road that
//     the vehicle drove on and that goes on as banked as here; known_m is 0, without a map or an ego pose -1
// Known heights are relative to the road under the vehicle. Both bounds are 0 where known_m is 0 or below: without
// heights it is not known where on a bank a ray lies. A ray is followed until it is more
// than 6 m outside of the road: whether it comes back after that is not known.
//   reads  road, sensor, images     writes  the rays at the columns of the span, each at its left edge; the last span
//                                           also the ray at the image's right edge
void sample_road(const KernelTable& kernels, const RunningGroundParams& params, const RoadData& road,
                 const SensorModel& sensor, Plane<const float> range_filled_m, Plane<const float> elevation_filled_rad,
                 const RoadSurface& surface, ColumnSpan columns = {}) noexcept;

}  // namespace overtake
