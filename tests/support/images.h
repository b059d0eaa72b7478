// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// Small images for tests: planes with their own memory, and drawings of them.
//
// Padding and all pixels start as poison (NaN, a large integer), so a kernel that reads too much, or leaves a pixel
// unwritten, is detected. A drawing is one string with a line per row, like the comment above the test; a failed CHECK
// prints both drawings.
#pragma once

#include <cstdint>
#include <initializer_list>
#include <limits>
#include <string>
#include <type_traits>
#include <vector>

#include "core/plane.h"
#include "core/point_table.h"

namespace overtake::test {

template <class T>
class OwnedPlane {
 public:
  OwnedPlane(int32_t rows, int32_t cols)
      : rows_(rows),
        cols_(cols),
        stride_(round_up(cols + kRowPad, kRowAlign)),
        memory_(std::size_t(rows) * std::size_t(stride_) + 2 * kRowPad, poison()) {}
  OwnedPlane(std::initializer_list<std::initializer_list<T>> rows)
      : OwnedPlane(int32_t(rows.size()), int32_t(rows.begin()->size())) {
    int32_t r = 0;
    for (const auto& row : rows) {
      int32_t c = 0;
      for (const T value : row) view().at(r, c++) = value;
      ++r;
    }
  }

  Plane<T> view() { return {memory_.data() + kRowPad, rows_, cols_, stride_}; }
  operator Plane<T>() { return view(); }
  operator Plane<const T>() { return view(); }
  T& at(int32_t r, int32_t c) { return view().at(r, c); }
  OwnedPlane& fill(T value) {
    for (int32_t r = 0; r < rows_; ++r)
      for (int32_t c = 0; c < cols_; ++c) at(r, c) = value;
    return *this;
  }
  std::vector<T> row(int32_t r) { return {view().row(r), view().row(r) + cols_}; }

 private:
  static T poison() {
    if constexpr (std::is_floating_point_v<T>)
      return std::numeric_limits<T>::quiet_NaN();
    else
      return T(0x5a5a5a5a);
  }
  int32_t rows_, cols_, stride_;
  std::vector<T> memory_;
};

class OwnedBits {
 public:
  // All words start with every bit set: a kernel must write each word.
  OwnedBits(int32_t rows, int32_t cols)
      : rows_(rows), cols_(cols), words_(std::size_t(rows) * std::size_t(round_up(cols, 64) / 64), ~uint64_t(0)) {}
  // '#' is a set bit.
  OwnedBits(std::initializer_list<const char*> picture)
      : OwnedBits(int32_t(picture.size()), int32_t(std::string(*picture.begin()).size())) {
    clear();
    int32_t r = 0;
    for (const std::string line : picture) {
      for (int32_t c = 0; c < cols_; ++c)
        if (line[std::size_t(c)] == '#') view().set(r, c);
      ++r;
    }
  }

  BitPlane view() { return {words_.data(), rows_, cols_, round_up(cols_, 64) / 64}; }
  operator BitPlane() { return view(); }
  operator ConstBitPlane() { return view(); }
  OwnedBits& clear() {
    for (uint64_t& word : words_) word = 0;
    return *this;
  }

 private:
  int32_t rows_, cols_;
  std::vector<uint64_t> words_;
};

inline std::string drawn(std::initializer_list<const char*> lines) {
  std::string all;
  for (const char* line : lines) all += std::string(line) + "\n";
  return all;
}

inline std::string art_of(ConstBitPlane bits) {
  std::string all;
  for (int32_t r = 0; r < bits.rows; ++r) {
    for (int32_t c = 0; c < bits.cols; ++c) all += bits.test(r, c) ? '#' : '.';
    all += '\n';
  }
  return all;
}

// '.' none, '_' ground, then 1 .. 9, a .. z.
inline std::string art_of(Plane<const int32_t> labels) {
  std::string all;
  for (int32_t r = 0; r < labels.rows; ++r) {
    for (int32_t c = 0; c < labels.cols; ++c) {
      const int32_t label = labels.at(r, c);
      all += label == kLabelNone     ? '.'
             : label == kLabelGround ? '_'
             : label < 10            ? char('0' + label)
             : label < 36            ? char('a' + label - 10)
                                     : '?';
    }
    all += '\n';
  }
  return all;
}

// Whether the bits at and after cols are zero in every row.
inline bool tail_is_clear(ConstBitPlane bits) {
  for (int32_t r = 0; r < bits.rows; ++r)
    for (int32_t c = bits.cols; c < bits.words_per_row * 64; ++c)
      if (bits.row(r)[c >> 6] >> (c & 63) & 1u) return false;
  return true;
}

}  // namespace overtake::test
