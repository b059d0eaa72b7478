// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
#include "tools/io/kitti_bin.h"

#include <cstring>

#include "tools/io/error.h"
#include "tools/io/text.h"

namespace overtake::io {

Pcd read_kitti_bin(const std::string& path) {
  constexpr std::size_t kPoint = 16;
  const std::string bytes = read_whole_file(path);
  if (bytes.size() % kPoint != 0)
    throw Error(path, 0,
                "ends within point " + std::to_string(bytes.size() / kPoint) +
                    ": a point takes 16 bytes (x y z "
                    "intensity as float32)");
  if (bytes.size() / kPoint > std::size_t(INT32_MAX)) throw Error(path, 0, "holds too many points");
  check_memory(path, 2 * uint64_t(bytes.size()), "the scan");
  Pcd pcd;
  const std::size_t count = bytes.size() / kPoint;
  pcd.header.points = pcd.header.width = int64_t(count);
  for (std::size_t f = 0; f < 4; ++f) {
    static constexpr const char* kName[] = {"x", "y", "z", "intensity"};
    pcd.header.fields.push_back({kName[f], PcdType::kFloat32, 1});
    PcdColumn column{PcdType::kFloat32, 1, std::vector<unsigned char>(count * 4)};
    for (std::size_t i = 0; i < count; ++i)
      std::memcpy(column.bytes.data() + 4 * i, bytes.data() + kPoint * i + 4 * f, 4);
    pcd.columns.push_back(std::move(column));
  }
  pcd.header.point_bytes = kPoint;
  return pcd;
}

}  // namespace overtake::io
