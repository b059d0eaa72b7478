// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// The surface that sample_road gives for a sensor, and what the height profile tells at a place of a road.
#pragma once

#include <doctest/doctest.h>

#include <cmath>
#include <cstdint>
#include <utility>
#include <vector>

#include "core/math.h"
#include "pipeline/road/height_profile.h"
#include "pipeline/road/sample_road.h"
#include "tests/support/circle_road.h"
#include "tests/support/images.h"
#include "tests/support/paper_params.h"

namespace overtake::test {

inline constexpr int32_t kHere = RoadData::kStations / 2;

struct Mounting {
  double x_m, y_m, z_m, roll_rad, pitch_rad, yaw_rad;
};
inline constexpr Mounting kLevel = {0.0, 0.0, 1.0, 0.0, 0.0, 0.0};
inline constexpr Mounting kMountings[] = {{2.3, 0.0, 0.65, 0.0, 0.0, 0.0},
                                          {1.5, 0.27, 0.74, 0.02, -0.03, 2.0 * kPi / 3.0},
                                          {1.5, -0.27, 0.74, -0.05, 0.04, -2.0 * kPi / 3.0},
                                          {2.3, 0.0, 0.65, 0.03, 0.05, 0.1}};

inline SensorModel make_sensor(const Mounting& m, int32_t cols = 857, bool wraps = false) {
  const double left = wraps ? kPi : kPi / 3.0, right = wraps ? -kPi : -kPi / 3.0;
  SensorModel sensor = make_sensor_model(32, cols, left, right, wraps, 0.5, 300.0);
  sensor.T_vehicle_sensor = make_transform(m.x_m, m.y_m, m.z_m, m.roll_rad, m.pitch_rad, m.yaw_rad);
  return sensor;
}

struct Scan {
  explicit Scan(const SensorModel& sensor) : range(sensor.rows, sensor.cols), elevation(sensor.rows, sensor.cols) {
    range.fill(kNoReturn), elevation.fill(0.0f);
  }
  OwnedPlane<float> range, elevation;
};

struct Sampled {
  Sampled(const RoadData& road, const SensorModel& of) : Sampled(road, of, Scan(of)) {}
  Sampled(const RoadData& road, const SensorModel& of, Scan scan) : sensor(of), rays(count_rays(of.cols)) {
    const std::size_t nodes = std::size_t(rays * kNodes);
    // One guard value behind each column.
    offset_m.assign(nodes + 1, kGuard), slope.assign(nodes + 1, kGuard);
    for (auto* column : {&level_slope, &known_m, &bound_per_m, &last_bound_per_m})
      column->assign(std::size_t(rays) + 1, kGuard);
    sample_road(*find_kernels("ref"), paper_params(sensor).running_ground, road, sensor, scan.range, scan.elevation,
                {offset_m.data(), slope.data(), level_slope.data(), known_m.data(), bound_per_m.data(),
                 last_bound_per_m.data()});
    for (const auto* column : {&offset_m, &slope, &level_slope, &known_m, &bound_per_m, &last_bound_per_m}) {
      CHECK(column->back() == kGuard);
      bool written = true;
      for (std::size_t i = 0; i + 1 < column->size(); ++i) written &= (*column)[i] != kGuard;
      CHECK(written);
    }
  }
  double azimuth(int32_t ray) const {
    return double(sensor.azimuth_left_rad) - ray * kRayColumns * double(sensor.pitch_rad);
  }
  // As running_ground reads it.
  double height(int32_t ray, double distance_m) const {
    const int32_t piece = std::min(int32_t(std::sqrt(distance_m / double(kNodeScale_m))), kNodes - 1);
    const std::size_t at = std::size_t(ray * kNodes + piece);
    return double(offset_m[at]) + double(slope[at]) * distance_m;
  }
  bool is_finite() const {
    bool finite = true;
    for (const auto* column : {&offset_m, &slope, &level_slope, &known_m, &bound_per_m, &last_bound_per_m})
      for (const float value : *column) finite &= std::isfinite(value);
    return finite;
  }
  int32_t known_count() const {
    int32_t count = 0;
    for (int32_t k = 0; k < rays; ++k) count += known_m[std::size_t(k)] > 0.0f;
    return count;
  }
  static constexpr float kGuard = -12345.0f;
  SensorModel sensor;
  int32_t rays;
  std::vector<float> offset_m, slope, level_slope, known_m, bound_per_m, last_bound_per_m;
};

// What the height profile tells a vehicle at the place. With all heights known.
inline RoadData data_at(const CircleRoad& road, double s_m, double d_m, double pitch_rad = 0.0) {
  EgoBuffer buffer(512);
  EgoPose pose = road.pose_at(s_m, d_m);
  pose.pitch_rad = pitch_rad;
  REQUIRE(buffer.push(pose) == OVT_OK);
  HeightProfile profile;
  REQUIRE(profile.build(&road.map, default_allocator()));
  RoadData data;
  profile.describe(buffer, buffer.range(), 0, data);
  REQUIRE(data.map == &road.map);
  for (int32_t k = 0; k < RoadData::kStations; ++k) {
    const double s = data.s_m + (k - kHere) * RoadData::kStation_m;
    data.known[k] = true;
    data.height_m[k] = float(road.height(s) - pose.z_m);
    data.cross_slope[k] = float(road.slope(s));
  }
  return data;
}

// The height in the sensor's axes at which a vertical line of these axes meets a surface z(x, y) of the map.
template <class Surface>
double exact_height(const RoadData& data, const SensorModel& sensor, double azimuth_rad, double distance_m,
                    Surface&& surface, double* map_x = nullptr, double* map_y = nullptr) {
  const Transform& m = sensor.T_vehicle_sensor;
  const auto above = [&](double z) {
    const double p[3] = {distance_m * std::cos(azimuth_rad), distance_m * std::sin(azimuth_rad), z};
    double v[3], w[3];
    for (int32_t i = 0; i < 3; ++i) {
      v[i] = double(m.t[i]);
      for (int32_t j = 0; j < 3; ++j) v[i] += double(m.r[3 * i + j]) * p[j];
    }
    const double origin[3] = {data.ego.pose.x_m, data.ego.pose.y_m, data.ego.pose.z_m};
    for (int32_t i = 0; i < 3; ++i) {
      w[i] = origin[i];
      for (int32_t j = 0; j < 3; ++j) w[i] += data.ego.r[3 * i + j] * v[j];
    }
    if (map_x) *map_x = w[0];
    if (map_y) *map_y = w[1];
    return w[2] - surface(w[0], w[1]);
  };
  double low = -200.0, high = 200.0;
  for (int32_t i = 0; i < 60; ++i) (above(0.5 * (low + high)) > 0.0 ? high : low) = 0.5 * (low + high);
  return low;
}

}  // namespace overtake::test
