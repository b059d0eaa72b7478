// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
#include "tools/io/cloud.h"

#include <charconv>
#include <cmath>
#include <cstring>
#include <limits>
#include <system_error>
#include <type_traits>

#include "tools/io/text.h"

namespace overtake::io {
namespace {

template <class T>
T load(const CloudColumn& column, std::size_t i) {
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
auto with_value(const CloudColumn& column, std::size_t i, F&& f) {
  switch (column.type) {
    case ValueType::kFloat32: return f(load<float>(column, i));
    case ValueType::kFloat64: return f(load<double>(column, i));
    case ValueType::kInt8: return f(load<int8_t>(column, i));
    case ValueType::kUint8: return f(load<uint8_t>(column, i));
    case ValueType::kInt16: return f(load<int16_t>(column, i));
    case ValueType::kUint16: return f(load<uint16_t>(column, i));
    case ValueType::kInt32: return f(load<int32_t>(column, i));
    case ValueType::kUint32: return f(load<uint32_t>(column, i));
    case ValueType::kInt64: return f(load<int64_t>(column, i));
    case ValueType::kUint64: break;
  }
  return f(load<uint64_t>(column, i));
}

const std::vector<std::string>& aliases(CloudRole role) {
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

template <class T>
bool store_integer(std::string_view text, unsigned char* out) {
  if constexpr (sizeof(T) == 8 && std::is_unsigned_v<T>) {
    uint64_t value = 0;
    const auto digits = text.substr(text.size() > 1 && text[0] == '+');
    int64_t small = 0;
    if (parse_integer(digits, small)) {
      if (small < 0) return false;
      value = uint64_t(small);
    } else {  // 2^63 and more
      if (digits.size() < 19 || digits.size() > 20) return false;
      for (const char c : digits) {
        if (c < '0' || c > '9' || value > (UINT64_MAX - uint64_t(c - '0')) / 10) return false;
        value = value * 10 + uint64_t(c - '0');
      }
    }
    std::memcpy(out, &value, sizeof value);
    return true;
  } else {
    int64_t value = 0;
    if (!parse_integer(text, value)) return false;
    if (value < int64_t(std::numeric_limits<T>::min()) || value > int64_t(std::numeric_limits<T>::max())) return false;
    const T narrow = T(value);
    std::memcpy(out, &narrow, sizeof narrow);
    return true;
  }
}

// Parses the text as float directly: a conversion through double would round twice.
bool narrow_number(std::string_view text, double value, float& out) {
  if (text.size() > 1 && text[0] == '+') text.remove_prefix(1);
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), out);
  if (error != std::errc::result_out_of_range) return true;
  out = 0;
  return std::fabs(value) < 1;  // underflow, not overflow
}

}  // namespace

std::size_t size_of(ValueType type) {
  static constexpr std::size_t kSize[] = {4, 8, 1, 1, 2, 2, 4, 4, 8, 8};
  return kSize[std::size_t(type)];
}

const char* name_of(ValueType type) {
  static constexpr const char* kName[] = {"float32", "float64", "int8",   "uint8", "int16",
                                          "uint16",  "int32",   "uint32", "int64", "uint64"};
  return kName[std::size_t(type)];
}

bool is_float(ValueType type) { return type == ValueType::kFloat32 || type == ValueType::kFloat64; }

double CloudColumn::value(std::size_t i) const {
  return with_value(*this, i, [](auto v) { return double(v); });
}

int64_t CloudColumn::integer(std::size_t i) const {
  return with_value(*this, i, [](auto v) -> int64_t {
    if constexpr (std::is_floating_point_v<decltype(v)>)
      return saturate(double(v));
    else if constexpr (std::is_same_v<decltype(v), uint64_t>)
      return v > uint64_t(INT64_MAX) ? INT64_MAX : int64_t(v);
    else
      return int64_t(v);
  });
}

const CloudColumn* Cloud::find(const std::string& name) const {
  for (std::size_t i = 0; i < fields.size() && i < columns.size(); ++i)
    if (fields[i].name == name) return &columns[i];
  return nullptr;
}

int32_t find_role(const std::vector<CloudField>& fields, CloudRole role) {
  for (const std::string& alias : aliases(role))
    for (std::size_t i = 0; i < fields.size(); ++i)
      if (fields[i].count == 1 && plain_name(fields[i].name) == plain_name(alias)) return int32_t(i);
  return -1;
}

std::string role_aliases(CloudRole role) { return join(aliases(role), ", "); }

bool store_text(ValueType type, std::string_view text, unsigned char* out) {
  switch (type) {
    case ValueType::kFloat32:
    case ValueType::kFloat64: {
      double value = 0;
      if (!parse_number(text, value)) return false;
      if (type == ValueType::kFloat64) {
        std::memcpy(out, &value, sizeof value);
        return true;
      }
      float narrow = 0;
      if (!narrow_number(text, value, narrow)) return false;
      std::memcpy(out, &narrow, sizeof narrow);
      return true;
    }
    case ValueType::kInt8: return store_integer<int8_t>(text, out);
    case ValueType::kUint8: return store_integer<uint8_t>(text, out);
    case ValueType::kInt16: return store_integer<int16_t>(text, out);
    case ValueType::kUint16: return store_integer<uint16_t>(text, out);
    case ValueType::kInt32: return store_integer<int32_t>(text, out);
    case ValueType::kUint32: return store_integer<uint32_t>(text, out);
    case ValueType::kInt64: return store_integer<int64_t>(text, out);
    case ValueType::kUint64: return store_integer<uint64_t>(text, out);
  }
  return false;
}

void append_value_text(std::string& text, const CloudColumn& column, std::size_t i) {
  float narrow;
  uint64_t wide;
  switch (column.type) {
    case ValueType::kFloat32:
      std::memcpy(&narrow, column.bytes.data() + i * sizeof narrow, sizeof narrow);
      append_number(text, narrow);
      break;
    case ValueType::kFloat64: append_number(text, column.value(i)); break;
    case ValueType::kUint64:
      std::memcpy(&wide, column.bytes.data() + i * sizeof wide, sizeof wide);
      append_number(text, wide);
      break;
    default: append_number(text, column.integer(i));
  }
}

std::vector<CloudColumn> make_columns(const std::vector<CloudField>& fields, int64_t points) {
  std::vector<CloudColumn> columns;
  for (const CloudField& field : fields)
    columns.push_back(
        {field.type, field.count, std::vector<unsigned char>(std::size_t(points * field.count) * size_of(field.type))});
  return columns;
}

}  // namespace overtake::io
