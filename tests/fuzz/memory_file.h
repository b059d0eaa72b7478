// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// A file in memory, for readers that want a path.
#pragma once

#include <sys/mman.h>
#include <unistd.h>

#include <string>
#include <string_view>

#include "tests/fuzz/bytes.h"

namespace overtake::fuzz {

class MemoryFile {
 public:
  MemoryFile() : descriptor_(memfd_create("overtake_fuzz", 0)) { OVT_FUZZ_REQUIRE(descriptor_ >= 0); }
  ~MemoryFile() { close(descriptor_); }
  MemoryFile(const MemoryFile&) = delete;
  MemoryFile& operator=(const MemoryFile&) = delete;

  // Replaces the contents; the path stays.
  std::string write(std::string_view bytes) {
    OVT_FUZZ_REQUIRE(ftruncate(descriptor_, 0) == 0);
    OVT_FUZZ_REQUIRE(pwrite(descriptor_, bytes.data(), bytes.size(), 0) == ssize_t(bytes.size()));
    return "/proc/self/fd/" + std::to_string(descriptor_);
  }

 private:
  int descriptor_;
};

}  // namespace overtake::fuzz
