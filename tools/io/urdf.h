// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// Mounting from a URDF, the robot description of ROS: links, and joints that define one link's pose in another.
#pragma once

#include <string>

#include "tools/io/rig.h"

namespace overtake::io {

// Replaces the mounting of every sensor of the rig by the pose of its link (frame_id, else its name) in the base link:
// the one named after a comma ("car.urdf,base_link"), else the root. The base link should be on the road under the rear
// axle. Movable joints are at position 0. Throws Error if the file is missing or not a URDF, a link is missing, or
// links form a circle.
void mount_by_urdf(Rig& rig, const std::string& file_and_link);

}  // namespace overtake::io
