// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// Point clouds: any bytes give a cloud or an error; a cloud that was read is written and read back the same in every
// encoding. Odd first byte: the decompressor alone, in exactly as much memory as it is given.
#include <vector>

#include "tests/fuzz/bytes.h"
#include "tools/io/error.h"
#include "tools/io/lzf.h"
#include "tools/io/pcd.h"

using namespace overtake;

namespace {

bool same_columns(const io::Pcd& a, const io::Pcd& b) {
  if (a.columns.size() != b.columns.size()) return false;
  for (std::size_t c = 0; c < a.columns.size(); ++c)
    if (a.columns[c].bytes != b.columns[c].bytes) return false;
  return true;
}

void read_cloud(std::string_view bytes) {
  io::Pcd pcd = io::parse_pcd("fuzz.pcd", std::string(bytes));
  for (int32_t role = 0; role <= int32_t(io::PcdRole::kTime); ++role) {
    const int32_t column = io::find_role(pcd.header, io::PcdRole(role));
    OVT_FUZZ_REQUIRE(column < int32_t(pcd.columns.size()));
    if (column < 0) continue;
    for (std::size_t i = 0; i < pcd.columns[std::size_t(column)].values(); ++i) {
      pcd.columns[std::size_t(column)].value(i);
      pcd.columns[std::size_t(column)].integer(i);
    }
  }
  for (const auto encoding : {io::PcdEncoding::kBinary, io::PcdEncoding::kBinaryCompressed}) {
    pcd.header.encoding = encoding;
    const std::string text = io::format_pcd(pcd);
    OVT_FUZZ_REQUIRE(same_columns(io::parse_pcd("again.pcd", text), pcd));
  }
  // As text a NaN loses its payload, the second time there is nothing left to lose.
  pcd.header.encoding = io::PcdEncoding::kAscii;
  const std::string text = io::format_pcd(pcd);
  OVT_FUZZ_REQUIRE(io::format_pcd(io::parse_pcd("again.pcd", text)) == text);
}

void decompress(fuzz::Bytes& in) {
  const std::size_t out_size = std::size_t(in.in(0, 4000));
  const std::string_view rest = in.rest();
  const std::vector<unsigned char> packed(rest.begin(), rest.end());
  std::vector<unsigned char> out(out_size);
  io::lzf_decompress(packed.data(), packed.size(), out.data(), out.size());
  const std::vector<unsigned char> again = io::lzf_compress(packed.data(), packed.size());
  out.resize(packed.size());
  OVT_FUZZ_REQUIRE(io::lzf_decompress(again.data(), again.size(), out.data(), out.size()));
  OVT_FUZZ_REQUIRE(out == packed);
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, std::size_t size) {
  fuzz::Bytes in(data, size);
  if (in.byte() % 2 == 1) {
    decompress(in);
    return 0;
  }
  try {
    read_cloud(in.rest());
  } catch (const io::Error& error) {
    OVT_FUZZ_REQUIRE(*error.what() != '\0');
  }
  return 0;
}
