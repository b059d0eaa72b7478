// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// The scene as a folder that `overtake run` takes, for tests of the command line:
//
//   FRAME_front.pcd, FRAME_left.pcd, FRAME_right.pcd   x y z intensity ring t (ns after the stamp), sensor frame, raw
//   ego.csv     poses at 100 Hz, map frame                map.csv   centre line, widths and banking
//   truth.csv   the opponent at each frame's stamp: middle of the car on the road, vehicle frame and map frame
#pragma once

#include <string>

namespace overtake {

// Throws io::Error.
void write_scene_files(const std::string& folder, int frames);

}  // namespace overtake
