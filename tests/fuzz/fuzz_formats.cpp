// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// Files of clouds, every format of the table (first byte): any bytes give a cloud or an error; a cloud that was read is
// written as PCD and read back the same in every encoding.
#include <vector>

#include "tests/fuzz/bytes.h"
#include "tools/io/error.h"
#include "tools/io/formats.h"
#include "tools/io/pcd.h"

using namespace overtake;

namespace {

bool same_columns(const io::Cloud& a, const io::Cloud& b) {
  if (a.columns.size() != b.columns.size()) return false;
  for (std::size_t c = 0; c < a.columns.size(); ++c)
    if (a.columns[c].bytes != b.columns[c].bytes) return false;
  return true;
}

void read_file(const io::CloudFormat& format, const std::string& bytes) {
  const io::Cloud header = format.parse_header("fuzz", bytes);
  const io::Cloud cloud = format.parse("fuzz", bytes);
  OVT_FUZZ_REQUIRE(header.points == cloud.points && header.fields.size() == cloud.fields.size());
  OVT_FUZZ_REQUIRE(cloud.columns.size() == cloud.fields.size());
  for (std::size_t c = 0; c < cloud.columns.size(); ++c) {
    const io::CloudColumn& column = cloud.columns[c];
    OVT_FUZZ_REQUIRE(column.type == cloud.fields[c].type && column.count == cloud.fields[c].count);
    OVT_FUZZ_REQUIRE(int64_t(column.values()) == cloud.points * column.count);
    for (std::size_t i = 0; i < column.values(); ++i) column.value(i), column.integer(i);
  }
  for (int32_t role = 0; role <= int32_t(io::CloudRole::kTime); ++role)
    OVT_FUZZ_REQUIRE(io::find_role(cloud.fields, io::CloudRole(role)) < int32_t(cloud.columns.size()));
  if (cloud.columns.empty()) return;
  for (const auto encoding : {io::PcdEncoding::kBinary, io::PcdEncoding::kBinaryCompressed})
    OVT_FUZZ_REQUIRE(same_columns(io::parse_pcd("again.pcd", io::format_pcd(cloud, encoding)), cloud));
  // As text a NaN loses its payload, the second time there is nothing left to lose.
  const std::string text = io::format_pcd(cloud, io::PcdEncoding::kAscii);
  OVT_FUZZ_REQUIRE(io::format_pcd(io::parse_pcd("again.pcd", text), io::PcdEncoding::kAscii) == text);
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, std::size_t size) {
  static const std::vector<const io::CloudFormat*> kClouds = [] {
    std::vector<const io::CloudFormat*> clouds;
    for (const io::Format& format : io::formats())
      if (format.cloud) clouds.push_back(format.cloud);
    return clouds;
  }();
  fuzz::Bytes in(data, size);
  const io::CloudFormat& format = *kClouds[in.byte() % kClouds.size()];
  try {
    read_file(format, std::string(in.rest()));
  } catch (const io::Error& error) {
    OVT_FUZZ_REQUIRE(*error.what() != '\0');
  }
  return 0;
}
