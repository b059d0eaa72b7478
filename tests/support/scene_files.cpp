// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
#include "tests/support/scene_files.h"

#include <cmath>
#include <cstdio>

#include "tests/support/scene.h"
#include "tools/io/csv.h"
#include "tools/io/output.h"
#include "tools/io/pcd.h"

namespace overtake {
namespace {

void write_scan(const std::string& path, const SceneScan& scan) {
  std::vector<uint32_t> time_ns(scan.time_offset_s.size());
  for (std::size_t i = 0; i < time_ns.size(); ++i)
    time_ns[i] = uint32_t(std::lround(double(scan.time_offset_s[i]) * 1e9));
  io::Cloud cloud;
  io::add_column(cloud, "x", io::ValueType::kFloat32, scan.x_m);
  io::add_column(cloud, "y", io::ValueType::kFloat32, scan.y_m);
  io::add_column(cloud, "z", io::ValueType::kFloat32, scan.z_m);
  io::add_column(cloud, "intensity", io::ValueType::kFloat32, scan.intensity);
  io::add_column(cloud, "ring", io::ValueType::kUint16, scan.layer);
  io::add_column(cloud, "t", io::ValueType::kUint32, time_ns);
  io::write_pcd(path, cloud);
}

void write_ego(const std::string& path, const Scene& scene, double end_s) {
  io::CsvWriter csv(path, "stamp_ns,x_m,y_m,z_m,roll_rad,pitch_rad,yaw_rad,speed_mps,yaw_rate_rps");
  for (int64_t stamp_ns = 0; double(stamp_ns) * 1e-9 <= end_s; stamp_ns += 10'000'000) {
    const ScenePose pose = scene.ego_at(double(stamp_ns) * 1e-9);
    csv.cell(stamp_ns).cell(pose.x_m).cell(pose.y_m).cell(pose.z_m).cell(pose.roll_rad).cell(pose.pitch_rad);
    csv.cell(pose.yaw_rad).cell(pose.speed_mps).cell(pose.yaw_rate_rps).end_row();
  }
  csv.flush();
}

void write_map(const std::string& path, const SceneMap& map) {
  io::CsvWriter csv(path, "x_m,y_m,w_tr_right_m,w_tr_left_m,banking_rad");
  for (std::size_t i = 0; i < map.x_m.size(); ++i) {
    csv.cell(map.x_m[i]).cell(map.y_m[i]).cell(map.width_right_m[i]).cell(map.width_left_m[i]);
    csv.cell(map.banking_rad[i]).end_row();
  }
  csv.flush();
}

}  // namespace

void write_scene_files(const std::string& folder, int frames) {
  io::make_output_folder(folder);
  const Scene scene(1);
  io::CsvWriter truth(
      folder + "/truth.csv",
      "frame,stamp_ns,x_m,y_m,z_m,heading_rad,length_m,width_m,map_x_m,map_y_m,map_heading_rad,speed_mps");
  for (int32_t index = 0; index < frames; ++index) {
    const SceneFrame frame = scene.frame(index);
    for (int32_t s = 0; s < kSceneSensors; ++s) {
      char name[32];
      std::snprintf(name, sizeof name, "/%06d_%s.pcd", index, kSceneSensorName[s]);
      write_scan(folder + name, frame.scan[s]);
    }
    truth.cell(index).cell(frame.stamp_ns).cell(frame.opponent_x_m).cell(frame.opponent_y_m).cell(frame.opponent_z_m);
    truth.cell(frame.opponent_yaw_rad).cell(Scene::kOpponentLengthM).cell(Scene::kOpponentWidthM);
    truth.cell(frame.opponent.x_m).cell(frame.opponent.y_m).cell(frame.opponent.yaw_rad).cell(frame.opponent.speed_mps);
    truth.end_row();
  }
  truth.flush();
  write_ego(folder + "/ego.csv", scene, (frames + 1) * scene.def().period_s);
  write_map(folder + "/map.csv", scene.map());
}

}  // namespace overtake
