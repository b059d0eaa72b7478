// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// Whether the system can lock a given amount of memory for this process. Does not use the library, so a test can
// distinguish a library that forgets to lock from a system that does not allow it.
#pragma once

#include <sys/mman.h>

#include <cstddef>
#include <cstdint>

namespace overtake::test {

inline bool can_lock(int64_t bytes) {
  void* block = mmap(nullptr, std::size_t(bytes), PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0);
  if (block == MAP_FAILED) return false;
  const bool locked = mlock(block, std::size_t(bytes)) == 0;
  munmap(block, std::size_t(bytes));
  return locked;
}

}  // namespace overtake::test
