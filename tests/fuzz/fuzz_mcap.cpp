// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// MCAP: any bytes give messages, then the end or a damage report with its position, within the memory limit. The first
// byte selects the meaning of the other bytes:
//   a file
//   the records of a chunk, which the target compresses, with or without a checksum
//   the compressed content of a chunk, after its declared size
#include "tests/fuzz/memory_file.h"
#include "tests/support/mcap_parts.h"
#include "tools/io/bag_reader.h"
#include "tools/io/error.h"
#include "tools/io/mcap_reader.h"
#include "tools/io/memory_limit.h"

using namespace overtake;

namespace {

std::string make_file(int32_t kind, fuzz::Bytes& in) {
  static constexpr const char* kCompressions[] = {"", "lz4", "zstd"};
  if (kind == 0) return std::string(in.rest());
  if (kind <= 6) {
    const std::string compression = kCompressions[(kind - 1) / 2];
    const std::string_view records = in.rest();
    const uint32_t crc = kind % 2 ? io::update_crc32(0, records) : 0;
    return test::mcap_head() +
           test::mcap_chunk(compression, records.size(), io::compress_chunk(compression, 1, records), crc) +
           test::mcap_tail();
  }
  const auto declared = in.raw<uint32_t>();
  return test::mcap_head() + test::mcap_chunk(kind == 7 ? "lz4" : "zstd", declared, in.rest()) + test::mcap_tail();
}

void check_damage(const std::string& damage) {
  OVT_FUZZ_REQUIRE(damage.empty() || damage.starts_with("damaged at byte "));
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, std::size_t size) {
  static fuzz::MemoryFile file;
  io::set_memory_limit(uint64_t(16) << 20);
  fuzz::Bytes in(data, size);
  const std::string path = file.write(make_file(in.byte() % 9, in));
  try {
    uint64_t messages = 0, bytes = 0;
    io::McapReader reader(path);
    io::McapMessage message;
    for (; reader.next(message); ++messages) {
      OVT_FUZZ_REQUIRE(reader.channels().contains(message.channel_id));
      for (const char c : message.data) bytes += uint8_t(c);  // reads all bytes
    }
    OVT_FUZZ_REQUIRE(!reader.next(message));
    check_damage(reader.damage());

    const auto bag = io::open_bag(path);
    io::BagMessage again;
    for (; bag->next(again); --messages) {
      OVT_FUZZ_REQUIRE(std::size_t(again.topic) < bag->topics().size());
      for (const char c : again.data) bytes -= uint8_t(c);
    }
    OVT_FUZZ_REQUIRE(messages == 0 && bytes == 0);
    OVT_FUZZ_REQUIRE(bag->damage() == reader.damage());
    OVT_FUZZ_REQUIRE(!bag->describe().empty());
    io::read_attached(path, "map.csv");
  } catch (const io::Error& error) {
    OVT_FUZZ_REQUIRE(*error.what() != '\0');
  }
  return 0;
}
