// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// Section 5c: smoke and dust are not obstacles. Words of 64 columns: dark pixels are rare without smoke, and stand
// alone or in small groups. So each looks at its own window, a row of it at a time.
#pragma once

#include "core/math.h"
#include "kernels/drop_smoke.h"
#include "kernels/near_rows.h"
#include "kernels/simd.h"

namespace overtake::simd {

// The 64 neighbours of a pixel as bits of a word: 13 columns of each row above and below it, then its own row without
// itself.
constexpr int32_t kWindowCols = 2 * kSmokeCols + 1, kWindowRows = 2 * kSmokeRows + 1;
static_assert(kWindowCols * kWindowRows == 65);
template <class F>
OVT_INLINE uint64_t make_window(F&& columns_of_row) {
  constexpr uint64_t kLeft = (uint64_t(1) << kSmokeCols) - 1, kAll = (uint64_t(1) << kWindowCols) - 1;
  uint64_t window = 0;
  int32_t place = 0;
#pragma GCC unroll 5
  for (int32_t i = 0; i < kWindowRows; ++i) {
    if (i == kSmokeRows) continue;
    window |= (columns_of_row(i) & kAll) << place;
    place += kWindowCols;
  }
  const uint64_t own = columns_of_row(kSmokeRows);
  return window | ((own & kLeft) | (own >> 1 & kLeft << kSmokeCols)) << place;
}

// The windows of the pixels of a word. Bit c of low[i] belongs to column c - kSmokeCols of the word; high goes on.
struct WindowBits {
  uint64_t low[kWindowRows], high[kWindowRows];

  OVT_INLINE WindowBits(ConstBitPlane bits, int32_t r, int32_t w) {
    for (int32_t i = 0; i < kWindowRows; ++i) {
      const int32_t row = r + i - kSmokeRows;
      low[i] = high[i] = 0;
      if (row < 0 || row >= bits.rows) continue;
      const uint64_t *in = bits.row(row), own = in[w];
      const uint64_t before = w > 0 ? in[w - 1] : 0, after = w + 1 < bits.words_per_row ? in[w + 1] : 0;
      low[i] = own << kSmokeCols | before >> (64 - kSmokeCols);
      high[i] = after << kSmokeCols | own >> (64 - kSmokeCols);
    }
  }
  OVT_INLINE uint64_t at(int32_t c) const {  // column of the word
    return make_window([&](int32_t i) OVT_INLINED { return low[i] >> c | high[i] << 1 << (63 - c); });
  }
};

// The ranges around the pixels of a row. Beyond the image's edge rows are those of the edge: no bit is set there.
struct WindowRanges {
  const float* row[kWindowRows];

