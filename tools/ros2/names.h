// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// Names of topics as ROS 2 resolves them, and as they are on the wire.
#pragma once

#include <set>
#include <string>
#include <vector>

namespace overtake::ros2 {

class Names {
 public:
  // name_space: "" or "/car1"; remaps: "from:=to"; those of the file count for names that the others do not have.
  // Throws io::Error for what ROS 2 refuses as a name, and for a name with two remaps.
  Names(std::string name_space, std::string node, const std::vector<std::string>& remaps,
        const std::vector<std::string>& file_remaps = {});

  // "ego/odometry" is /car1/ego/odometry, "~/tracks" is /car1/NODE/tracks, "/clock" stays; then the remaps apply.
  std::string resolve(const std::string& name);
  // Whether a remap names it; resolve() then gives its new name.
  bool is_remapped(const std::string& name) const;
  // Throws io::Error for a remap that no resolve() has used: a misspelled one.
  void check_used() const;
  const std::string& name_space() const { return name_space_; }
  const std::string& node() const { return node_; }

 private:
  struct Remap {
    std::string text, from, to;  // absolute names
  };
  void add(const std::vector<std::string>& remaps);
  Remap parse(const std::string& text) const;
  const Remap* find(const std::string& from) const;  // absolute; null: none
  std::string absolute(const std::string& name) const;

  std::string name_space_, node_;
  std::vector<Remap> remaps_;
  std::set<std::string> known_;
};

// "/front/points" is rt/front/points on the wire, and the type sensor_msgs/msg/PointCloud2 is
// sensor_msgs::msg::dds_::PointCloud2_. A name without a slash in front, and what is not of ROS 2, stays as it is.
std::string dds_topic_of(const std::string& name);
std::string ros_topic_of(const std::string& dds_name);
std::string ros_type_of(const std::string& dds_type);

}  // namespace overtake::ros2
