// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// Finds the yaw of a sensor from the walls, fences and rows of cars along the road. They run along the vehicle, so the
// directions of upright surfaces, turned by the right yaw, gather at 0. On a level road nothing else in one scan shows
// the yaw: the road looks the same in all directions.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "tools/io/rig.h"
#include "tools/io/sensor_scan.h"

namespace overtake::cli {

class WallDirections {
 public:
  void add(const io::SensorScan& scan, const io::RigSensor& sensor);  // uses the sensor's roll, pitch and height
  double length_m() const;                                            // of all surfaces; each line counts separately
  // Share of the length that runs within 12 degrees of the vehicle's axis if the sensor has that yaw.
  double share_along(double yaw_deg) const;

 private:
  std::array<double, 36> length_m_ = {};  // by direction in the sensor's frame, 5 degrees each, half a turn
};

// For each sensor, the sensor whose yaw it seems to have; itself if its own yaw fits or the data cannot decide.
// `walls` has the order of `rig.sensors`.
std::vector<std::size_t> find_swapped_yaws(const io::Rig& rig, const std::vector<WallDirections>& walls);

}  // namespace overtake::cli
