// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// Ego poses from a CSV file with a header:
//   stamp_ns,x_m,y_m[,z_m][,roll_rad,pitch_rad],yaw_rad[,speed_mps][,yaw_rate_rps]
// Also accepted: timestamp_ns, or time in seconds; x, y, z; phi, psi, heading_rad for the yaw; vx; omega. Missing speed
// or yaw rate follows from the neighbouring poses. An attitude is both roll and pitch.
#pragma once

#include <cmath>
#include <cstdint>
#include <string>
#include <vector>

namespace overtake::io {

struct EgoRow {
  int64_t stamp_ns = 0;
  double x_m = 0, y_m = 0, z_m = 0, roll_rad = 0, pitch_rad = 0, yaw_rad = 0, speed_mps = 0, yaw_rate_rps = 0;
};

inline bool is_finite(const EgoRow& row) {
  return std::isfinite(row.x_m + row.y_m + row.z_m + row.roll_rad + row.pitch_rad + row.yaw_rad + row.speed_mps +
                       row.yaw_rate_rps);
}

// Rows with growing stamps. Throws Error with file, line and column. Adds to `notes` a sentence about columns that it
// does not read.
std::vector<EgoRow> read_ego_file(const std::string& path, std::vector<std::string>* notes = nullptr);

}  // namespace overtake::io
