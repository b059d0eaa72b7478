// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// The scene of the golden hashes: three sensors, ground, two walls, three cars, some bad points. It uses only integers
// and the five correctly rounded operations (no libm: its last bits differ between machines). So the clouds are the
// same bytes everywhere, and any difference in a hash comes from the library.
#pragma once

#include <cstdint>
#include <vector>

#include "pipeline/overtake.h"

namespace overtake::test {

inline constexpr int32_t kGoldenFrames = 24, kGoldenSensors = 3;
inline constexpr int64_t kGoldenPeriodNs = 50000000;

struct GoldenPoint {
  float x_m, y_m, z_m, intensity;
  uint16_t layer, unused;
  uint32_t time_ns;
};

std::vector<ovt_sensor_def> golden_sensors();
// Sensor frame, interleaved rings of two heads, like the recorded clouds.
std::vector<GoldenPoint> golden_cloud(int32_t frame, int32_t sensor);
int64_t golden_stamp_ns(int32_t frame, int32_t sensor);
ovt_ego_pose golden_ego(int64_t stamp_ns);

// A straight track. The columns point into this object.
struct GoldenMap {
  GoldenMap();
  std::vector<double> x_m, y_m, width_m;
  ovt_map_def def;
};

}  // namespace overtake::test
