// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
#include "tools/io/pcd.h"

#include <cmath>
#include <cstring>

#include "tools/io/text.h"

namespace overtake::io {
namespace {

template <class T>
T load(const PcdColumn& column, std::size_t i) {
  T value;
  std::memcpy(&value, column.bytes.data() + i * sizeof(T), sizeof(T));
  return value;
}

int64_t saturate(double value) {
  if (std::isnan(value)) return 0;
  if (value >= 0x1p63) return INT64_MAX;
  if (value < -0x1p63) return INT64_MIN;
  return int64_t(value);
}

// Calls f with the i-th value in the column's own type.
template <class F>
auto with_value(const PcdColumn& column, std::size_t i, F&& f) {
  switch (column.type) {
    case PcdType::kFloat32: return f(load<float>(column, i));
    case PcdType::kFloat64: return f(load<double>(column, i));
    case PcdType::kInt8: return f(load<int8_t>(column, i));
    case PcdType::kUint8: return f(load<uint8_t>(column, i));
    case PcdType::kInt16: return f(load<int16_t>(column, i));
    case PcdType::kUint16: return f(load<uint16_t>(column, i));
    case PcdType::kInt32: return f(load<int32_t>(column, i));
    case PcdType::kUint32: return f(load<uint32_t>(column, i));
    case PcdType::kInt64: return f(load<int64_t>(column, i));
    case PcdType::kUint64: break;
  }
  return f(load<uint64_t>(column, i));
}

const std::vector<std::string>& aliases(PcdRole role) {
  static const std::vector<std::string> kAliases[] = {
      {"x"},
      {"y"},
      {"z"},
      {"intensity", "reflectivity", "i", "reflectance", "remission"},
      {"ring", "line", "layer", "channel", "line_index", "laser_number", "laser_id", "scan_line"},
      {"t", "time", "timestamp", "time_stamp", "offset", "time_offset", "offset_time"},
  };
  return kAliases[std::size_t(role)];
}

std::string plain_name(const std::string& name) {
  std::string plain;
  for (const char c : lower_case(name))
    if (c != '_' && c != '-') plain += c;
  return plain;
}

}  // namespace

std::size_t size_of(PcdType type) {
  static constexpr std::size_t kSize[] = {4, 8, 1, 1, 2, 2, 4, 4, 8, 8};
  return kSize[std::size_t(type)];
}

bool is_float(PcdType type) { return type == PcdType::kFloat32 || type == PcdType::kFloat64; }

double PcdColumn::value(std::size_t i) const {
  return with_value(*this, i, [](auto v) { return double(v); });
}

int64_t PcdColumn::integer(std::size_t i) const {
  return with_value(*this, i, [](auto v) -> int64_t {
    if constexpr (std::is_floating_point_v<decltype(v)>)
      return saturate(double(v));
    else if constexpr (std::is_same_v<decltype(v), uint64_t>)
      return v > uint64_t(INT64_MAX) ? INT64_MAX : int64_t(v);
    else
      return int64_t(v);
  });
}

const PcdColumn* Pcd::find(const std::string& name) const {
  for (std::size_t i = 0; i < header.fields.size(); ++i)
    if (header.fields[i].name == name) return &columns[i];
  return nullptr;
}

int32_t find_role(const PcdHeader& header, PcdRole role) {
  for (const std::string& alias : aliases(role))
    for (std::size_t i = 0; i < header.fields.size(); ++i)
      if (header.fields[i].count == 1 && plain_name(header.fields[i].name) == plain_name(alias)) return int32_t(i);
  return -1;
}

std::string role_aliases(PcdRole role) { return join(aliases(role), ", "); }

}  // namespace overtake::io
