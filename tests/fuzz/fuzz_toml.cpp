// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// Rigs and configurations: any text gives one, or an error with a line. Writing and reading a result gives the same
// result. The first byte selects the type.
#include "tests/fuzz/memory_file.h"
#include "tools/client/config.h"
#include "tools/io/error.h"

using namespace overtake;

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, std::size_t size) {
  static fuzz::MemoryFile file;
  fuzz::Bytes in(data, size);
  const bool config = in.byte() % 4 == 0;
  try {
    if (config) {
      cli::Options options;
      options.config = file.write(in.rest());
      const std::string text = cli::format_config(cli::load_config(options));
      options.config = file.write(text);
      OVT_FUZZ_REQUIRE(cli::format_config(cli::load_config(options)) == text);
    } else {
      const std::string text = io::format_rig(io::parse_rig("fuzz.toml", in.rest()));
      OVT_FUZZ_REQUIRE(io::format_rig(io::parse_rig("again.toml", text)) == text);
    }
  } catch (const io::Error& error) {
    OVT_FUZZ_REQUIRE(*error.what() != '\0');
  }
  return 0;
}
