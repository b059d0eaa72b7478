// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// One scan of one sensor, the same for every recording format, and its construction from a cloud.
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
  int32_t sensor = 0;  // index in the rig
  std::string path;
  int64_t stamp_ns = 0;
  int32_t count = 0;
  CloudColumn x, y, z, layer, intensity;  // intensity without bytes: the file has none
  std::vector<int32_t> time_offset_ns;    // empty: the file has no time
  // For a scan from a shared cloud: row of each point in the file, and the file's number of points. Empty: all rows.
  std::vector<int32_t> input_index;
  int32_t input_count = 0;
  std::string lines_how;  // how the lines were recovered; "": the file has a field of lines
  std::string frame_id;   // from the recording; "": unknown
};

// Known position of the opponent: centre of its box, vehicle frame.
struct Box {
  double x_m = 0, y_m = 0, z_m = 0, length_m = 0, width_m = 0, height_m = 0, yaw_rad = 0;
};

// True state of another car, map frame: truth, never input. NaN: unknown.
struct KnownCar {
  int32_t id = 0;
  std::string name;
  double x_m = 0, y_m = 0, z_m = 0;  // centre of its box; z_m: above the own car's
  double heading_rad = 0, speed_mps = 0, length_m = 0, width_m = 0;
};

struct FrameScans {
  int64_t frame = 0;
  std::vector<SensorScan> scans;  // ordered by sensor; a missing one has no entry
  std::optional<Box> opponent;    // if the recording has it
  std::vector<KnownCar> cars;     // at the last scan's stamp, if the recording has them
};

// Takes one sensor's points from a cloud; `path` names the cloud in errors. Leaves out layers of another sensor of a
// shared cloud, but keeps layers of no sensor, so that the library counts them as bad. Without a ring field, recovers
// the lines (line_recovery.h) and describes how in lines_how. Throws Error if that fails or a needed field is missing.
SensorScan make_scan(const std::string& path, Cloud cloud, const Rig& rig, int32_t sensor, int64_t stamp_ns);

}  // namespace overtake::io
