// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// The node's entry in the graph of ROS 2, for `ros2 node list` and `ros2 topic info -v`: the names of the node and the
// GUIDs of its readers and writers, published on ros_discovery_info as the middleware layers of ROS 2 do.
#pragma once

#include <dds/dds.h>

#include <cstdint>
#include <string>

#include "tools/ros2/names.h"
#include "tools/ros2/participant.h"

namespace overtake::ros2 {

class Graph {
 public:
  // gid_bytes: of a GUID in the message, 16 or 24 (gid_bytes_of). Throws io::Error.
  Graph(Participant& participant, const Names& names, int32_t gid_bytes);
  // Publishes the entry, if the participant has readers or writers that the last one lacks.
  void update();

 private:
  template <class Message, class Gid>
  void publish() const;

  const Participant& participant_;
  const std::string name_space_, node_;
  const int32_t gid_bytes_;
  dds_guid_t own_{};  // of this class's writer, which belongs to no node
  dds_entity_t writer_ = 0;
  std::size_t said_ = 0;  // readers and writers at the last publish()
};

}  // namespace overtake::ros2
