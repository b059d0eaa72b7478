// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// Scans of KITTI and nuScenes: float32 numbers, point after point, nothing else.
#include <cstring>
#include <span>

#include "tools/io/error.h"
#include "tools/io/formats.h"
#include "tools/io/memory_limit.h"
#include "tools/io/text.h"

namespace overtake::io {
namespace {

using Fields = std::span<const char* const>;
constexpr const char* kKittiFields[] = {"x", "y", "z", "intensity"};
constexpr const char* kNuscenesFields[] = {"x", "y", "z", "intensity", "ring"};

std::size_t point_bytes(Fields fields) { return 4 * fields.size(); }

Cloud parse_header(Fields fields, const std::string& path, const std::string& bytes) {
  const std::size_t points = bytes.size() / point_bytes(fields);
  if (bytes.size() % point_bytes(fields) != 0)
    throw Error(path, 0,
                "ends within point " + std::to_string(points) + ": a point takes " +
                    std::to_string(point_bytes(fields)) + " bytes (" +
                    join(std::vector<std::string>(fields.begin(), fields.end()), " ") + " as float32)");
  if (points > std::size_t(INT32_MAX)) throw Error(path, 0, "holds too many points");
  Cloud cloud;
  cloud.points = int64_t(points);
  for (const char* name : fields) cloud.fields.push_back({name, ValueType::kFloat32, 1});
  return cloud;
}

Cloud parse(Fields fields, const std::string& path, const std::string& bytes) {
  Cloud cloud = parse_header(fields, path, bytes);
  check_memory(path, 2 * uint64_t(bytes.size()), "the scan");
  cloud.columns = make_columns(cloud.fields, cloud.points);
  for (std::size_t f = 0; f < cloud.columns.size(); ++f)
    for (std::size_t i = 0; i < std::size_t(cloud.points); ++i)
      std::memcpy(cloud.columns[f].bytes.data() + 4 * i, bytes.data() + point_bytes(fields) * i + 4 * f, 4);
  return cloud;
}

// 0 for a field that the cloud lacks.
std::string format(Fields fields, const Cloud& cloud) {
  std::string out(point_bytes(fields) * std::size_t(cloud.points), '\0');
  for (std::size_t f = 0; f < fields.size(); ++f)
    if (const CloudColumn* column = cloud.find(fields[f]))
      for (std::size_t i = 0; i < std::size_t(cloud.points); ++i) {
        const float value = float(column->value(i));
        std::memcpy(out.data() + point_bytes(fields) * i + 4 * f, &value, 4);
      }
  return out;
}

template <const auto& kFields>
constexpr CloudFormat format_of = {
    nullptr, [](const std::string& path, const std::string& bytes) { return parse_header(kFields, path, bytes); },
    [](const std::string& path, const std::string& bytes) { return parse(kFields, path, bytes); },
    [](const Cloud& cloud) {
      return std::vector<CloudExample>{{format(kFields, cloud), point_bytes(kFields)}};
    }};

}  // namespace

const CloudFormat kitti_bin_format = format_of<kKittiFields>;
const CloudFormat nuscenes_bin_format = format_of<kNuscenesFields>;

}  // namespace overtake::io
