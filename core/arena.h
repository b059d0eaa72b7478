// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// Memory. Everything a detector uses while it runs lies in one block per owner (a frame slot, a tracker, a mailbox),
// carved once at create. The same carving code runs twice: first to measure the size, then to hand out addresses.
//
//   arena.build([&](Carver& carver) { t.a = carver.take<float>(n); }, allocator);
#pragma once

#include <cstddef>
#include <cstdint>
#include <cstring>
#include <new>

#include "core/plane.h"

namespace overtake {

// Where memory comes from. `allocate` returns null when there is no memory, and never throws.
struct Allocator {
  void* (*allocate)(size_t bytes, size_t alignment, void* user) = nullptr;
  void (*release)(void* block, size_t bytes, void* user) = nullptr;
  void* user = nullptr;
};
Allocator default_allocator() noexcept;

// Hands out 64-byte aligned pieces of one block. Without a block, it adds up the bytes that the pieces need.
class Carver {
 public:
  explicit Carver(void* base = nullptr) : base_(static_cast<char*>(base)) {}

  template <class T>
  T* take(std::size_t count) {
    offset_ = (offset_ + kCacheLine - 1) / kCacheLine * kCacheLine;
    char* at = base_ ? base_ + offset_ : nullptr;
    offset_ += count * sizeof(T);
    return reinterpret_cast<T*>(at);
  }

  template <class T>
  Plane<T> take_plane(int32_t rows, int32_t cols) {
    return plane_of(take<T>(plane_elements(rows, cols)), rows, cols);
  }

  BitPlane take_bits(int32_t rows, int32_t cols) {
    const int32_t words = round_up(cols, 64) / 64;
    return {take<uint64_t>(std::size_t(rows) * std::size_t(words)), rows, cols, words};
  }

  std::size_t bytes() const { return (offset_ + kCacheLine - 1) / kCacheLine * kCacheLine; }

 private:
  char* base_;
  std::size_t offset_ = 0;
};

// Owns one block. build() zeroes the block, which also touches every page. Movable, not copyable.
class Arena {
 public:
  Arena() = default;
  Arena(Arena&& other) noexcept;
  Arena& operator=(Arena&& other) noexcept;
  Arena(const Arena&) = delete;
  Arena& operator=(const Arena&) = delete;
  ~Arena();

  // Runs `carve` twice. Returns false and keeps nothing when the allocator has no memory.
  template <class Carve>
  [[nodiscard]] bool build(const Allocator& allocator, Carve&& carve) {
    Carver measure;
    carve(measure);
    if (!acquire(allocator, measure.bytes())) return false;
    Carver hand_out(block_);
    carve(hand_out);
    return true;
  }
  // The same for constructors: throws std::bad_alloc when the allocator has no memory.
  template <class Carve>
  void build_or_throw(const Allocator& allocator, Carve&& carve) {
    if (!build(allocator, carve)) throw std::bad_alloc();
  }
  std::size_t bytes() const { return bytes_; }

 private:
  bool acquire(const Allocator& allocator, std::size_t bytes) noexcept;
  void reset() noexcept;
  Allocator allocator_{};
  void* block_ = nullptr;
  std::size_t bytes_ = 0;
};

}  // namespace overtake
