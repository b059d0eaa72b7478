// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// A file in memory, for readers that need a path.
#pragma once

#include <fcntl.h>
#include <sys/mman.h>
#include <unistd.h>

#include <cstdlib>
#include <string>
#include <string_view>

#include "tests/fuzz/bytes.h"

namespace overtake::fuzz {

class MemoryFile {
 public:
  MemoryFile() : MemoryFile(memfd_create("overtake_fuzz", 0), "") {}
  ~MemoryFile() {
    close(descriptor_);
    remove_companions();
    if (!path_.empty()) unlink(path_.c_str());
  }
  // With a name in a memory file system, for SQLite: it resolves links, and /proc/self/fd has no target.
  static MemoryFile named() {
    std::string path = access("/dev/shm", W_OK) == 0 ? "/dev/shm/overtake_fuzz_XXXXXX" : "/tmp/overtake_fuzz_XXXXXX";
    const int descriptor = mkstemp(path.data());
    return MemoryFile(descriptor, path);
  }
  MemoryFile(const MemoryFile&) = delete;
  MemoryFile& operator=(const MemoryFile&) = delete;

  // Replaces the contents; the path does not change.
  std::string write(std::string_view bytes) {
    remove_companions();
    OVT_FUZZ_REQUIRE(ftruncate(descriptor_, 0) == 0);
    OVT_FUZZ_REQUIRE(pwrite(descriptor_, bytes.data(), bytes.size(), 0) == ssize_t(bytes.size()));
    return path_.empty() ? "/proc/self/fd/" + std::to_string(descriptor_) : path_;
  }

 private:
  void remove_companions() const {  // files that SQLite creates must not reach the next input
    for (const char* end : {"-wal", "-shm", "-journal"})
      if (!path_.empty()) unlink((path_ + end).c_str());
  }

  MemoryFile(int descriptor, const std::string& path) : descriptor_(descriptor), path_(path) {
    OVT_FUZZ_REQUIRE(descriptor_ >= 0);
  }

  int descriptor_;
  std::string path_;
};

}  // namespace overtake::fuzz
