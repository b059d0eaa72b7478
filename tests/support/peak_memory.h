// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// The growth of the process's peak resident memory since a given moment; and a temporary memory limit.
#pragma once

#include <cstdint>
#include <fstream>
#include <string>

#include "tools/io/memory_limit.h"

namespace overtake::test {

class PeakMemory {
 public:
  PeakMemory() {
    std::ofstream("/proc/self/clear_refs") << 5;  // resets the peak
    begin_ = read("VmRSS:");
  }
  uint64_t grown_bytes() const {
    const uint64_t peak = read("VmHWM:");
    return peak > begin_ ? peak - begin_ : 0;
  }

 private:
  static uint64_t read(const std::string& key) {
    std::ifstream status("/proc/self/status");
    for (std::string word; status >> word;)
      if (uint64_t kib = 0; word == key && status >> kib) return kib * 1024;
    return 0;
  }
  uint64_t begin_ = 0;
};

#if defined(__SANITIZE_ADDRESS__)
inline constexpr bool kMemoryIsOurs = false;  // the sanitizer keeps freed memory
#elif defined(__has_feature)
#if __has_feature(address_sanitizer)
inline constexpr bool kMemoryIsOurs = false;
#else
inline constexpr bool kMemoryIsOurs = true;
#endif
#else
inline constexpr bool kMemoryIsOurs = true;
#endif

struct MemoryLimit {
  explicit MemoryLimit(uint64_t bytes) { io::set_memory_limit(bytes); }
  ~MemoryLimit() { io::set_memory_limit(0); }
  MemoryLimit(const MemoryLimit&) = delete;
  MemoryLimit& operator=(const MemoryLimit&) = delete;
};

}  // namespace overtake::test
