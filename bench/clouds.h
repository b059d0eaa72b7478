// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// Input of the benchmarks: recorded scans if present, else the scene of tests/support/scene.h; and seeded clouds of any
// size that resemble them (with pure noise, code without branches would look too good).
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "core/sensor_model.h"
#include "pipeline/overtake.h"

namespace overtake::bench {

// 24 bytes, like a point of most drivers.
struct CloudPoint {
  float x_m, y_m, z_m, intensity;
  uint16_t layer, unused;
  uint32_t time_ns;
};

struct Cloud {
  std::string name;  // "racecar_front", "32x857", ...
  std::vector<CloudPoint> points;
  ovt_sensor_def sensor;
};

SensorModel to_sensor_model(const ovt_sensor_def& def);

// Ground, two walls, boxes, 1 cm of noise, 8 % missing; ring by ring. 120 degrees for 32 x 857, else a full turn.
Cloud make_cloud(int32_t rows, int32_t cols);
// A 32 x 857 scan with all points in the same pixel.
Cloud make_one_pixel_cloud();
// racecar_front, _left and _right of one of the recorded frames.
inline constexpr int32_t kRacecarFrames = 4;
std::vector<Cloud> racecar_clouds(int32_t frame = 0);
// One scan of kitti (64 x 2048) or nuscenes (32 x 1084); without recordings a seeded one of that size.
Cloud kitti_cloud();
Cloud nuscenes_cloud();
// "recorded" or "simulated".
const char* cloud_source();

}  // namespace overtake::bench
