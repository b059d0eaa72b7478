// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// Section 5c: smoke and dust are not obstacles. Words of 64 columns: dark pixels are rare without smoke, and only
// vectors with one look at their windows.
#pragma once

#include "core/math.h"
#include "kernels/drop_smoke.h"
#include "kernels/near_rows.h"
#include "kernels/simd.h"

namespace overtake::simd {

// The bits of a word and its neighbours: bit c of at(i, j) belongs to the pixel i rows below and j columns to the right
// of that of column c.
struct WindowBits {
  uint64_t words[2 * kSmokeRows + 1][2 * kSmokeCols + 1];

  OVT_INLINE WindowBits(ConstBitPlane bits, int32_t r, int32_t w) {
    for (int32_t i = -kSmokeRows; i <= kSmokeRows; ++i) {
      uint64_t* const out = words[i + kSmokeRows] + kSmokeCols;
      const int32_t row = r + i;
      if (row < 0 || row >= bits.rows) {
        for (int32_t j = -kSmokeCols; j <= kSmokeCols; ++j) out[j] = 0;
        continue;
      }
      const uint64_t *in = bits.row(row), own = in[w];
      const uint64_t before = w > 0 ? in[w - 1] : 0, after = w + 1 < bits.words_per_row ? in[w + 1] : 0;
      out[0] = own;
      for (int32_t j = 1; j <= kSmokeCols; ++j) {
        out[-j] = own << j | before >> (64 - j);
        out[j] = own >> j | after << (64 - j);
      }
    }
  }
  template <class A>
  OVT_INLINE Mask<A> at(int32_t i, int32_t j, int32_t shift) const {
    return Mask<A>::from_bits(uint32_t(words[i + kSmokeRows][j + kSmokeCols] >> shift));
  }
};

template <class A>
struct Neighbours {
  Float<A> all, counted;
};

// Counts the neighbours of kSize pixels from c on, and those of them in counts(i, j, difference of the ranges).
template <class A, class F>
OVT_INLINE Neighbours<A> count_neighbours(Plane<const float> range_m, const WindowBits& considered, float reach_m,
                                          int32_t r, int32_t c, int32_t shift, F&& counts) {
  const Float<A> reach(reach_m), own = Float<A>::load(range_m.row(r) + c), one(1.0f);
  Neighbours<A> n = {Float<A>(0.0f), Float<A>(0.0f)};
  for (int32_t i = -kSmokeRows; i <= kSmokeRows; ++i) {
    if (r + i < 0 || r + i >= range_m.rows) continue;
    const float* const row = range_m.row(r + i) + c;
    for (int32_t j = -kSmokeCols; j <= kSmokeCols; ++j) {
      if (i == 0 && j == 0) continue;
      const Float<A> apart = abs_of(Float<A>::load(row + j) - own);
      const Mask<A> has = considered.at<A>(i, j, shift) & (apart < reach);
      n.all = add_where(has, n.all, one);
      n.counted = add_where(has & counts(i, j, apart), n.counted, one);
    }
  }
  return n;
}

template <class A>
OVT_INLINE Mask<A> are_rough(const DropSmokeParams& params, Plane<const float> range_m, const WindowBits& considered,
                             int32_t r, int32_t c, int32_t shift) {
  const Float<A> surface = Float<A>(kSurface_m) + Float<A>(kSurfaceShare) * Float<A>::load(range_m.row(r) + c);
  const Neighbours<A> near =
      count_neighbours<A>(range_m, considered, params.reach_m, r, c, shift,
                          [&](int32_t, int32_t, Float<A> apart) OVT_INLINED { return apart < surface; });
  return near.counted <= Float<A>(params.near_share) * near.all;
}

template <class A>
OVT_INLINE Mask<A> are_among_rough(const DropSmokeParams& params, Plane<const float> range_m,
                                   const WindowBits& considered, const WindowBits& rough, int32_t r, int32_t c,
                                   int32_t shift) {
  const Neighbours<A> among =
      count_neighbours<A>(range_m, considered, params.reach_m, r, c, shift,
                          [&](int32_t i, int32_t j, Float<A>) OVT_INLINED { return rough.at<A>(i, j, shift); });
  return among.counted >= Float<A>(kRoughShare) * among.all;
}

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
  constexpr uint64_t kGroup = (uint64_t(1) << kSize<A>)-1;
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

  for (int32_t r = 0; r < rows; ++r)
    for (int32_t w = 0; w < words_per_row; ++w) {
      if (dark.row(r)[w] == 0) continue;
      const WindowBits window(considered, r, w);
      uint64_t found = 0;
      for (uint64_t left = dark.row(r)[w]; left != 0;) {
        const int32_t shift = lowest_bit(left) & ~(kSize<A> - 1);
        left &= ~(kGroup << shift);
        found |= uint64_t(are_rough<A>(params, range_filled_m, window, r, 64 * w + shift, shift).bits()) << shift;
      }
      rough.row(r)[w] = found & dark.row(r)[w];
    }
  for (int32_t r = 0; r < rows; ++r)
    for (int32_t w = 0; w < words_per_row; ++w) {
      if (dark.row(r)[w] == 0) continue;
      const WindowBits window(considered, r, w), around(rough, r, w);
      uint64_t found = 0;
      for (uint64_t left = dark.row(r)[w]; left != 0;) {
        const int32_t shift = lowest_bit(left) & ~(kSize<A> - 1);
        left &= ~(kGroup << shift);
        const Mask<A> mask = are_among_rough<A>(params, range_filled_m, window, around, r, 64 * w + shift, shift);
        found |= uint64_t(mask.bits()) << shift;
      }
      smoke.row(r)[w] = found & dark.row(r)[w];
    }
  for (int32_t r = 0; r < rows; ++r)
    for (int32_t w = 0; w < words_per_row; ++w) nonground.row(r)[w] &= ~smoke.row(r)[w];
}

}  // namespace overtake::simd
