// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// KITTI's Velodyne scans: float32 x y z intensity, point after point, nothing else.
#pragma once

#include <string>

#include "tools/io/pcd.h"

namespace overtake::io {

// Throws Error: no such file, not a whole number of points.
Pcd read_kitti_bin(const std::string& path);

}  // namespace overtake::io