  OVT_INLINE WindowRanges(Plane<const float> range_m, int32_t r) {
    for (int32_t i = 0; i < kWindowRows; ++i) {
      const int32_t at = r + i - kSmokeRows;
      row[i] = range_m.row(at < 0 ? 0 : at < range_m.rows ? at : range_m.rows - 1);
    }
  }
  // The neighbours of the pixel of column c whose ranges differ from its own by less than limit_m.
  template <class A>
  OVT_INLINE uint64_t find_within(int32_t c, float limit_m) const {
    const Float<A> own(row[kSmokeRows][c]), limit(limit_m);
    return make_window([&](int32_t i) OVT_INLINED {
      uint64_t bits = 0;
      for (int32_t k = 0; k < kWindowCols; k += kSize<A>)
        bits |= uint64_t((abs_of(Float<A>::load(row[i] + c - kSmokeCols + k) - own) < limit).bits()) << k;
      return bits;
    });
  }
};

// The dark pixels of the word that begins at `points`, with `cols` columns.
template <class A>
OVT_INLINE uint64_t find_dark(const ScanTable& scan, const int32_t* points, int32_t cols, uint64_t nonground,
                              Float<A> limit) {
  uint64_t dark = nonground;  // filled gaps
  for (int32_t shift = 0; shift < cols; shift += kSize<A>) {
    const Mask<A> has = (Int<A>::load(points + shift) > Int<A>(kNoPoint)) & Mask<A>::first(cols - shift);
    if (!has.any()) continue;
    const Mask<A> found = has & (NearRows<A>(points + shift, has, scan.capacity).get(scan.intensity) < limit);
    dark = (dark & ~(uint64_t(has.bits()) << shift)) | uint64_t(found.bits()) << shift;
  }
  return dark;
}

template <class A>
void drop_smoke(const DropSmokeParams& params, const ScanTable& scan, Plane<const float> range_filled_m,
                Plane<const int32_t> pixel_point, BitPlane nonground, BitPlane considered, BitPlane rough,
                BitPlane smoke) noexcept {
  const int32_t rows = nonground.rows, cols = nonground.cols, words_per_row = nonground.words_per_row;
  const float limit = params.dark_share * find_ground_intensity(scan, pixel_point, nonground);
  const bool may_be_smoke = limit > 0.0f;  // else there is no ground, or there are no intensities
  const BitPlane dark = smoke;             // at first
  uint64_t any_dark = 0;
  for (int32_t r = 0; r < rows; ++r)
    for (int32_t w = 0; w < words_per_row; ++w) {
      const int32_t left = cols - 64 * w < 64 ? cols - 64 * w : 64;
      const uint64_t own = nonground.row(r)[w];
      const uint64_t found =
          may_be_smoke ? find_dark<A>(scan, pixel_point.row(r) + 64 * w, left, own, Float<A>(limit)) : 0;
      dark.row(r)[w] = found;
      considered.row(r)[w] = own | found;
      rough.row(r)[w] = 0;
      any_dark |= found;
    }
  if (any_dark == 0) return;

  constexpr int32_t kKept = 2048;  // neighbours of the first dark pixels; those of others are found twice
  uint64_t kept[kKept];
  int32_t count = 0;
  for (int32_t r = 0; r < rows; ++r) {
    const WindowRanges ranges(range_filled_m, r);
    for (int32_t w = 0; w < words_per_row; ++w) {
      if (dark.row(r)[w] == 0) continue;
      const WindowBits window(considered, r, w);
      uint64_t found = 0;
      for (uint64_t left = dark.row(r)[w]; left != 0; left &= left - 1) {
        const int32_t shift = lowest_bit(left), c = 64 * w + shift;
        const uint64_t neighbours = window.at(shift) & ranges.find_within<A>(c, params.reach_m);
        if (count < kKept) kept[count] = neighbours;
        ++count;
        const uint64_t near =
            neighbours & ranges.find_within<A>(c, kSurface_m + kSurfaceShare * range_filled_m.row(r)[c]);
        const bool is_rough = float(count_bits(near)) <= params.near_share * float(count_bits(neighbours));
        found |= uint64_t(is_rough) << shift;
      }
      rough.row(r)[w] = found;
    }
  }
  count = 0;
  for (int32_t r = 0; r < rows; ++r) {
    const WindowRanges ranges(range_filled_m, r);
    for (int32_t w = 0; w < words_per_row; ++w) {
      if (dark.row(r)[w] == 0) continue;
      const WindowBits around(rough, r, w);
      uint64_t found = 0;
      for (uint64_t left = dark.row(r)[w]; left != 0; left &= left - 1) {
        const int32_t shift = lowest_bit(left), c = 64 * w + shift;
        const uint64_t among = around.at(shift);
        const uint64_t neighbours =
            count < kKept ? kept[count]
                          : WindowBits(considered, r, w).at(shift) & ranges.find_within<A>(c, params.reach_m);
        ++count;
        const bool is_smoke = float(count_bits(neighbours & among)) >= kRoughShare * float(count_bits(neighbours));
        found |= uint64_t(is_smoke) << shift;
      }
      smoke.row(r)[w] = found;
    }
  }
  for (int32_t r = 0; r < rows; ++r)
    for (int32_t w = 0; w < words_per_row; ++w) nonground.row(r)[w] &= ~smoke.row(r)[w];
}

}  // namespace overtake::simd
