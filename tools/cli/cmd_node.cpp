// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// overtake node: detects and tracks live in a ROS 2 domain, until Ctrl-C.
#include "tools/cli/command.h"
#include "tools/cli/command_options.h"
#include "tools/client/console.h"
#include "tools/io/error.h"
#include "tools/io/rig.h"
#include "tools/io/text.h"
#include "tools/ros2/node.h"

namespace overtake::cli {
namespace {

struct LiveOptions : Options {
  ros2::NodeOptions node;
  bool no_tf = false;
};

int run_live(const LiveOptions& given) {
  LiveOptions options = given;
  options.node.quiet = options.quiet;
  options.node.publish_tf = !options.no_tf;
  ros2::complete(options.node, options.config);
  const Config config = load_config(options);
  if (!config.has_rig)
    throw io::Error("", 0, "--rig is needed: a TOML file, or " + io::join(io::builtin_rig_names(), ", "));
  if (!config.ego.empty()) throw io::Error("ego", 0, "a node takes its ego poses from a topic, not from a file");
  ros2::run_node(config, options.node);
  return kInterrupted;
}

void add_live_options(CLI::App& command, LiveOptions& options) {
  options.command = "node";
  ros2::NodeOptions& node = options.node;
  add_rig_options(command, options, "that of --config");
  add_map_option(command, options.map, "that of --config");
  add_parameter_options(command, options);
  command.add_option("--workers", options.workers, "threads; 1: the main thread only (default), 0: one per CPU")
      ->check(CLI::Range(0, 256));
  command.add_option("--domain", node.domain, "DDS domain (default: ROS_DOMAIN_ID, else 0)")
      ->check(CLI::Range(0, ros2::kMostDomain));
  command.add_option("--interface", node.interface,
                     "network interface, as eth0; lo: this machine only (default: Cyclone DDS chooses)");
  command.add_option("--namespace", node.name_space, "of the node's topics, as /car1");
  command.add_option("--name", node.name, "of the node (default: overtake)");
  command
      .add_option("--remap", node.remaps,
                  "FROM:=TO: another name for a topic (front/points:=/sensing/front, ~/tracks:=/cars); may be repeated")
      ->expected(1)
      ->take_all();
  command.add_flag("--use-sim-time", node.use_sim_time, "takes the time from /clock");
  command.add_option("--map-frame", node.map_frame,
                     "frame_id of the map (default: header.frame_id of the first ego pose)");
  command.add_option(
      "--vehicle-frame", node.vehicle_frame,
      "frame_id of the vehicle, at its rear axle on the ground (default: child_frame_id of the first pose)");
  command
      .add_option("--deadline-ms", node.deadline_ms,
                  "from the arrival of a frame's last scan to its tracks; later frames are counted (default: the rig's "
                  "period)")
      ->check(in_range(0.0, 60000.0));
  command.add_flag("--no-tf", options.no_tf, "does not publish the sensors' mounting on /tf_static");
  command.add_option("--ros-distro", node.ros_distro,
                     "release of the other nodes, humble, jazzy, ...: the form of the entry in their graph, for ros2 "
                     "node list (default: ROS_DISTRO, else humble)");
  add_quiet_option(command, options.quiet);
}

}  // namespace

Command node_command() {
  return make_command("node", "detects and tracks live in a ROS 2 domain", kListed, add_live_options, run_live);
}

}  // namespace overtake::cli
