// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// KITTI's Velodyne scans: float32 x y z intensity, point after point, nothing else.
#pragma once

#include <string>

#include "tools/io/cloud.h"

namespace overtake::io {

// Throws Error: not a whole number of points.
Cloud parse_kitti_bin(const std::string& path_in_errors, const std::string& bytes);

// Writes x, y, z and intensity (0 if the cloud has none) of each point.
std::string format_kitti_bin(const Cloud& cloud);

}  // namespace overtake::io
