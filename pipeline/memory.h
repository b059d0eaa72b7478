// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// Source of a detector's blocks: the caller's allocator, or separate pages from the system, with huge pages and locking
// if requested and allowed. Counts what the system granted. A refusal costs speed, and is never an error.
//
// Separate pages return to the system with the block, while the heap may keep freed memory. A forked child does not get
// them (MADV_DONTFORK); else the parent's next frames would copy every page that they write.
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

  // `base` with null functions: separate pages. `flags`: OVT_MEMORY_... bits; huge pages only for separate pages.
  void set_up(const Allocator& base, int32_t flags) noexcept;
  // An allocator that uses this object, which must outlive every block.
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
  Size size_of(size_t bytes, size_t alignment) const noexcept;  // size of the block for a request
  void* allocate(size_t bytes, size_t alignment) noexcept;
  void release(void* block, size_t bytes) noexcept;

  Allocator base_;
  bool maps_ = false, lock_ = false, huge_ = false;
  std::atomic<int64_t> bytes_{0}, locked_bytes_{0}, huge_bytes_{0}, huge_refused_bytes_{0};
};

}  // namespace overtake
