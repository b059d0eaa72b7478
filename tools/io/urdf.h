// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// Mounting from a URDF, the robot description of ROS: links, and joints that place one link in another.
#pragma once

#include <string>

#include "tools/io/rig.h"

namespace overtake::io {

// Replaces the mounting of every sensor of the rig by where its link (frame_id, else its name) lies in the base link:
// the one named after a comma ("car.urdf,base_link"), else the root. Take one that lies on the road under the rear
// axle. Joints that move are taken as they stand at 0. Throws Error: no such file, no URDF, no such link, links in a
// circle.
void mount_by_urdf(Rig& rig, const std::string& file_and_link);

}  // namespace overtake::io
