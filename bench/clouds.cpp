// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
#include "bench/clouds.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <random>
#include <system_error>

#include "tests/support/scene.h"
#include "tools/client/session.h"
#include "tools/io/angles.h"
#include "tools/io/recording.h"

namespace overtake::bench {
namespace {

// As the tests find them.
std::string data_folder() {
  const char* folder = std::getenv("OVERTAKE_DATA");
  return folder && *folder ? folder : "recordings";
}
bool has_recorded(const std::string& name) {
  std::error_code code;
  return std::filesystem::is_directory(data_folder() + "/" + name, code);
}

std::vector<Cloud> read_clouds(const std::string& name, const std::string& rig_name, std::size_t frame = 0) {
  const io::Recording recording(data_folder() + "/" + name, io::load_rig(rig_name));
  std::vector<Cloud> clouds;
  for (const io::SensorScan& scan : recording.read(frame).scans) {
    const io::RigSensor& sensor = recording.rig().sensors[std::size_t(scan.sensor)];
    Cloud cloud{name + "_" + sensor.name, {}, cli::to_sensor_def(sensor)};
    for (std::size_t i = 0; i < std::size_t(scan.count); ++i)
      cloud.points.push_back({float(scan.x.value(i)), float(scan.y.value(i)), float(scan.z.value(i)),
                              scan.intensity.bytes.empty() ? 0.0f : float(scan.intensity.value(i)),
                              uint16_t(scan.layer.integer(i)), 0,
                              scan.time_offset_ns.empty() ? 0u : uint32_t(scan.time_offset_ns[i])});
    clouds.push_back(std::move(cloud));
  }
  return clouds;
}

}  // namespace

SensorModel to_sensor_model(const ovt_sensor_def& def) {
  SensorModel model = make_sensor_model(def.rows, def.cols, def.azimuth_left_rad, def.azimuth_right_rad, def.wraps != 0,
                                        def.range_min_m, def.range_max_m);
  model.T_vehicle_sensor = make_transform(def.x_m, def.y_m, def.z_m, def.roll_rad, def.pitch_rad, def.yaw_rad);
  model.mounting_yaw_rad = float(def.yaw_rad);
  return model;
}

Cloud make_cloud(int32_t rows, int32_t cols) {
  io::RigSensor sensor;
  sensor.rows = rows;
  sensor.cols = cols;
  sensor.wraps = rows != 32 || cols != 857;
  sensor.azimuth_left_deg = sensor.wraps ? 180 : 60;
  sensor.azimuth_right_deg = -sensor.azimuth_left_deg;
  sensor.point_capacity = rows * cols;
  Cloud cloud{std::to_string(rows) + "x" + std::to_string(cols), {}, cli::to_sensor_def(sensor)};
  std::mt19937 random(7);
  const auto uniform = [&] { return double(random() % 65536) / 65536.0; };
  for (int32_t r = 0; r < rows; ++r)
    for (int32_t c = 0; c < cols; ++c) {
      const double elevation = io::rad(8.0 - 30.0 * (r + 0.5) / rows);
      const double left = sensor.azimuth_left_deg;
      const double azimuth = io::rad(left - (left - sensor.azimuth_right_deg) * (c + 0.5) / cols);
      const double dx = std::cos(elevation) * std::cos(azimuth), dy = std::cos(elevation) * std::sin(azimuth);
      const double dz = std::sin(elevation);
      double range = dz < 0 ? -1.8 / dz : 1000.0;
      // A wall 3 m high on both sides, then cars: 4.8 x 1.9 x 1.2 m every 17 m on two lanes.
      if (dy != 0) {
        const double wall = 9.0 / std::fabs(dy);
        if (wall * dz < 1.2) range = std::min(range, wall);
      }
      for (int32_t car = -4; car <= 6; ++car) {
        const double x = 17.0 * car + 9.0, y = car % 2 == 0 ? 2.5 : -3.0;
        const double tx0 = (x - 2.4) / dx, tx1 = (x + 2.4) / dx;
        const double ty0 = (y - 0.95) / dy, ty1 = (y + 0.95) / dy;
        const double enter = std::max(std::min(tx0, tx1), std::min(ty0, ty1));
        const double leave = std::min(std::max(tx0, tx1), std::max(ty0, ty1));
        if (enter > 0 && enter < leave && enter * dz < -0.6) range = std::min(range, enter);
      }
      if (range > 200.0 || uniform() < 0.08) continue;
      range += 0.01 * (uniform() + uniform() + uniform() - 1.5) * 2.0;
      cloud.points.push_back({float(range * dx), float(range * dy), float(range * dz), float(random() % 256),
                              uint16_t(r), 0, uint32_t(int64_t(45000000) * r / rows)});
    }
  return cloud;
}

Cloud make_one_pixel_cloud() {
  Cloud cloud = make_cloud(32, 857);
  cloud.name = "one_pixel";
  cloud.points.resize(22000);
  for (std::size_t i = 0; i < cloud.points.size(); ++i)
    cloud.points[i] = {20.0f + 0.0001f * float(i), 0.01f, -0.2f, float(i % 7), 5, 0, 0};
  return cloud;
}

std::vector<Cloud> racecar_clouds(int32_t frame) {
  if (has_recorded("racecar")) return read_clouds("racecar", "av21", std::size_t(frame));
  const io::Rig rig = io::load_rig("av21");
  const SceneFrame simulated = Scene(1).frame(std::size_t(4 + frame));
  std::vector<Cloud> clouds;
  for (std::size_t s = 0; s < std::size_t(kSceneSensors); ++s) {
    Cloud cloud{std::string("racecar_") + kSceneSensorName[s], {}, cli::to_sensor_def(rig.sensors[s])};
    const SceneScan& scan = simulated.scan[s];
    for (std::size_t i = 0; i < scan.x_m.size(); ++i)
      cloud.points.push_back({scan.x_m[i], scan.y_m[i], scan.z_m[i], scan.intensity[i], scan.layer[i], 0,
                              uint32_t(double(scan.time_offset_s[i]) * 1e9)});
    clouds.push_back(std::move(cloud));
  }
  return clouds;
}

Cloud kitti_cloud() {
  Cloud cloud = has_recorded("kitti") ? read_clouds("kitti", "hdl64")[0] : make_cloud(64, 2048);
  cloud.name = "kitti";
  return cloud;
}

Cloud nuscenes_cloud() {
  Cloud cloud = has_recorded("nuscenes") ? read_clouds("nuscenes", "nuscenes")[0] : make_cloud(32, 1084);
  cloud.name = "nuscenes";
  return cloud;
}

const char* cloud_source() { return has_recorded("racecar") ? "recorded" : "simulated"; }

}  // namespace overtake::bench
