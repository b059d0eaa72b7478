// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
#include "tools/io/cloud_message.h"

#include <algorithm>
#include <cstring>

#include "tools/io/error.h"
#include "tools/io/text.h"

namespace overtake::io {
namespace {

constexpr ValueType kValueType[] = {ValueType::kFloat32, ValueType::kInt8,    ValueType::kUint8,
                                    ValueType::kInt16,   ValueType::kUint16,  ValueType::kInt32,
                                    ValueType::kUint32,  ValueType::kFloat32, ValueType::kFloat64};

bool is_known(uint8_t datatype) { return datatype >= PointField::kInt8 && datatype <= PointField::kFloat64; }

// Copies one value of each point; Size is a compile-time constant, so a copy is one load and one store.
template <std::size_t Size>
void copy_values(const PointCloud2& cloud, std::size_t row_step, std::size_t offset, unsigned char* out) {
  for (std::size_t r = 0; r < cloud.height; ++r) {
    const char* point = cloud.data.data() + r * row_step + offset;
    for (std::size_t c = 0; c < cloud.width; ++c, point += cloud.point_step, out += Size) {
      std::memcpy(out, point, Size);
      if (cloud.is_bigendian) std::reverse(out, out + Size);
    }
  }
}

}  // namespace

std::vector<CloudField> fields_of(const PointCloud2& cloud) {
  std::vector<CloudField> fields;
  for (const PointField& field : cloud.fields)
    fields.push_back({field.name, is_known(field.datatype) ? kValueType[field.datatype] : ValueType::kUint8,
                      is_known(field.datatype) && field.count <= 1 ? 1 : int64_t(field.count) + 2});
  return fields;
}

Cloud read_cloud_message(const std::string& path, const PointCloud2& cloud) {
  const uint64_t count = uint64_t(cloud.width) * cloud.height;
  if (count > uint64_t(INT32_MAX)) throw Error(path, 0, "declares " + std::to_string(count) + " points");
  const uint64_t row = uint64_t(cloud.width) * cloud.point_step;
  const uint64_t row_step = cloud.height > 1 ? cloud.row_step : row;
  if (row_step < row) throw Error(path, 0, "its rows are shorter than their points: row_step is too small");
  const uint64_t needed = count == 0 ? 0 : (uint64_t(cloud.height) - 1) * row_step + row;
  if (needed > cloud.data.size())
    throw Error(path, 0,
                "declares " + std::to_string(count) + " points of " + std::to_string(cloud.point_step) +
                    " bytes, but holds " + std::to_string(cloud.data.size()) + " bytes");
  constexpr uint64_t kRoles = 6, kWidest = 8;  // columns, and bytes of a value
  check_memory(path, cloud.data.size() + std::min(count * kRoles * kWidest, kRoles * kWidest * cloud.data.size()),
               "reading its " + std::to_string(count) + " points");
  Cloud out;
  out.points = int64_t(count);
  out.fields = fields_of(cloud);
  out.columns.resize(out.fields.size());
  for (const CloudRole role :
       {CloudRole::kX, CloudRole::kY, CloudRole::kZ, CloudRole::kIntensity, CloudRole::kLayer, CloudRole::kTime}) {
    const int32_t index = find_role(out.fields, role);
    if (index < 0) continue;
    const PointField& field = cloud.fields[std::size_t(index)];
    CloudColumn& column = out.columns[std::size_t(index)];
    column.type = kValueType[field.datatype];
    const std::size_t size = size_of(column.type);
    if (count > 0 && uint64_t(field.offset) + size > cloud.point_step)
      throw Error(path, 0,
                  "field '" + field.name + "' lies at byte " + std::to_string(field.offset) +
                      ", outside of a point of " + std::to_string(cloud.point_step) + " bytes");
    column.bytes.resize(std::size_t(count) * size);
    const auto copy = size == 1   ? copy_values<1>
                      : size == 2 ? copy_values<2>
                      : size == 4 ? copy_values<4>
                                  : copy_values<8>;
    if (count > 0) copy(cloud, std::size_t(row_step), field.offset, column.bytes.data());
  }
  return out;
}

std::string make_cloud_message(const Cloud& points, const RosHeader& header, PointCloud2& cloud) {
  static constexpr uint8_t kDatatype[] = {PointField::kFloat32,
                                          PointField::kFloat64,
                                          PointField::kInt8,
                                          PointField::kUint8,
                                          PointField::kInt16,
                                          PointField::kUint16,
                                          PointField::kInt32,
                                          PointField::kUint32,
                                          0,
                                          0};
  cloud = PointCloud2();
  cloud.header = header;
  cloud.is_dense = true;
  std::vector<std::size_t> kept;
  std::size_t step = 0, count = 0;
  for (std::size_t f = 0; f < points.columns.size(); ++f) {
    const CloudField& field = points.fields[f];
    const uint8_t datatype = kDatatype[std::size_t(field.type)];
    if (datatype == 0 || field.count != 1) continue;  // 64-bit integers and arrays: PointCloud2 has none
    kept.push_back(f);
    cloud.fields.push_back({field.name, uint32_t(step), datatype, 1});
    step += size_of(field.type);
    count = points.columns[f].values();
  }
  std::string data(step * count, '\0');
  std::size_t offset = 0;
  for (const std::size_t f : kept) {
    const std::size_t size = size_of(points.columns[f].type);
    for (std::size_t i = 0; i < count; ++i)
      std::memcpy(data.data() + i * step + offset, points.columns[f].bytes.data() + i * size, size);
    offset += size;
  }
  cloud.width = uint32_t(count);
  cloud.point_step = uint32_t(step);
  cloud.row_step = uint32_t(step * count);
  return data;
}

std::string describe_layout(const PointCloud2& cloud) {
  std::vector<std::string> words;
  for (const PointField& field : cloud.fields) {
    const std::string type =
        is_known(field.datatype) ? name_of(kValueType[field.datatype]) : "type " + std::to_string(field.datatype);
    words.push_back(field.name + " " + type + (field.count > 1 ? "[" + std::to_string(field.count) + "]" : "") +
                    " at " + std::to_string(field.offset));
  }
  return join(words, ", ") + "; " + std::to_string(cloud.point_step) + " bytes a point";
}

}  // namespace overtake::io
