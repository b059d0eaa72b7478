// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// One scan of one sensor as every kind of recording gives it, and how it is made from a cloud.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "tools/io/cloud.h"
#include "tools/io/rig.h"

namespace overtake::io {

// One scan of one sensor, sensor frame. Columns keep the types of the file.
struct SensorScan {
  int32_t sensor = 0;  // of the rig
  std::string path;
  int64_t stamp_ns = 0;
  int32_t count = 0;
  CloudColumn x, y, z, layer, intensity;  // intensity without bytes: the file has none
  std::vector<int32_t> time_offset_ns;    // empty: the file has no time
  // Where the scan is part of a shared cloud: row of each point in the file, and the file's number of points. Empty:
  // all.
  std::vector<int32_t> input_index;
  int32_t input_count = 0;
  std::string lines_how;  // how the lines were recovered; "": a field of the file says them
  std::string frame_id;   // what the recording says; "": nothing
};

// Where the opponent is known to be, vehicle frame, centre of the box.
struct Box {
  double x_m = 0, y_m = 0, z_m = 0, length_m = 0, width_m = 0, height_m = 0, yaw_rad = 0;
};

struct FrameScans {
  int64_t frame = 0;
  std::vector<SensorScan> scans;  // ordered by sensor; a missing sensor is missing
  std::optional<Box> opponent;    // where the recording says it itself
};

// The points of one sensor out of a cloud; `path` names it in errors. Layers that belong to another sensor of a shared
// cloud are left out; layers that belong to none stay in, so that they are counted as bad. Where no field gives the
// layer, lines are recovered (line_recovery.h) and lines_how says so. Throws Error where that is not possible, or a
// field that is needed is missing.
SensorScan make_scan(const std::string& path, Cloud cloud, const Rig& rig, int32_t sensor, int64_t stamp_ns);

}  // namespace overtake::io
