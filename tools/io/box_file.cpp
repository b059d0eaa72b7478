// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
#include "tools/io/box_file.h"

#include <cmath>
#include <filesystem>

#include "tools/io/error.h"
#include "tools/io/text.h"

namespace overtake::io {

std::optional<Box> read_box_beside(const FrameScans& frame) {
  if (frame.scans.empty()) return std::nullopt;
  const std::filesystem::path scan = frame.scans[0].path;
  const std::string stem = scan.stem().string();
  const std::string path = (scan.parent_path() / (stem.substr(0, stem.find('_')) + "_box.txt")).string();
  std::error_code code;
  if (!std::filesystem::exists(path, code)) return std::nullopt;
  constexpr uint64_t kMost = 1 << 16;
  const std::string text = read_whole_file(path, kMost);
  const auto words = split_words(text);
  Box box;
  double* const fields[] = {&box.x_m, &box.y_m, &box.z_m, &box.length_m, &box.width_m, &box.height_m, &box.yaw_rad};
  if (words.size() != std::size(fields)) throw Error(path, 1, "7 numbers are needed: x y z length width height yaw");
  for (std::size_t i = 0; i < words.size(); ++i)
    if (!parse_number(words[i], *fields[i]) || !std::isfinite(*fields[i]))
      throw Error(path, 1, "'" + std::string(words[i].substr(0, 32)) + "' is not a number");
  return box;
}

}  // namespace overtake::io
