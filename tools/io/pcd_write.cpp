// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
#include <lzf.h>

#include <cstring>

#include "tools/io/error.h"
#include "tools/io/pcd.h"
#include "tools/io/text.h"

namespace overtake::io {
namespace {

std::string format_header(const Cloud& cloud, std::size_t points, PcdEncoding encoding) {
  static constexpr const char* kEncoding[] = {"ascii", "binary", "binary_compressed"};
  std::string fields = "FIELDS", size = "SIZE", type = "TYPE", count = "COUNT";
  for (const CloudField& field : cloud.fields) {
    const bool is_signed = field.type == ValueType::kInt8 || field.type == ValueType::kInt16 ||
                           field.type == ValueType::kInt32 || field.type == ValueType::kInt64;
    fields += ' ' + field.name;
    size += ' ' + std::to_string(size_of(field.type));
    type += is_float(field.type) ? " F" : is_signed ? " I" : " U";
    count += ' ' + std::to_string(field.count);
  }
  const std::string n = std::to_string(points);
  return "# .PCD v0.7 - Point Cloud Data file format\nVERSION 0.7\n" + fields + '\n' + size + '\n' + type + '\n' +
         count + "\nWIDTH " + n + "\nHEIGHT 1\nVIEWPOINT 0 0 0 1 0 0 0\nPOINTS " + n + "\nDATA " +
         kEncoding[std::size_t(encoding)] + '\n';
}

}  // namespace

std::string format_pcd(const Cloud& cloud, PcdEncoding encoding) {
  const auto& fields = cloud.fields;
  if (fields.empty() || fields.size() != cloud.columns.size()) throw Error("", 0, "a cloud needs one column per field");
  const std::size_t points = cloud.columns[0].values() / std::size_t(fields[0].count);
  for (std::size_t f = 0; f < fields.size(); ++f)
    if (cloud.columns[f].bytes.size() != points * std::size_t(fields[f].count) * size_of(fields[f].type))
      throw Error("", 0, "column '" + fields[f].name + "' is not as long as the first one");
  std::string out = format_header(cloud, points, encoding);
  if (encoding == PcdEncoding::kBinaryCompressed) {
    std::vector<unsigned char> raw;
    for (const CloudColumn& column : cloud.columns) raw.insert(raw.end(), column.bytes.begin(), column.bytes.end());
    // At most 104 % of the input. liblzf does not clear its table: the bytes may differ from run to run.
    std::vector<unsigned char> packed(raw.size() + raw.size() / 16 + 64);
    if (packed.size() > UINT32_MAX) throw Error("", 0, "a cloud of more than 4 GiB cannot be compressed");
    packed.resize(lzf_compress(raw.data(), uint32_t(raw.size()), packed.data(), uint32_t(packed.size())));
    const uint32_t size[2] = {uint32_t(packed.size()), uint32_t(raw.size())};
    out.append(reinterpret_cast<const char*>(size), sizeof size);
    out.append(packed.begin(), packed.end());
    return out;
  }
  for (std::size_t i = 0; i < points; ++i) {
    bool first = true;
    for (const CloudColumn& column : cloud.columns) {
      const std::size_t size = size_of(column.type), per_point = std::size_t(column.count);
      if (encoding == PcdEncoding::kBinary) {
        const auto* at = column.bytes.data() + i * per_point * size;
        out.append(at, at + per_point * size);
        continue;
      }
      for (std::size_t k = 0; k < per_point; ++k, first = false) {
        if (!first) out += ' ';
        append_value_text(out, column, i * per_point + k);
      }
    }
    if (encoding == PcdEncoding::kAscii) out += '\n';
  }
  return out;
}

void write_pcd(const std::string& path, const Cloud& cloud, PcdEncoding encoding) {
  write_whole_file(path, format_pcd(cloud, encoding));
}

}  // namespace overtake::io
