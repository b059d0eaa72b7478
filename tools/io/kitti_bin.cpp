// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
#include "tools/io/kitti_bin.h"

#include <cstring>

#include "tools/io/error.h"
#include "tools/io/formats.h"
#include "tools/io/memory_limit.h"

namespace overtake::io {
namespace {

constexpr std::size_t kBinPoint = 16;
constexpr const char* kBinField[] = {"x", "y", "z", "intensity"};

Cloud header_of_kitti_bin(const std::string& path, const std::string& bytes) {
  if (bytes.size() % kBinPoint != 0)
    throw Error(path, 0,
                "ends within point " + std::to_string(bytes.size() / kBinPoint) +
                    ": a point takes 16 bytes (x y z intensity as float32)");
  if (bytes.size() / kBinPoint > std::size_t(INT32_MAX)) throw Error(path, 0, "holds too many points");
  Cloud cloud;
  cloud.points = int64_t(bytes.size() / kBinPoint);
  for (const char* name : kBinField) cloud.fields.push_back({name, ValueType::kFloat32, 1});
  return cloud;
}

std::vector<CloudExample> kitti_bin_examples(const Cloud& cloud) { return {{format_kitti_bin(cloud), kBinPoint}}; }

}  // namespace

Cloud parse_kitti_bin(const std::string& path, const std::string& bytes) {
  Cloud cloud = header_of_kitti_bin(path, bytes);
  check_memory(path, 2 * uint64_t(bytes.size()), "the scan");
  cloud.columns = make_columns(cloud.fields, cloud.points);
  for (std::size_t f = 0; f < cloud.columns.size(); ++f)
    for (std::size_t i = 0; i < std::size_t(cloud.points); ++i)
      std::memcpy(cloud.columns[f].bytes.data() + 4 * i, bytes.data() + kBinPoint * i + 4 * f, 4);
  return cloud;
}

std::string format_kitti_bin(const Cloud& cloud) {
  std::string out(kBinPoint * std::size_t(cloud.points), '\0');
  for (std::size_t f = 0; f < std::size(kBinField); ++f)
    if (const CloudColumn* column = cloud.find(kBinField[f]))
      for (std::size_t i = 0; i < std::size_t(cloud.points); ++i) {
        const float value = float(column->value(i));
        std::memcpy(out.data() + kBinPoint * i + 4 * f, &value, 4);
      }
  return out;
}

const CloudFormat kitti_bin_format = {nullptr, header_of_kitti_bin, parse_kitti_bin, kitti_bin_examples};

}  // namespace overtake::io
