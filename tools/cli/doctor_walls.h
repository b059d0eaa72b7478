// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// How a sensor is turned, by what stands along the road: walls, fences and rows of cars run along the vehicle, so the
// directions in which upright surfaces run, turned by the right yaw, gather at 0. On a level road nothing else of one
// scan tells the yaw: the road itself looks the same in all directions.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "tools/io/rig.h"
#include "tools/io/sensor_scan.h"

namespace overtake::cli {

class WallDirections {
 public:
  void add(const io::SensorScan& scan, const io::RigSensor& sensor);  // of the sensor its roll, pitch and height count
  double length_m() const;                                            // of all surfaces, each line for itself
  // Share of the length that runs within 12 degrees of the vehicle's axis where the sensor is turned by that yaw.
  double share_along(double yaw_deg) const;

 private:
  std::array<double, 36> length_m_ = {};  // by direction in the sensor's frame, 5 degrees each, half a turn
};

// For each sensor the one whose yaw it seems to have: itself, where its own fits or nothing can be said. `walls` as
// `rig.sensors`.
std::vector<std::size_t> find_swapped_yaws(const io::Rig& rig, const std::vector<WallDirections>& walls);

}  // namespace overtake::cli
