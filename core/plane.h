// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// Views of images. A view is a small struct copied by value; the arena owns the memory.
//
//            <- lead ->|<------- cols ------->|<- pad, >= kRowPad ->|
//   row 0     16 wide  | c = 0 ...            | never meaningful     |
//   row 1  (row 0's pad)| ...                  | ...                  |
//
// Every row starts on a cache line. The kRowPad columns left of a row (the pad of the row above, or the lead of row 0)
// and right of the row are always safe to read and write. So a loop may run over whole vectors and read a window to
// either side, and needs no separate code for the last columns.
#pragma once

#include <cstddef>
#include <cstdint>

#include "core/check.h"

namespace overtake {

inline constexpr int32_t kRowAlign = 16;  // 4-byte elements: one cache line, one AVX-512 register
inline constexpr int32_t kRowPad = 16;    // columns of padding on either side of a row
inline constexpr std::size_t kCacheLine = 64;
inline constexpr float kNoReturn = 0.0f;  // range of a pixel without a return
inline constexpr int32_t kNoPoint = -1;   // pixel_point of a pixel that holds no point

OVT_INLINE constexpr int32_t round_up(int32_t n, int32_t multiple) { return (n + multiple - 1) / multiple * multiple; }

// Row-major image of 4-byte elements.
template <class T>
struct Plane {
  static_assert(sizeof(T) == 4);
  T* data = nullptr;
  int32_t rows = 0, cols = 0, stride = 0;

  OVT_INLINE T* row(int32_t r) const { return data + std::ptrdiff_t(r) * stride; }
  OVT_INLINE T& at(int32_t r, int32_t c) const {
    OVT_CHECK(r >= 0 && r < rows && c >= 0 && c < cols);
    return data[std::ptrdiff_t(r) * stride + c];
  }
  OVT_INLINE operator Plane<const T>() const { return {data, rows, cols, stride}; }
};

// Bytes of a plane, and the plane in that memory.
inline int32_t plane_stride(int32_t cols) { return round_up(cols + kRowPad, kRowAlign); }
inline std::size_t plane_elements(int32_t rows, int32_t cols) {
  return std::size_t(rows) * std::size_t(plane_stride(cols)) + 2 * kRowPad;
}
template <class T>
Plane<T> plane_of(T* memory, int32_t rows, int32_t cols) {
  return {memory ? memory + kRowPad : nullptr, rows, cols, plane_stride(cols)};
}

// One bit per pixel, 64 columns per word: column c is bit c % 64 of word c / 64. Bits at and after cols are zero; code
// that writes a row must keep them zero.
template <class Word>
struct BitsOf {
  Word* words = nullptr;
  int32_t rows = 0, cols = 0, words_per_row = 0;

  OVT_INLINE Word* row(int32_t r) const { return words + std::ptrdiff_t(r) * words_per_row; }
  OVT_INLINE bool test(int32_t r, int32_t c) const {
    OVT_CHECK(r >= 0 && r < rows && c >= 0 && c < cols);
    return (row(r)[c >> 6] >> (c & 63)) & 1u;
  }
  OVT_INLINE void set(int32_t r, int32_t c) const {
    OVT_CHECK(r >= 0 && r < rows && c >= 0 && c < cols);
    row(r)[c >> 6] |= Word(1) << (c & 63);
  }
  OVT_INLINE void clear_row(int32_t r) const {
    for (int32_t w = 0; w < words_per_row; ++w) row(r)[w] = 0;
  }
  OVT_INLINE operator BitsOf<const Word>() const { return {words, rows, cols, words_per_row}; }
};
using BitPlane = BitsOf<uint64_t>;
using ConstBitPlane = BitsOf<const uint64_t>;

// Columns [first, last) of an image: those that a kernel writes; it may read any. Both bounds lie between words of bits
// or at the image's edge, so no two spans share a word, a vector or a cache line.
struct ColumnSpan {
  int32_t first = 0, last = INT32_MAX;

  OVT_INLINE ColumnSpan within(int32_t cols) const { return {first, last < cols ? last : cols}; }
  OVT_INLINE int32_t first_word() const { return first / 64; }
  OVT_INLINE int32_t end_word() const { return (last + 63) / 64; }  // of a span within an image
};

}  // namespace overtake
