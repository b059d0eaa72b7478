// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
#include "tools/io/ego_file.h"

#include <cmath>

#include "tools/io/angles.h"
#include "tools/io/csv.h"
#include "tools/io/error.h"
#include "tools/io/text.h"

namespace overtake::io {
namespace {

// Differences between the rows before and after; at the ends the row itself replaces the missing one.
void derive_rates(std::vector<EgoRow>& rows, bool speed, bool yaw_rate) {
  for (std::size_t i = 0; i < rows.size(); ++i) {
    const EgoRow& a = rows[i > 0 ? i - 1 : i];
    const EgoRow& b = rows[i + 1 < rows.size() ? i + 1 : i];
    const double dt = double(b.stamp_ns - a.stamp_ns) * 1e-9;
    if (dt <= 0) continue;  // a single row
    if (speed)
      rows[i].speed_mps =
          ((b.x_m - a.x_m) * std::cos(rows[i].yaw_rad) + (b.y_m - a.y_m) * std::sin(rows[i].yaw_rad)) / dt;
    if (yaw_rate) rows[i].yaw_rate_rps = wrap_angle(b.yaw_rad - a.yaw_rad) / dt;
  }
}

}  // namespace

std::vector<EgoRow> read_ego_file(const std::string& path, std::vector<std::string>* notes) {
  const Csv csv = Csv::read(path);
  const int32_t seconds = csv.find({"stamp_ns", "timestamp_ns"}) < 0 ? csv.find({"time_s", "time"}) : -1;
  const int32_t stamp = seconds >= 0 ? seconds : csv.need({"stamp_ns", "timestamp_ns", "time_s"});
  const int32_t x = csv.need({"x_m", "x"}), y = csv.need({"y_m", "y"});
  const int32_t yaw = csv.need({"yaw_rad", "heading_rad", "yaw", "phi", "psi"});
  const int32_t z = csv.find({"z_m", "z"}), roll = csv.find({"roll_rad"}), pitch = csv.find({"pitch_rad"});
  const int32_t speed = csv.find({"speed_mps", "vx_mps", "speed", "vx"});
  const int32_t yaw_rate = csv.find({"yaw_rate_rps", "yaw_rate", "omega"});
  if ((roll < 0) != (pitch < 0))
    throw Error(path, 0,
                std::string("has ") + (roll < 0 ? "pitch_rad and no roll_rad" : "roll_rad and no pitch_rad") +
                    " (there are: " + join(csv.names(), ", ") + ")");
  const int32_t published = csv.find({"publish_ns"});  // of a simulated log: known, and not needed
  if (notes) csv.note_unread({stamp, seconds, x, y, yaw, z, roll, pitch, speed, yaw_rate, published}, *notes);
  const auto optional = [&](std::size_t row, int32_t column) { return column < 0 ? 0.0 : csv.number(row, column); };

  std::vector<EgoRow> rows(csv.row_count());
  for (std::size_t i = 0; i < rows.size(); ++i) {
    EgoRow& row = rows[i];
    if (seconds >= 0) {
      const double time_s = csv.number(i, stamp);
      if (std::fabs(time_s) > 9e9) csv.fail(i, stamp, "time is not in seconds");
      row.stamp_ns = to_nanoseconds(time_s, 1'000'000'000);
    } else {
      row.stamp_ns = csv.integer(i, stamp);
    }
    if (i > 0 && row.stamp_ns <= rows[i - 1].stamp_ns) csv.fail(i, stamp, "the stamp does not grow");
    row.x_m = csv.number(i, x);
    row.y_m = csv.number(i, y);
    row.z_m = optional(i, z);
    row.roll_rad = optional(i, roll);
    row.pitch_rad = optional(i, pitch);
    row.yaw_rad = csv.number(i, yaw);
    row.speed_mps = optional(i, speed);
    row.yaw_rate_rps = optional(i, yaw_rate);
  }
  derive_rates(rows, speed < 0, yaw_rate < 0);
  return rows;
}

}  // namespace overtake::io
