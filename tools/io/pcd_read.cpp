// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
#include <lzf.h>

#include <algorithm>
#include <cstring>
#include <string_view>

#include "tools/io/error.h"
#include "tools/io/formats.h"
#include "tools/io/pcd.h"
#include "tools/io/pcd_header.h"
#include "tools/io/text.h"

namespace overtake::io {
namespace {

constexpr std::size_t kLzfMaxExpansion = 88;  // a copy of 3 bytes yields at most 264

// Checks the memory for a file of `file_bytes`; `copies`: copies of the points besides the columns.
void check_points(const std::string& path, const PcdHeader& header, std::size_t file_bytes, uint64_t copies) {
  const uint64_t points = uint64_t(header.points) * header.point_bytes;  // 31 and 20 bits
  check_memory(path, file_bytes + points * (copies + 1), "reading its " + std::to_string(header.points) + " points");
}

// "field 'z' of point 17": where the data ends if it has only `available` bytes.
std::string place_of(const PcdHeader& header, std::size_t available) {
  std::size_t rest = available % header.point_bytes;
  for (const CloudField& field : header.fields) {
    const std::size_t bytes = std::size_t(field.count) * size_of(field.type);
    if (rest < bytes) return "field '" + field.name + "' of point " + std::to_string(available / header.point_bytes);
    rest -= bytes;
  }
  return "point " + std::to_string(available / header.point_bytes);
}

void read_binary(const std::string& path, const std::string& bytes, const PcdHeader& header, Cloud& cloud) {
  const std::size_t available = bytes.size() - header.data_offset;
  if (available / header.point_bytes < std::size_t(header.points))
    throw Error(path, 0,
                "the data ends at " + place_of(header, available) + "; " + std::to_string(header.points) +
                    " points are declared");
  check_points(path, header, bytes.size(), 0);
  cloud.columns = make_columns(header.fields, header.points);
  const char* point = bytes.data() + header.data_offset;
  std::size_t offset = 0;
  for (CloudColumn& column : cloud.columns) {
    const std::size_t size = std::size_t(column.count) * size_of(column.type);
    for (std::size_t i = 0; i < std::size_t(header.points); ++i)
      std::memcpy(column.bytes.data() + i * size, point + i * header.point_bytes + offset, size);
    offset += size;
  }
}

// The data: two uint32 sizes (compressed, uncompressed), then the columns one after the other, compressed by LZF.
void read_compressed(const std::string& path, const std::string& bytes, const PcdHeader& header, Cloud& cloud) {
  const std::size_t available = bytes.size() - header.data_offset;
  uint32_t size[2] = {0, 0};
  if (available >= sizeof size)
    std::memcpy(size, bytes.data() + header.data_offset, sizeof size);
  else if (header.points > 0)
    throw Error(path, 0, "the data ends before its compressed size");
  if (header.points == 0) {
    cloud.columns = make_columns(header.fields, header.points);
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
  if (lzf_decompress(packed, size[0], raw.data(), size[1]) != declared)
    throw Error(path, 0, "the compressed data is corrupt");
  cloud.columns = make_columns(header.fields, header.points);
  std::size_t offset = 0;
  for (CloudColumn& column : cloud.columns) {
    if (!column.bytes.empty()) std::memcpy(column.bytes.data(), raw.data() + offset, column.bytes.size());
    offset += column.bytes.size();
  }
}

void read_ascii(const std::string& path, const std::string& bytes, const PcdHeader& header, Cloud& cloud) {
  int64_t values = 0;
  for (const CloudField& field : header.fields) values += field.count;
  // A value takes at least a digit and a separator: first checks the declared count against the file's size.
  const std::size_t available = bytes.size() - header.data_offset;
  if (header.points > 0 && (available + 1) / 2 / std::size_t(values) < std::size_t(header.points))
    throw Error(path, 0,
                "the data is too short: " + std::to_string(available) + " bytes cannot hold the declared " +
                    std::to_string(header.points) + " points");
  check_points(path, header, bytes.size(), 0);
  cloud.columns = make_columns(header.fields, header.points);
  int64_t line = header.data_line, point = 0;
  std::size_t at = header.data_offset;
  while (at < bytes.size() && point < header.points) {
    const std::size_t end = std::min(bytes.find('\n', at), bytes.size());
    const std::string_view row = std::string_view(bytes).substr(at, end - at);
    const auto words = split_words(row, std::size_t(values) + 1);  // limited: a row may be the whole file
    at = end + 1;
    ++line;
    if (words.empty()) continue;
    if (int64_t(words.size()) != values)
      throw Error(path, line,
                  "point " + std::to_string(point) + " has " + std::to_string(count_words(row)) +
                      " values, the header declares " + std::to_string(values));
    std::size_t word = 0;
    for (std::size_t f = 0; f < cloud.columns.size(); ++f) {
      CloudColumn& column = cloud.columns[f];
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

Cloud parse_pcd(const std::string& path_in_errors, const std::string& bytes) {
  const PcdHeader header = parse_pcd_header(path_in_errors, bytes);
  Cloud cloud{header.points, header.fields, {}};
  switch (header.encoding) {
    case PcdEncoding::kAscii: read_ascii(path_in_errors, bytes, header, cloud); break;
    case PcdEncoding::kBinary: read_binary(path_in_errors, bytes, header, cloud); break;
    case PcdEncoding::kBinaryCompressed: read_compressed(path_in_errors, bytes, header, cloud); break;
  }
  return cloud;
}

namespace {

// The file must start with a comment or a key of the header.
bool looks_like_pcd(std::string_view head) {
  if (head.starts_with("# .PCD")) return true;
  while (!head.empty()) {
    const std::string_view line = head.substr(0, head.find('\n'));
    const auto words = split_words(line);
    if (!words.empty() && words[0][0] != '#')
      return words[0] == "VERSION" || words[0] == "FIELDS" || words[0] == "COLUMNS";
    head.remove_prefix(std::min(head.size(), line.size() + 1));
  }
  return false;
}

Cloud header_of_pcd(const std::string& path_in_errors, const std::string& bytes) {
  const PcdHeader header = parse_pcd_header(path_in_errors, bytes);
  return {header.points, header.fields, {}};
}

std::vector<CloudExample> pcd_examples(const Cloud& cloud) {
  std::vector<CloudExample> out;
  for (const auto encoding : {PcdEncoding::kAscii, PcdEncoding::kBinary, PcdEncoding::kBinaryCompressed}) {
    const std::string bytes = format_pcd(cloud, encoding);
    out.push_back({bytes, bytes.find("\nDATA")});
  }
  return out;
}

}  // namespace

const CloudFormat pcd_format = {looks_like_pcd, header_of_pcd, parse_pcd, pcd_examples};

}  // namespace overtake::io
