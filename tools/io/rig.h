// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// The sensors of a vehicle, from a TOML file (examples in tools/rigs) or by the name of a built-in rig.
//
//   name = "av21"                 # default: the file's name
//   period_s = 0.05               # of all sensors; without stamps, a frame's stamp is its number times this
//   cloud_frame = "sensor"        # or "vehicle": points are in the vehicle frame, and only the sensor's position is
//                                 # subtracted; its mounting must have no rotation
//   shared_cloud = false          # true: one cloud per frame holds the points of all sensors; layers separate them
//   time_unit = "auto"            # of a time field: "s", "ms", "us", "ns"; auto: floats are s, integers ns
//   [topics]                      # for recordings with topics (rosbag2, MCAP); lists: the first existing topic counts.
//                                 # A topic may contain one *, which matches the same text in all topics of the ego
//                                 # vehicle ("/vehicle_*/local_odometry") and another text in the opponent's
//   ego = ["/ego/odometry"]       # poses of the ego vehicle (default), nav_msgs/msg/Odometry
//   opponent = ["/opponent/odometry"]   # of another car: truth, shown and never used
//   [capacities]                  # rows of the detector's tables; missing ones have the library's defaults
//   clusters = 4096   candidates = 256   tracks = 256   ego_poses = 1024
//   [[sensor]]                    # 1 to 8 of them
//   name = "front"                # FRAME_front.pcd
//   x_m = 2.342   y_m = 0.0   z_m = 0.646   roll_deg = 0   pitch_deg = 0   yaw_deg = 0   # mounting, sensor to vehicle
//   rows = 32   cols = 857                                  # image
//   azimuth_left_deg = 60   azimuth_right_deg = -60         # its edges; no right edge if it wraps
//   wraps = false                                           # true: a full turn (default of the left edge: 180)
//   range_min_m = 0.5   range_max_m = 300
//   layer_first = 0   layer_last = 65535                    # others are dropped, or belong to another sensor
//   topics = ["/front/points"]                              # default: /NAME/points, /luminar_NAME_points and similar
//   frame_id = "front"                                      # of its clouds, and of its link in a URDF; default: any
//   point_capacity = 65536
//   compensated_to_s = 0.0                                  # its driver compensates for the motion of the vehicle, to
//                                                           # so long after the scan's stamp; default: it does not
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace overtake::io {

enum class TimeUnit : int32_t { kAuto = 0, kSeconds, kMilliseconds, kMicroseconds, kNanoseconds };

struct RigSensor {
  std::string name;
  double x_m = 0, y_m = 0, z_m = 0, roll_deg = 0, pitch_deg = 0, yaw_deg = 0;
  int32_t rows = 32, cols = 857;
  double azimuth_left_deg = 60, azimuth_right_deg = -60;
  bool wraps = false;
  double range_min_m = 0.5, range_max_m = 300;
  int32_t layer_first = 0, layer_last = 65535;
  int32_t point_capacity = 65536;
  std::optional<double> compensated_to_s;
  std::vector<std::string> topics;
  std::string frame_id;
};

// Rows of the detector's tables; 0: not specified.
struct Capacities {
  int32_t clusters = 0, candidates = 0, tracks = 0, ego_poses = 0;
};
struct CapacityKey {
  const char* name;
  int32_t Capacities::*rows;
  int32_t most;
};
inline constexpr int32_t kMostPoints = 16'000'000;  // point_capacity of the library
inline constexpr CapacityKey kCapacityKeys[] = {{"clusters", &Capacities::clusters, 1'000'000},
                                                {"candidates", &Capacities::candidates, 4096},
                                                {"tracks", &Capacities::tracks, 4096},
                                                {"ego_poses", &Capacities::ego_poses, 1'000'000}};

struct Rig {
  std::string name;
  double period_s = 0.05;
  bool cloud_in_vehicle_frame = false;
  bool shared_cloud = false;
  TimeUnit time_unit = TimeUnit::kAuto;
  Capacities capacities;
  std::vector<std::string> ego_topics, opponent_topics;
  std::vector<RigSensor> sensors;

  int64_t period_ns() const { return int64_t(period_s * 1e9 + 0.5); }
  int32_t find(std::string_view sensor_name) const;  // -1: none
  std::string sensor_names() const;                  // "front, left, right"
};

// The name of a built-in rig, or else a file: ./NAME is a file of such a name. Throws Error with file and line.
Rig load_rig(const std::string& file_or_name);
Rig parse_rig(const std::string& path_in_errors, std::string_view text);
std::vector<std::string> builtin_rig_names();
// Text in the form of parse_rig. `prefix` precedes names of tables ("rig." for a file that contains more than the rig).
std::string format_rig(const Rig& rig, const std::string& prefix = "");

}  // namespace overtake::io
