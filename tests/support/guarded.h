// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// Memory with guards: every piece lies between two runs of guard bytes. So a kernel that writes beyond a piece is
// detected, even if the memory belongs to another piece.
#pragma once

#include <cstdint>
#include <cstring>
#include <memory>
#include <string>
#include <vector>

#include "core/plane.h"

namespace overtake::test {

class Guarded {
 public:
  template <class T>
  T* take(const std::string& name, std::size_t count) {
    return static_cast<T*>(take_bytes(name, count * sizeof(T)));
  }
  template <class T>
  Plane<T> take_plane(const std::string& name, int32_t rows, int32_t cols) {
    const int32_t stride = round_up(cols + kRowPad, kRowAlign);
    T* lead = take<T>(name, std::size_t(rows) * std::size_t(stride) + 2 * kRowPad);
    return {lead + kRowPad, rows, cols, stride};
  }
  BitPlane take_bits(const std::string& name, int32_t rows, int32_t cols) {
    const int32_t words = round_up(cols, 64) / 64;
    return {take<uint64_t>(name, std::size_t(rows) * std::size_t(words)), rows, cols, words};
  }
  // All columns of a table, with padding for whole vectors.
  template <class Table>
  void take_table(const std::string& name, Table& table, int32_t capacity) {
    table.capacity = round_up(capacity, kRowAlign);
    for_each_column(table, [&](const char* column_name, auto*& column) {
      column = take<std::remove_reference_t<decltype(*column)>>(name + "." + column_name, std::size_t(table.capacity));
    });
  }

  // Name of the first piece with a changed guard; empty if none.
  std::string broken() const {
    unsigned char whole[kFence];
    std::memset(whole, kGuard, kFence);
    for (const Piece& piece : pieces_)
      if (std::memcmp(piece.base, whole, kFence) != 0 ||
          std::memcmp(piece.base + kFence + piece.bytes, whole, kFence) != 0)
        return piece.name;
    return "";
  }

 private:
  static constexpr std::size_t kFence = 128;
  static constexpr unsigned char kGuard = 0xa5, kPoison = 0xff;  // poison: NaN as a float, -1 as an integer

  struct Piece {
    std::string name;
    std::unique_ptr<unsigned char[]> memory;
    unsigned char* base;
    std::size_t bytes;
  };

  void* take_bytes(const std::string& name, std::size_t bytes) {
    Piece piece;
    piece.name = name;
    piece.bytes = bytes;
    piece.memory = std::make_unique<unsigned char[]>(bytes + 2 * kFence + kCacheLine);
    const auto address = reinterpret_cast<std::uintptr_t>(piece.memory.get());
    piece.base = piece.memory.get() + (kCacheLine - address % kCacheLine) % kCacheLine;
    std::memset(piece.base, kGuard, bytes + 2 * kFence);
    std::memset(piece.base + kFence, kPoison, bytes);
    pieces_.push_back(std::move(piece));
    return pieces_.back().base + kFence;
  }
  std::vector<Piece> pieces_;
};

}  // namespace overtake::test
