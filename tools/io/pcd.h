// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// Point clouds in PCD files (v0.5 to v0.7; ASCII, binary, binary_compressed), in any field order, type and count.
// Read into one column per field, each in the type the file gives it. Little-endian machines.
#pragma once

#include <cstddef>
#include <cstdint>
#include <cstring>
#include <string>
#include <utility>
#include <vector>

namespace overtake::io {

enum class PcdType : uint8_t { kFloat32, kFloat64, kInt8, kUint8, kInt16, kUint16, kInt32, kUint32, kInt64, kUint64 };
enum class PcdEncoding : uint8_t { kAscii, kBinary, kBinaryCompressed };

std::size_t size_of(PcdType type);
bool is_float(PcdType type);

struct PcdField {
  std::string name;
  PcdType type = PcdType::kFloat32;
  int64_t count = 1;  // values a point
};

struct PcdHeader {
  std::string version;
  std::vector<PcdField> fields;
  int64_t width = 0, height = 1, points = 0;
  double viewpoint[7] = {0, 0, 0, 1, 0, 0, 0};
  PcdEncoding encoding = PcdEncoding::kAscii;
  std::size_t point_bytes = 0;  // of one point in the binary encoding
  std::size_t data_offset = 0;  // first byte after the DATA line
  int64_t data_line = 0;        // number of the DATA line
};

// All values of one field, point after point, `count` values each.
struct PcdColumn {
  PcdType type = PcdType::kFloat32;
  int64_t count = 1;
  std::vector<unsigned char> bytes;

  const void* data() const { return bytes.data(); }
  std::size_t values() const { return bytes.size() / size_of(type); }
  double value(std::size_t i) const;     // exact but for 64-bit integers beyond 2^53
  int64_t integer(std::size_t i) const;  // exact for integers; floats truncate, saturate, NaN is 0
};

struct Pcd {
  PcdHeader header;
  std::vector<PcdColumn> columns;  // as header.fields

  const PcdColumn* find(const std::string& name) const;  // exact name; null when there is none
};

// What a point means, under the names recordings use for it.
enum class PcdRole : uint8_t { kX, kY, kZ, kIntensity, kLayer, kTime };
// Column of that meaning: the first alias in the role's list that the file has (case and underscores do not count), one
// value a point. -1: none.
int32_t find_role(const PcdHeader& header, PcdRole role);
// "ring, line, layer, ..." for error texts.
std::string role_aliases(PcdRole role);

// Throw Error with file and line (header, ASCII data) or field and point (binary data).
PcdHeader read_pcd_header(const std::string& path);
Pcd read_pcd(const std::string& path);
Pcd parse_pcd(const std::string& path_in_errors, const std::string& bytes);

// One more field of one value a point; `type` is what T is in the file.
template <class T>
void add_column(Pcd& pcd, const char* name, PcdType type, const std::vector<T>& values) {
  pcd.header.fields.push_back({name, type, 1});
  PcdColumn column;
  column.type = type;
  column.bytes.resize(values.size() * sizeof(T));
  if (!values.empty()) std::memcpy(column.bytes.data(), values.data(), column.bytes.size());
  pcd.columns.push_back(std::move(column));
}

// header.fields, columns and encoding are used; width, height and points are written from the columns' length.
std::string format_pcd(const Pcd& pcd);
void write_pcd(const std::string& path, const Pcd& pcd);

}  // namespace overtake::io
