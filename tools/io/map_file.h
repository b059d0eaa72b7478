// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// Track maps from files. Four forms:
//   - centre line and widths: x_m, y_m, w_tr_right_m, w_tr_left_m [, banking_rad] (also without header, in this order)
//   - race line tables: x_ref_m, y_ref_m, width_right_m, width_left_m, x_normvec_m, y_normvec_m [, banking_rad] ...
//     with right bound = ref + normvec * width_right, left bound = ref - normvec * width_left
//   - two bounds, "FILE1,FILE2": x, y each, in any order and direction; the first is in driving direction
//   - an MCAP log with an attachment map.csv of one of the first two forms
// The points are in driving direction; left is to the left of it. A line whose ends meet is closed.
//
// banking_rad is positive where the right side is higher. Public tables of the Las Vegas Motor Speedway have the
// opposite sign: if the turns of a file lean outwards on the whole, the reader turns the column round.
#pragma once

#include <string>
#include <vector>

namespace overtake::io {

struct MapData {
  bool closed = false;
  std::vector<double> x_m, y_m, width_left_m, width_right_m, banking_rad;  // banking may be empty
  std::vector<double> left_x_m, left_y_m, right_x_m, right_y_m;            // two bounds, else empty
  std::vector<std::string> notes;  // sentences about what the reader left out of the files or changed
  bool is_bounds() const { return !left_x_m.empty(); }
};

// Throws Error with file, line and column.
MapData read_map(const std::string& path_or_two_paths);

}  // namespace overtake::io
