// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// Finds the ring of each point if the recording does not contain it: from the order of the points, else from their
// elevations.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "tools/io/rig.h"

namespace overtake::io {

struct RecoveredLines {
  std::vector<uint16_t> line;  // one per point; empty: not recoverable. 65535: no valid point
  int32_t count = 0;
  std::string how;  // "32 lines recovered from the order of the points (one sweep a line)"
};

// Order: the azimuth moves over the field of view (one head, two heads with half of it each, or a full turn) and jumps
// back at the end of a ring. A ring is counted at its start, so a ring without any return is not counted. Elevation:
// points of one ring are closer together than neighbouring rings; ring 0 is the highest. Columns of `count` floats,
// sensor frame.
RecoveredLines recover_lines(const float* x_m, const float* y_m, const float* z_m, int32_t count,
                             const RigSensor& sensor);

}  // namespace overtake::io
