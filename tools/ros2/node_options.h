// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// Options of `overtake node`, from the command line or the table [node] of its --config file:
//
//   [node]
//   domain = 0                  # default: ROS_DOMAIN_ID, else 0
//   interface = "eth0"          # default: Cyclone DDS chooses; lo with ROS_LOCALHOST_ONLY=1
//   namespace = "/car1"
//   name = "overtake"
//   remap = ["front/points:=/sensing/front/points"]
//   use_sim_time = false        # takes the time from /clock
//   map_frame = "map"           # of the ego poses; default: header.frame_id of the first pose
//   vehicle_frame = "base_link" # rear axle, on the ground; default: child_frame_id of the first pose
//   deadline_ms = 50            # from the last scan's arrival to its tracks; default: the rig's period
//   publish_tf = true           # static transforms of the sensors' mounting
//   ros_distro = "humble"       # of the other nodes: the form of the node's entry in their graph; default: ROS_DISTRO
#pragma once

#include <cstdint>
#include <string>
#include <vector>

namespace overtake::ros2 {

// Empty or negative: not given.
struct NodeOptions {
  int32_t domain = -1;
  std::string interface, name_space, name;
  std::vector<std::string> remaps, file_remaps;
  bool use_sim_time = false;
  std::string map_frame, vehicle_frame;
  double deadline_ms = -1;
  bool publish_tf = true, quiet = false;
  std::string ros_distro;
};
inline constexpr int32_t kMostDomain = 232;  // of the ports of RTPS

// Size of a GUID in the graph of a release of ROS 2: 24 up to Humble, 16 from Iron on; 0: an unknown name.
int32_t gid_bytes_of(const std::string& ros_distro);

// Fills what is not given from the table [node] of the file, then from the environment. Throws io::Error with the line.
void complete(NodeOptions& options, const std::string& config_file);

}  // namespace overtake::ros2
