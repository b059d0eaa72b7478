// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// A point cloud in memory, the result of every cloud reader: one column per field, each in the recording's type. A
// field's name determines its role, the meaning of the column.
#pragma once

#include <cstddef>
#include <cstdint>
#include <cstring>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace overtake::io {

enum class ValueType : uint8_t { kFloat32, kFloat64, kInt8, kUint8, kInt16, kUint16, kInt32, kUint32, kInt64, kUint64 };

std::size_t size_of(ValueType type);
bool is_float(ValueType type);
const char* name_of(ValueType type);  // "float32"

struct CloudField {
  std::string name;
  ValueType type = ValueType::kFloat32;
  int64_t count = 1;  // values per point
};

// All values of one field, point after point, `count` values each.
struct CloudColumn {
  ValueType type = ValueType::kFloat32;
  int64_t count = 1;
  std::vector<unsigned char> bytes;

  const void* data() const { return bytes.data(); }
  std::size_t values() const { return bytes.size() / size_of(type); }
  double value(std::size_t i) const;     // exact except for 64-bit integers beyond 2^53
  int64_t integer(std::size_t i) const;  // exact for integers; floats truncate, saturate, NaN is 0
};

// The meaning of a column. Recordings use several names for each role.
enum class CloudRole : uint8_t { kX, kY, kZ, kIntensity, kLayer, kTime };
// Index of the field with that role: the first alias in the role's list that a field has (ignores case,
// underscores and hyphens), with one value per point. -1: none.
int32_t find_role(const std::vector<CloudField>& fields, CloudRole role);
// "ring, line, layer, ..." for error texts.
std::string role_aliases(CloudRole role);

struct Cloud {
  int64_t points = 0;
  std::vector<CloudField> fields;
  std::vector<CloudColumn> columns;  // in the order of fields; empty if only the header was read

  const CloudColumn* find(const std::string& name) const;  // exact name; null: none
};

// Appends a field with one value per point; `type` is the ValueType of T.
template <class T>
void add_column(Cloud& cloud, const char* name, ValueType type, const std::vector<T>& values) {
  cloud.fields.push_back({name, type, 1});
  CloudColumn column;
  column.type = type;
  column.bytes.resize(values.size() * sizeof(T));
  if (!values.empty()) std::memcpy(column.bytes.data(), values.data(), column.bytes.size());
  cloud.columns.push_back(std::move(column));
  cloud.points = int64_t(values.size());
}

// Parses one value of a text file into `out` as `type`. False: not a number, or outside of the type's range.
bool store_text(ValueType type, std::string_view text, unsigned char* out);
// Appends the column's i-th value as text that reads back as the same value.
void append_value_text(std::string& text, const CloudColumn& column, std::size_t i);
// Makes the columns of `fields` for `points` points, all zero.
std::vector<CloudColumn> make_columns(const std::vector<CloudField>& fields, int64_t points);

}  // namespace overtake::io
