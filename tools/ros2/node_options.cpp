// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
#include "tools/ros2/node_options.h"

#include <cstdlib>

#include "tools/io/error.h"
#include "tools/io/text.h"
#include "tools/io/toml_reader.h"
#include "tools/io/words.h"

namespace overtake::ros2 {
namespace {

struct Release {
  const char* name;
  int32_t gid_bytes;
};
constexpr Release kReleases[] = {{"foxy", 24},  {"galactic", 24}, {"humble", 24}, {"iron", 16},
                                 {"jazzy", 16}, {"kilted", 16},   {"rolling", 16}};

void check_distro(const std::string& place, const std::string& name) {
  if (gid_bytes_of(name) != 0) return;
  std::vector<std::string> names;
  for (const Release& release : kReleases) names.emplace_back(release.name);
  throw io::Error(place, 0,
                  "'" + name + "' is not a release of ROS 2 that this node knows" + io::did_you_mean(name, names) +
                      "; it knows " + io::join(names, ", ") + " (for a later one: --ros-distro rolling)");
}

void read_table(NodeOptions& options, const std::string& config_file) {
  const std::string text = io::read_whole_file(config_file, io::kMostToml);
  const toml::table table = io::parse_toml(config_file, text);
  io::TomlReader whole(config_file, table);
  const toml::table* node = whole.only_table("node");
  if (!node) return;
  io::TomlReader reader(config_file, *node, "node");
  const auto take = [&](const char* key, std::string& value) {
    const std::string from_file = reader.text_or(key, "");
    if (value.empty()) value = from_file;
  };
  const auto domain = int32_t(reader.integer_or("domain", 0, kMostDomain, -1));
  if (options.domain < 0) options.domain = domain;
  take("interface", options.interface);
  take("namespace", options.name_space);
  take("name", options.name);
  take("map_frame", options.map_frame);
  take("vehicle_frame", options.vehicle_frame);
  const bool given = !options.ros_distro.empty();
  take("ros_distro", options.ros_distro);
  if (!given && !options.ros_distro.empty()) check_distro(config_file + ": node.ros_distro", options.ros_distro);
  for (const std::string& remap : reader.texts("remap")) options.file_remaps.push_back(remap);
  options.use_sim_time = reader.boolean_or("use_sim_time", false) || options.use_sim_time;
  options.publish_tf = reader.boolean_or("publish_tf", true) && options.publish_tf;
  const double deadline = reader.number_or("deadline_ms", 0, 60'000, -1);
  if (options.deadline_ms < 0) options.deadline_ms = deadline;
  reader.finish();
}

}  // namespace

int32_t gid_bytes_of(const std::string& ros_distro) {
  for (const Release& release : kReleases)
    if (ros_distro == release.name) return release.gid_bytes;
  return 0;
}

void complete(NodeOptions& options, const std::string& config_file) {
  if (!options.ros_distro.empty()) check_distro("--ros-distro", options.ros_distro);
  if (!config_file.empty()) read_table(options, config_file);
  const char* distro = std::getenv("ROS_DISTRO");
  if (options.ros_distro.empty() && distro && *distro) {
    options.ros_distro = distro;
    check_distro("ROS_DISTRO", options.ros_distro);
  }
  if (options.ros_distro.empty()) options.ros_distro = "humble";
  if (const char* text = std::getenv("ROS_DOMAIN_ID"); options.domain < 0 && text && *text) {
    int64_t domain = 0;
    if (!io::parse_integer(text, domain) || domain < 0 || domain > kMostDomain)
      throw io::Error("ROS_DOMAIN_ID", 0, "'" + std::string(text) + "' is not a domain id from 0 to 232");
    options.domain = int32_t(domain);
  }
  if (options.domain < 0) options.domain = 0;
  const char* local = std::getenv("ROS_LOCALHOST_ONLY");
  if (options.interface.empty() && local && std::string_view(local) == "1") options.interface = "lo";
  if (options.name.empty()) options.name = "overtake";
}

}  // namespace overtake::ros2
