// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// In place of node.cpp where Cyclone DDS is not installed.
#include "tools/io/error.h"
#include "tools/ros2/node.h"

namespace overtake::ros2 {

bool is_built() { return false; }

void run_node(cli::Config, const NodeOptions&) {
  throw io::Error("node", 0, "this overtake was built without Cyclone DDS (tools/setup --ros2, then build again)");
}

}  // namespace overtake::ros2
