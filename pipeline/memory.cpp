// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
#include "pipeline/memory.h"

#include <sys/mman.h>

#include <algorithm>
#include <cstdint>
#include <cstring>

#include "pipeline/overtake.h"

namespace overtake {
namespace {

// A scan touches a few MB of its slot, spread out. With pages of 4 kB these are more pages than the CPU's TLB holds
// (the chain of three sensors took about a tenth longer, on a noisy machine).
constexpr size_t kHugePage = size_t(2) << 20;
constexpr size_t kPage = 4096;

// The address sanitizer checks the ends of heap blocks only, so with it all blocks come from the heap.
#if defined(__SANITIZE_ADDRESS__)
constexpr bool kMaps = false;
#elif defined(__has_feature)
#if __has_feature(address_sanitizer)
constexpr bool kMaps = false;
#else
constexpr bool kMaps = true;
#endif
#else
constexpr bool kMaps = true;
#endif

// Maps whole pages at a multiple of `alignment`: maps more than needed and unmaps the ends.
void* map_pages(size_t bytes, size_t alignment, void*) noexcept {
  const size_t slack = alignment > kPage ? alignment : 0;
  if (bytes + slack < bytes) return nullptr;
  void* const whole = mmap(nullptr, bytes + slack, PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0);
  if (whole == MAP_FAILED) return nullptr;
  if (slack == 0) return whole;
  char* const from = static_cast<char*>(whole);
  const size_t before = (alignment - reinterpret_cast<std::uintptr_t>(from) % alignment) % alignment;
  if (before > 0) munmap(from, before);
  munmap(from + before + bytes, slack - before);
  return from + before;
}
void unmap_pages(void* block, size_t bytes, void*) noexcept { munmap(block, bytes); }

}  // namespace

void Memory::set_up(const Allocator& base, int32_t flags) noexcept {
  maps_ = kMaps && !base.allocate;
  huge_ = !base.allocate && (flags & OVT_MEMORY_HUGE);
  lock_ = flags & OVT_MEMORY_LOCK;
  base_ = base.allocate ? base : maps_ ? Allocator{map_pages, unmap_pages, nullptr} : default_allocator();
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

// Locks do not nest, so no two blocks may share a page that one of them unlocks. The last bytes of a block hold what
// was granted for it.
Memory::Size Memory::size_of(size_t bytes, size_t alignment) const noexcept {
  const bool huge = huge_ && bytes >= kHugePage;
  if (!huge && !lock_ && !maps_) return {bytes, alignment};
  const size_t page = huge ? kHugePage : kPage;
  return {(bytes + sizeof(Obtained) + page - 1) / page * page, std::max(page, alignment)};
}

void* Memory::allocate(size_t bytes, size_t alignment) noexcept {
  const Size size = size_of(bytes, alignment);
  void* block = base_.allocate(size.bytes, size.alignment, base_.user);
  if (!block) return nullptr;
  bytes_.fetch_add(int64_t(bytes), std::memory_order_relaxed);
  if (size.bytes == bytes) return block;
  if (maps_) madvise(block, size.bytes, MADV_DONTFORK);  // the kernel never refuses this for mapped pages
  Obtained obtained;
  if (size.alignment == kHugePage) {
    obtained.huge = madvise(block, size.bytes, MADV_HUGEPAGE) == 0;
    (obtained.huge ? huge_bytes_ : huge_refused_bytes_).fetch_add(int64_t(bytes), std::memory_order_relaxed);
  }
  obtained.locked = lock_ && mlock(block, size.bytes) == 0;
  if (obtained.locked) locked_bytes_.fetch_add(int64_t(bytes), std::memory_order_relaxed);
  std::memcpy(static_cast<char*>(block) + size.bytes - sizeof obtained, &obtained, sizeof obtained);
  return block;
}

void Memory::release(void* block, size_t bytes) noexcept {
  const Size size = size_of(bytes, 1);
  bytes_.fetch_sub(int64_t(bytes), std::memory_order_relaxed);
  if (size.bytes != bytes) {
    Obtained obtained;
    std::memcpy(&obtained, static_cast<char*>(block) + size.bytes - sizeof obtained, sizeof obtained);
    if (obtained.huge) huge_bytes_.fetch_sub(int64_t(bytes), std::memory_order_relaxed);
    if (obtained.locked) {
      locked_bytes_.fetch_sub(int64_t(bytes), std::memory_order_relaxed);
      munlock(block, size.bytes);
    }
  }
  base_.release(block, size.bytes, base_.user);
}

}  // namespace overtake
