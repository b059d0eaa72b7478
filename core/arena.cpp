// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
#include "core/arena.h"

#include <algorithm>
#include <cstdlib>
#include <utility>

namespace overtake {

Allocator default_allocator() noexcept {
  Allocator a;
  // aligned_alloc requires a size that is a multiple of the alignment. The arena's sizes always are.
  a.allocate = [](size_t bytes, size_t alignment, void*) { return std::aligned_alloc(alignment, bytes); };
  a.release = [](void* block, size_t, void*) { std::free(block); };
  return a;
}

Arena::Arena(Arena&& other) noexcept
    : allocator_(other.allocator_),
      block_(std::exchange(other.block_, nullptr)),
      bytes_(std::exchange(other.bytes_, 0)) {}

Arena& Arena::operator=(Arena&& other) noexcept {
  if (this != &other) {
    reset();
    allocator_ = other.allocator_;
    block_ = std::exchange(other.block_, nullptr);
    bytes_ = std::exchange(other.bytes_, 0);
  }
  return *this;
}

Arena::~Arena() { reset(); }

// A block that is not 64-byte aligned counts as a failed allocation.
bool Arena::acquire(const Allocator& allocator, std::size_t bytes) noexcept {
  reset();
  bytes = std::max(bytes, kCacheLine);  // the second carving needs a base even when nothing is carved
  void* block = allocator.allocate(bytes, kCacheLine, allocator.user);
  if (block == nullptr) return false;
  if (reinterpret_cast<std::uintptr_t>(block) % kCacheLine != 0) {
    allocator.release(block, bytes, allocator.user);
    return false;
  }
  std::memset(block, 0, bytes);
  allocator_ = allocator;
  block_ = block;
  bytes_ = bytes;
  return true;
}

void Arena::reset() noexcept {
  if (block_ != nullptr) allocator_.release(block_, bytes_, allocator_.user);
  block_ = nullptr;
  bytes_ = 0;
}

}  // namespace overtake
