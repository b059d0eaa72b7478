// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// The detector as a node of a ROS 2 domain, without a ROS installation (README.md).
#pragma once

#include "tools/client/config.h"
#include "tools/ros2/node_options.h"

namespace overtake::ros2 {

// Whether this program was built with Cyclone DDS.
bool is_built();
// Runs until Ctrl-C. `options` are complete (node_options.h). Throws io::Error.
void run_node(cli::Config config, const NodeOptions& options);

}  // namespace overtake::ros2
