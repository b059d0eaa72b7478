// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// rosbag2's SQLite files: any bytes give messages of existing topics, with increasing numbers, and then the end or a
// damage report.
#include "tests/fuzz/memory_file.h"
#include "tools/io/bag_reader.h"
#include "tools/io/error.h"
#include "tools/io/memory_limit.h"

using namespace overtake;

static volatile uint64_t sum_of_bytes = 0;  // keeps the compiler from removing the reads

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, std::size_t size) {
  static fuzz::MemoryFile file = fuzz::MemoryFile::named();
  io::set_memory_limit(uint64_t(16) << 20);
  const std::string path = file.write({reinterpret_cast<const char*>(data), size});
  try {
    const auto bag = io::open_db3(path);
    io::BagMessage message;
    uint64_t count = 0, bytes = 0;
    for (; bag->next(message); ++count) {
      OVT_FUZZ_REQUIRE(message.number == count);
      OVT_FUZZ_REQUIRE(std::size_t(message.topic) < bag->topics().size());
      for (const char c : message.data) bytes += uint8_t(c);  // reads all bytes
    }
    sum_of_bytes = bytes;
    OVT_FUZZ_REQUIRE(count <= size);
    OVT_FUZZ_REQUIRE(bag->damage().empty() || bag->damage().starts_with("damaged after message "));
    OVT_FUZZ_REQUIRE(!bag->next(message));
  } catch (const io::Error& error) {
    OVT_FUZZ_REQUIRE(*error.what() != '\0');
  }
  return 0;
}
