// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// Scenes with exact solutions: a sensor at the origin whose beams hit planes and boxes.
#pragma once

#include <cmath>
#include <limits>
#include <vector>

#include "tests/support/segment_chain.h"

namespace overtake::test {

inline constexpr double kDegree = 3.14159265358979323846 / 180.0;

// n . p = offset. Unbounded.
struct ScenePlane {
  double nx, ny, nz, offset_m;
};
// Axis-aligned.
struct SceneBox {
  double min[3], max[3];
};

struct RayScene {
  std::vector<ScenePlane> planes;
  std::vector<SceneBox> boxes;

  // Distance along the unit direction to the first surface; infinite if there is none.
  double cast(const double direction[3]) const {
    double nearest = std::numeric_limits<double>::infinity();
    for (const ScenePlane& p : planes) {
      const double along = p.nx * direction[0] + p.ny * direction[1] + p.nz * direction[2];
      if (std::fabs(along) > 1e-12 && p.offset_m / along > 0) nearest = std::fmin(nearest, p.offset_m / along);
    }
    for (const SceneBox& box : boxes) {
      double in = 0, out = std::numeric_limits<double>::infinity();
      for (int axis = 0; axis < 3; ++axis) {
        if (std::fabs(direction[axis]) < 1e-12) {
          if (box.min[axis] > 0 || box.max[axis] < 0) in = std::numeric_limits<double>::infinity();
          continue;
        }
        const double a = box.min[axis] / direction[axis], b = box.max[axis] / direction[axis];
        in = std::fmax(in, std::fmin(a, b));
        out = std::fmin(out, std::fmax(a, b));
      }
      if (in < out) nearest = std::fmin(nearest, in);
    }
    return nearest;
  }

  // One point per beam with a hit within the sensor's range: through the middle of each column, with the elevations of
  // the `rows` layers evenly spaced from top to bottom.
  std::vector<TestPoint> scan(const SensorModel& sensor, double top_rad, double bottom_rad) const {
    std::vector<TestPoint> cloud;
    for (int32_t r = 0; r < sensor.rows; ++r)
      for (int32_t c = 0; c < sensor.cols; ++c) {
        const double e = sensor.rows > 1 ? top_rad + (bottom_rad - top_rad) * r / (sensor.rows - 1) : top_rad;
        const double a = double(sensor.azimuth_left_rad) - (c + 0.5) * double(sensor.pitch_rad);
        const double direction[3] = {std::cos(e) * std::cos(a), std::cos(e) * std::sin(a), std::sin(e)};
        const double range = cast(direction);
        if (range > double(sensor.range_max_m)) continue;
        cloud.push_back(
            {float(range * direction[0]), float(range * direction[1]), float(range * direction[2]), 1.0f, float(r)});
      }
    return cloud;
  }
};

}  // namespace overtake::test
