// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// The header of a PCD file, line by line.
#pragma once

#include <string>
#include <vector>

#include "tools/io/pcd.h"

namespace overtake::io {

struct PcdHeader {
  std::string version;
  std::vector<CloudField> fields;
  int64_t width = 0, height = 1, points = 0;
  double viewpoint[7] = {0, 0, 0, 1, 0, 0, 0};
  PcdEncoding encoding = PcdEncoding::kAscii;
  std::size_t point_bytes = 0;  // of one point in the binary encoding
  std::size_t data_offset = 0;  // first byte after the DATA line
  int64_t data_line = 0;        // number of the DATA line
};

// Reads the header including the DATA line. Checks the declared sizes against each other, but not against the file: the
// caller must do that before it allocates memory.
PcdHeader parse_pcd_header(const std::string& path_in_errors, const std::string& bytes);

}  // namespace overtake::io
