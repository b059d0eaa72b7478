// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// Whether the system can lock a given amount of memory for this process. Does not use the library, so a test can
// distinguish a library that forgets to lock from a system that does not allow it.
#pragma once

#include <sys/mman.h>

#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <fstream>
#include <string>

namespace overtake::test {

// Locked memory of this process.
inline long locked_kb() {
  std::string line;
  for (std::ifstream status("/proc/self/status"); std::getline(status, line);)
    if (line.rfind("VmLck:", 0) == 0) return std::atol(line.c_str() + 6);
  return 0;
}

// The thread sanitizer replaces mlock by a function that locks nothing and returns 0, so the process is asked, too.
inline bool can_lock(int64_t bytes) {
  const long before = locked_kb();
  void* block = mmap(nullptr, std::size_t(bytes), PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0);
  if (block == MAP_FAILED) return false;
  const bool locked = mlock(block, std::size_t(bytes)) == 0 && locked_kb() > before;
  munmap(block, std::size_t(bytes));
  return locked;
}

}  // namespace overtake::test
