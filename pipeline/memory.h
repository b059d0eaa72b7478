// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// Where a detector's blocks come from: the caller's allocator, or pages of their own from the system, with huge pages
// and locking where asked for and allowed. What was obtained is counted; what was refused costs speed, never a failure.
//
// Pages of their own go back to the system with the block, whatever the heap would have kept, and a child process does
// not get them (MADV_DONTFORK): a fork would make the parent's next frames copy every page they write.
#pragma once

#include <atomic>
#include <cstdint>

#include "core/arena.h"

namespace overtake {

class Memory {
 public:
  Memory() = default;
  Memory(const Memory&) = delete;
  Memory& operator=(const Memory&) = delete;

  // `base` null functions: pages of our own. `flags`: OVT_MEMORY_... bits; huge pages with our own only.
  void set_up(const Allocator& base, int32_t flags) noexcept;
  // Hands out through this object, which must outlive every block.
  Allocator allocator() noexcept;

  int64_t bytes() const noexcept { return bytes_.load(std::memory_order_relaxed); }
  int64_t locked_bytes() const noexcept { return locked_bytes_.load(std::memory_order_relaxed); }
  int64_t huge_bytes() const noexcept { return huge_bytes_.load(std::memory_order_relaxed); }
  int64_t huge_refused_bytes() const noexcept { return huge_refused_bytes_.load(std::memory_order_relaxed); }

 private:
  struct Size {
    size_t bytes, alignment;
  };
  struct Obtained {
    bool huge = false, locked = false;
  };
  Size size_of(size_t bytes, size_t alignment) const noexcept;  // of the block that is taken for it
  void* allocate(size_t bytes, size_t alignment) noexcept;
  void release(void* block, size_t bytes) noexcept;

  Allocator base_;
  bool maps_ = false, lock_ = false, huge_ = false;
  std::atomic<int64_t> bytes_{0}, locked_bytes_{0}, huge_bytes_{0}, huge_refused_bytes_{0};
};

}  // namespace overtake
