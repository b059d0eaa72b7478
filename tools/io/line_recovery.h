// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// Which line of its sensor each point belongs to, where the recording does not say: from the order in which the points
// were taken, else from their elevations.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "tools/io/rig.h"

namespace overtake::io {

struct RecoveredLines {
  std::vector<uint16_t> line;  // one a point; empty: not to be recovered. 65535: no valid point
  int32_t count = 0;
  std::string how;  // "32 lines recovered from the order of the points (one sweep a line)"
};

// Order: the azimuth sweeps over the field of view (one head, two heads with half of it each, a full turn) and jumps
// back where a line ends; a line is counted where it starts, so a line without any return is not. Elevation: points
// of one line lie closer together than neighbouring lines; line 0 is the highest. Columns of `count` floats, sensor
// frame.
RecoveredLines recover_lines(const float* x_m, const float* y_m, const float* z_m, int32_t count,
                             const RigSensor& sensor);

}  // namespace overtake::io
