// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// The output of a simulated race. Both kinds contain the same: clouds with truth per point, ego poses, map, rig, and
// the true state of every car at every stamp.
#pragma once

#include <memory>
#include <string>

#include "tools/sim/simulator.h"

namespace overtake::sim {

// Written times start here (14 November 2023), so that readers recognise them as points in time.
inline constexpr int64_t kEpochNs = 1'700'000'000'000'000'000;

class LogWriter {
 public:
  virtual ~LogWriter() = default;
  virtual void write(int32_t index, const SimFrame& frame) = 0;
  // partial: why the log ends early, "" if it is complete. Throws io::Error when the disk is full.
  virtual void close(const std::string& partial = "") = 0;
};

// Whether the name of a log is that of an MCAP file, and not of a folder. Throws io::Error, naming `place`, for another
// extension, which is a typing error; a folder that has one exists, or ends with a slash.
bool is_mcap_name(const std::string& out, const std::string& place);

// A folder as `overtake run` reads it:
//   NNNNNN_{front,left,right}.pcd   x y z intensity ring t (absolute, ns) surface return; sensor frame
//   ego.csv    the localisation's output                map.csv    the surveyed map         rig.toml
//   truth.csv  every car at the true start of every frame    scenario.txt
std::unique_ptr<LogWriter> make_folder_log(const std::string& folder, const Simulator& simulator, uint64_t seed);
// One MCAP file (README.md lists its channels).
std::unique_ptr<LogWriter> make_mcap_log(const std::string& path, const Simulator& simulator, uint64_t seed);

// The rows of truth.csv for one moment: frame,stamp_ns,car,name,is_ego,x_m,...
inline constexpr const char* kTruthHeader =
    "frame,stamp_ns,car,name,is_ego,x_m,y_m,z_m,roll_rad,pitch_rad,heading_rad,course_rad,speed_mps,yaw_rate_rps,"
    "accel_along_mps2,accel_across_mps2,s_m,d_m,length_m,width_m,ego_x_m,ego_y_m,ego_heading_rad";

// A car's state at one moment, as both kinds of log write it. The position is the middle of the car on the road (4.921
// by 1.886 m around it), in the map and in the ego's true vehicle frame.
struct TruthRow {
  int32_t car;
  std::string name;
  bool is_ego;
  Vec3 center;
  RollPitchYaw angles;
  CarState state;
  Vec3 in_ego;
  double heading_in_ego;
};
std::vector<TruthRow> truth_at(const World& world, double time_s);
std::string rig_text(const Simulator& simulator);
std::string map_text(const Simulator& simulator);

}  // namespace overtake::sim
