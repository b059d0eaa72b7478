// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
#include <cstdio>
#include <filesystem>

#include "tools/io/csv.h"
#include "tools/io/output.h"
#include "tools/io/pcd.h"
#include "tools/io/text.h"
#include "tools/sim/log_writer.h"

namespace overtake::sim {
namespace {

namespace fs = std::filesystem;

class FolderLog : public LogWriter {
 public:
  FolderLog(const std::string& folder, const Simulator& simulator, uint64_t seed)
      : folder_(make(folder)), world_(simulator.world()), truth_((folder_ / "truth.csv").string(), kTruthHeader) {
    io::write_whole_file((folder_ / "rig.toml").string(), rig_text(simulator));
    if (!simulator.scenario().without_map) io::write_whole_file((folder_ / "map.csv").string(), map_text(simulator));
    std::string note = "scenario " + simulator.scenario().name + "\nseed " + std::to_string(seed) + "\nego " +
                       simulator.scenario().ego + "\n";
    io::write_whole_file((folder_ / "scenario.txt").string(), note);
    if (simulator.scenario().without_poses) return;
    io::CsvWriter ego((folder_ / "ego.csv").string(),
                      "stamp_ns,x_m,y_m,z_m,roll_rad,pitch_rad,yaw_rad,speed_mps,yaw_rate_rps,publish_ns");
    for (const EgoPose& p : simulator.ego_poses()) {
      ego.cell(kEpochNs + p.stamp_ns)
          .cell(p.x_m)
          .cell(p.y_m)
          .cell(p.z_m)
          .cell(p.roll_rad)
          .cell(p.pitch_rad)
          .cell(p.yaw_rad);
      ego.cell(p.speed_mps).cell(p.yaw_rate_rps).cell(kEpochNs + p.publish_ns).end_row();
    }
    ego.flush();
  }

  void write(int32_t index, const SimFrame& frame) override {
    for (int32_t s = 0; s < kSensors; ++s) {
      const Scan& scan = frame.scans[std::size_t(s)];
      std::vector<int64_t> time(scan.size());
      for (std::size_t i = 0; i < time.size(); ++i) time[i] = kEpochNs + frame.stamp_ns[s] + int64_t(scan.time_ns[i]);
      io::Cloud cloud;
      io::add_column(cloud, "x", io::ValueType::kFloat32, scan.x_m);
      io::add_column(cloud, "y", io::ValueType::kFloat32, scan.y_m);
      io::add_column(cloud, "z", io::ValueType::kFloat32, scan.z_m);
      io::add_column(cloud, "intensity", io::ValueType::kFloat32, scan.intensity);
      io::add_column(cloud, "ring", io::ValueType::kUint16, scan.ring);
      io::add_column(cloud, "t", io::ValueType::kInt64, time);
      io::add_column(cloud, "surface", io::ValueType::kUint16, scan.surface);
      io::add_column(cloud, "return", io::ValueType::kUint8, scan.return_number);
      char name[32];
      std::snprintf(name, sizeof name, "%06d_%s.pcd", index, kSensorName[s]);
      io::write_pcd((folder_ / name).string(), cloud);
    }
    for (const TruthRow& r : truth_at(world_, double(frame.begin_ns) * 1e-9)) {
      truth_.cell(index)
          .cell(kEpochNs + frame.begin_ns)
          .cell(r.car)
          .cell(std::string_view(r.name))
          .cell(int32_t(r.is_ego));
      truth_.cell(r.center.x).cell(r.center.y).cell(r.center.z);
      truth_.cell(r.angles.roll).cell(r.angles.pitch).cell(r.angles.yaw).cell(wrap_angle(r.state.course_rad));
      truth_.cell(r.state.speed_mps).cell(r.state.yaw_rate_rps).cell(r.state.accel_along_mps2);
      truth_.cell(r.state.accel_across_mps2).cell(r.state.s_m).cell(r.state.d_m).cell(kCarLengthM).cell(kCarWidthM);
      truth_.cell(r.in_ego.x).cell(r.in_ego.y).cell(r.heading_in_ego);
      truth_.end_row();
    }
  }

  void close(const std::string& partial) override {
    truth_.flush();
    io::OutputGuard* guard = io::OutputGuard::current();
    if (!guard || !partial.empty()) return;  // the file names of a partial one show that
    // Of another race: scans of a longer or an interrupted one, map and poses that this one lacks.
    for (const char* ending : {".pcd", "map.csv", "ego.csv"}) guard->remove_leftovers(folder_.string(), "", ending);
  }

 private:
  static fs::path make(const std::string& folder) {
    io::make_output_folder(folder);
    return folder;
  }

  fs::path folder_;
  const World& world_;
  io::CsvWriter truth_;
};

}  // namespace

std::unique_ptr<LogWriter> make_folder_log(const std::string& folder, const Simulator& simulator, uint64_t seed) {
  return std::make_unique<FolderLog>(folder, simulator, seed);
}

}  // namespace overtake::sim
