// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
#include "pipeline/memory.h"

#include <sys/mman.h>

#include <algorithm>

#include "pipeline/overtake.h"

namespace overtake {
namespace {

// A scan touches a few MB of its slot here and there: in pages of 4 kB that is more than the CPU's page tables in cache
// hold (three sensors' chain took about a tenth longer, on a noisy machine).
constexpr size_t kHugePage = size_t(2) << 20;

}  // namespace

void Memory::set_up(const Allocator& base, int32_t flags) noexcept {
  huge_ = !base.allocate && (flags & OVT_MEMORY_HUGE);
  lock_ = flags & OVT_MEMORY_LOCK;
  base_ = base.allocate ? base : default_allocator();
}

Allocator Memory::allocator() noexcept {
  Allocator a;
  a.allocate = [](size_t bytes, size_t alignment, void* user) {
    return static_cast<Memory*>(user)->allocate(bytes, alignment);
  };
  a.release = [](void* block, size_t bytes, void* user) { static_cast<Memory*>(user)->release(block, bytes); };
  a.user = this;
  return a;
}

void* Memory::allocate(size_t bytes, size_t alignment) noexcept {
  const bool huge = huge_ && bytes >= kHugePage;
  // aligned_alloc wants a multiple of the alignment; release() gives back the block whatever its size.
  void* block = huge ? base_.allocate((bytes + kHugePage - 1) / kHugePage * kHugePage, kHugePage, base_.user)
                     : base_.allocate(bytes, alignment, base_.user);
  if (!block) return nullptr;
  bytes_.fetch_add(int64_t(bytes), std::memory_order_relaxed);
  if (huge) {
    const bool obtained = madvise(block, bytes, MADV_HUGEPAGE) == 0;
    (obtained ? huge_bytes_ : huge_refused_bytes_).fetch_add(int64_t(bytes), std::memory_order_relaxed);
  }
  if (lock_ && mlock(block, bytes) == 0) locked_bytes_.fetch_add(int64_t(bytes), std::memory_order_relaxed);
  return block;
}

void Memory::release(void* block, size_t bytes) noexcept {
  if (lock_) munlock(block, bytes);
  bytes_.fetch_sub(int64_t(bytes), std::memory_order_relaxed);
  base_.release(block, bytes, base_.user);
}

}  // namespace overtake
