// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstring>
#include <limits>
#include <string_view>
#include <system_error>
#include <type_traits>

#include "tools/io/error.h"
#include "tools/io/lzf.h"
#include "tools/io/pcd.h"
#include "tools/io/pcd_header.h"
#include "tools/io/text.h"

namespace overtake::io {
namespace {

// Of a file of `file_bytes`; `copies`: of the points on the way to the columns.
void check_points(const std::string& path, const PcdHeader& header, std::size_t file_bytes, uint64_t copies) {
  const uint64_t points = uint64_t(header.points) * header.point_bytes;  // 31 and 20 bits
  check_memory(path, file_bytes + points * (copies + 1), "reading its " + std::to_string(header.points) + " points");
}

std::vector<PcdColumn> make_columns(const PcdHeader& header) {
  std::vector<PcdColumn> columns;
  for (const PcdField& field : header.fields)
    columns.push_back({field.type, field.count,
                       std::vector<unsigned char>(std::size_t(header.points * field.count) * size_of(field.type))});
  return columns;
}

// "field 'z' of point 17": where the data ends when only `available` bytes of points are there.
std::string place_of(const PcdHeader& header, std::size_t available) {
  std::size_t rest = available % header.point_bytes;
  for (const PcdField& field : header.fields) {
    const std::size_t bytes = std::size_t(field.count) * size_of(field.type);
    if (rest < bytes) return "field '" + field.name + "' of point " + std::to_string(available / header.point_bytes);
    rest -= bytes;
  }
  return "point " + std::to_string(available / header.point_bytes);
}

void read_binary(const std::string& path, const std::string& bytes, Pcd& pcd) {
  const PcdHeader& header = pcd.header;
  const std::size_t available = bytes.size() - header.data_offset;
  if (available / header.point_bytes < std::size_t(header.points))
    throw Error(path, 0,
                "the data ends at " + place_of(header, available) + "; " + std::to_string(header.points) +
                    " points are declared");
  check_points(path, header, bytes.size(), 0);
  pcd.columns = make_columns(header);
  const char* point = bytes.data() + header.data_offset;
  std::size_t offset = 0;
  for (PcdColumn& column : pcd.columns) {
    const std::size_t size = std::size_t(column.count) * size_of(column.type);
    for (std::size_t i = 0; i < std::size_t(header.points); ++i)
      std::memcpy(column.bytes.data() + i * size, point + i * header.point_bytes + offset, size);
    offset += size;
  }
}

// Two uint32 sizes, then LZF of the columns one after the other.
void read_compressed(const std::string& path, const std::string& bytes, Pcd& pcd) {
  const PcdHeader& header = pcd.header;
  const std::size_t available = bytes.size() - header.data_offset;
  uint32_t size[2] = {0, 0};
  if (available >= sizeof size)
    std::memcpy(size, bytes.data() + header.data_offset, sizeof size);
  else if (header.points > 0)
    throw Error(path, 0, "the data ends before its compressed size");
  if (header.points == 0) {
    pcd.columns = make_columns(header);
    return;
  }
  const std::size_t declared = std::size_t(header.points) * header.point_bytes;
  if (size[1] != declared)
    throw Error(path, 0,
                "the compressed data holds " + std::to_string(size[1]) + " bytes, " + std::to_string(header.points) +
                    " points are " + std::to_string(declared));
  if (size[0] > available - sizeof size)
    throw Error(path, 0,
                "the compressed data is cut off: " + std::to_string(available - sizeof size) + " of " +
                    std::to_string(size[0]) + " bytes are there");
  if (declared / kLzfMaxExpansion > size[0])
    throw Error(path, 0,
                "the compressed data is corrupt: " + std::to_string(size[0]) + " bytes cannot hold " +
                    std::to_string(declared));
  check_points(path, header, bytes.size(), 1);
  std::vector<unsigned char> raw(declared);
  const auto* packed = reinterpret_cast<const unsigned char*>(bytes.data()) + header.data_offset + sizeof size;
  if (!lzf_decompress(packed, size[0], raw.data(), raw.size())) throw Error(path, 0, "the compressed data is corrupt");
  pcd.columns = make_columns(header);
  std::size_t offset = 0;
  for (PcdColumn& column : pcd.columns) {
    if (!column.bytes.empty()) std::memcpy(column.bytes.data(), raw.data() + offset, column.bytes.size());
    offset += column.bytes.size();
  }
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

// The text as float; not by way of the double, which would round twice.
bool narrow_number(std::string_view text, double value, float& out) {
  if (text.size() > 1 && text[0] == '+') text.remove_prefix(1);
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), out);
  if (error != std::errc::result_out_of_range) return true;
  out = 0;
  return std::fabs(value) < 1;  // too small, not too large
}

bool store_text(PcdType type, std::string_view text, unsigned char* out) {
  switch (type) {
    case PcdType::kFloat32:
    case PcdType::kFloat64: {
      double value = 0;
      if (!parse_number(text, value)) return false;
      if (type == PcdType::kFloat64) {
        std::memcpy(out, &value, sizeof value);
        return true;
      }
      float narrow = 0;
      if (!narrow_number(text, value, narrow)) return false;
      std::memcpy(out, &narrow, sizeof narrow);
      return true;
    }
    case PcdType::kInt8: return store_integer<int8_t>(text, out);
    case PcdType::kUint8: return store_integer<uint8_t>(text, out);
    case PcdType::kInt16: return store_integer<int16_t>(text, out);
    case PcdType::kUint16: return store_integer<uint16_t>(text, out);
    case PcdType::kInt32: return store_integer<int32_t>(text, out);
    case PcdType::kUint32: return store_integer<uint32_t>(text, out);
    case PcdType::kInt64: return store_integer<int64_t>(text, out);
    case PcdType::kUint64: return store_integer<uint64_t>(text, out);
  }
  return false;
}

void read_ascii(const std::string& path, const std::string& bytes, Pcd& pcd) {
  const PcdHeader& header = pcd.header;
  int64_t values = 0;
  for (const PcdField& field : header.fields) values += field.count;
  // A value takes a digit and a separator at least: declared counts are not believed before the file's size agrees.
  const std::size_t available = bytes.size() - header.data_offset;
  if (header.points > 0 && (available + 1) / 2 / std::size_t(values) < std::size_t(header.points))
    throw Error(path, 0,
                "the data is too short: " + std::to_string(available) + " bytes cannot hold the declared " +
                    std::to_string(header.points) + " points");
  check_points(path, header, bytes.size(), 0);
  pcd.columns = make_columns(header);
  int64_t line = header.data_line, point = 0;
  std::size_t at = header.data_offset;
  while (at < bytes.size() && point < header.points) {
    const std::size_t end = std::min(bytes.find('\n', at), bytes.size());
    const auto words = split_words(std::string_view(bytes).substr(at, end - at));
    at = end + 1;
    ++line;
    if (words.empty()) continue;
    if (int64_t(words.size()) != values)
      throw Error(path, line,
                  "point " + std::to_string(point) + " has " + std::to_string(words.size()) +
                      " values, the header declares " + std::to_string(values));
    std::size_t word = 0;
    for (std::size_t f = 0; f < pcd.columns.size(); ++f) {
      PcdColumn& column = pcd.columns[f];
      for (int64_t k = 0; k < column.count; ++k, ++word)
        if (!store_text(column.type, words[word],
                        column.bytes.data() + std::size_t(point * column.count + k) * size_of(column.type)))
          throw Error(path, line,
                      "field '" + header.fields[f].name + "' of point " + std::to_string(point) + " is '" +
                          std::string(words[word].substr(0, 32)) + "', which its type cannot hold");
    }
    ++point;
  }
  if (point < header.points)
    throw Error(path, line,
                "the data ends after " + std::to_string(point) + " of " + std::to_string(header.points) + " points");
}

}  // namespace

Pcd parse_pcd(const std::string& path_in_errors, const std::string& bytes) {
  Pcd pcd;
  pcd.header = parse_pcd_header(path_in_errors, bytes);
  switch (pcd.header.encoding) {
    case PcdEncoding::kAscii: read_ascii(path_in_errors, bytes, pcd); break;
    case PcdEncoding::kBinary: read_binary(path_in_errors, bytes, pcd); break;
    case PcdEncoding::kBinaryCompressed: read_compressed(path_in_errors, bytes, pcd); break;
  }
  return pcd;
}

Pcd read_pcd(const std::string& path) { return parse_pcd(path, read_whole_file(path)); }
PcdHeader read_pcd_header(const std::string& path) { return parse_pcd_header(path, read_whole_file(path)); }

}  // namespace overtake::io
