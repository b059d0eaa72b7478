// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// Samples the expected road surface around a sensor for running_ground (core/road_surface.h).
#pragma once

#include "core/road_surface.h"
#include "core/sensor_model.h"
#include "pipeline/road/road_data.h"

namespace overtake {

// Computes the surface along every ray of the sensor's image:
//   - over the map, along rays whose stations are known up to 100 m: the learned height of the centre line, the cross
//     slope over the width of the road, level beyond its edges; `known` is 1
//   - else a parabola along x: a curved, banked road bends up towards the driving direction by curvature * sin(bank) / 2
//     per m^2, up to 100 m, then straight; `known` is 0. Without a pose: level
// Heights are relative to the road under the vehicle.
//   reads  road, sensor     writes  every element of the surface
void sample_road(const RoadData& road, const SensorModel& sensor, const RoadSurface& surface) noexcept;

}  // namespace overtake
