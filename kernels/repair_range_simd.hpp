// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// Section 6: repair of the non-ground range image, NGRIR (eq. 3), on words of 64 columns. Two shifted words show which
// pixels have a pair k apart. Ranges are read only there, and such pixels are rare.
//
//   bits of c - k      . . # # # .      & bits of c + k      & ~nonground
#pragma once

#include "core/math.h"
#include "kernels/repair_range.h"
#include "kernels/simd.h"

namespace overtake::simd {

// Bits of the columns k to the left (bit c holds column c - k), and k to the right. 0 < k < 64; no columns beyond.
OVT_INLINE uint64_t bits_from_left(const uint64_t* words, int32_t w, int32_t k) {
  return (words[w] << k) | (w > 0 ? words[w - 1] >> (64 - k) : 0);
}
OVT_INLINE uint64_t bits_from_right(const uint64_t* words, int32_t w, int32_t words_per_row, int32_t k) {
  return (words[w] >> k) | (w + 1 < words_per_row ? words[w + 1] << (64 - k) : 0);
}

// The mean over the pairs of kSize pixels at range_m, elevation_rad. Returns the mask of repaired pixels. The bits of
// pair[k] from `shift` on mark the pixels with a pair.
template <class A>
OVT_INLINE Mask<A> repair_pixels(const float* range_m, const float* elevation_rad, const uint64_t* pair, int32_t half,
                                 int32_t shift, Float<A> limit_m, Float<A>& range_mean_m,
                                 Float<A>& elevation_mean_rad) {
  const Float<A> zero(0.0f);
  Float<A> range_sum = zero, elevation_sum = zero, pixels = zero;
  for (int32_t k = 1; k <= half; ++k) {
    const Float<A> left = Float<A>::load(range_m - k), right = Float<A>::load(range_m + k);
    const Mask<A> has = Mask<A>::from_bits(uint32_t(pair[k] >> shift)) & (abs_of(left - right) < limit_m);
    range_sum = add_where(has, range_sum, left + right);
    elevation_sum =
        add_where(has, elevation_sum, Float<A>::load(elevation_rad - k) + Float<A>::load(elevation_rad + k));
    pixels = add_where(has, pixels, Float<A>(2.0f));
  }
  const Mask<A> repaired = pixels > zero;
  range_mean_m = range_sum / pixels;  // 0 / 0 in lanes without a pair
  elevation_mean_rad = elevation_sum / pixels;
  return repaired;
}

// Repairs one pixel near the edge of an image whose columns wrap. The pixel is not non-ground.
OVT_INLINE void repair_wrapped_pixel(const float* range_m, const float* elevation_rad, ConstBitPlane nonground,
                                     int32_t r, int32_t c, int32_t half, float limit_m, float* range_out_m,
                                     float* elevation_out_rad, BitPlane nonground_repaired) {
  const int32_t cols = nonground.cols;
  float range_sum = 0.0f, elevation_sum = 0.0f, pixels = 0.0f;
  for (int32_t k = 1; k <= half; ++k) {
    const int32_t left = c - k < 0 ? c - k + cols : c - k, right = c + k >= cols ? c + k - cols : c + k;
    if (!nonground.test(r, left) || !nonground.test(r, right)) continue;
    if (!(abs_of(range_m[left] - range_m[right]) < limit_m)) continue;
    range_sum = range_sum + (range_m[left] + range_m[right]);
    elevation_sum = elevation_sum + (elevation_rad[left] + elevation_rad[right]);
    pixels = pixels + 2.0f;
  }
  const bool repaired = pixels > 0.0f;
  range_out_m[c] = repaired ? range_sum / pixels : 0.0f;
  elevation_out_rad[c] = repaired ? elevation_sum / pixels : 0.0f;
  if (repaired) nonground_repaired.set(r, c);
}

template <class A>
void repair_range(const RepairRangeParams& params, Plane<const float> range_filled_m,
                  Plane<const float> elevation_filled_rad, ConstBitPlane nonground, Plane<float> range_repaired_m,
                  Plane<float> elevation_repaired_rad, BitPlane nonground_repaired, ColumnSpan columns) noexcept {
  OVT_CHECK(params.half_window >= 0 && params.half_window <= kMaxRepairHalfWindow);
  const int32_t cols = nonground.cols, words_per_row = nonground.words_per_row;
  const ColumnSpan own_columns = columns.within(cols);
  // On a narrow image that wraps, the two sides of the window must not meet: the pixels of a pair are always different.
  const int32_t arm = (cols - 1) / 2;
  const int32_t half = params.wraps && arm < params.half_window ? arm : params.half_window;
  const Float<A> limit_m(params.range_limit_m), zero(0.0f);
  constexpr uint64_t kGroup = (uint64_t(1) << kSize<A>)-1;

  for (int32_t r = 0; r < nonground.rows; ++r) {
    const float *range_m = range_filled_m.row(r), *elevation_rad = elevation_filled_rad.row(r);
    float *range_out_m = range_repaired_m.row(r), *elevation_out_rad = elevation_repaired_rad.row(r);
    const uint64_t* words = nonground.row(r);
    uint64_t* words_out = nonground_repaired.row(r);

    for (int32_t w = own_columns.first_word(); w < own_columns.end_word(); ++w) {
      const int32_t begin = 64 * w, end = begin + 64 < cols ? begin + 64 : cols;
      const uint64_t own = words[w];
      const uint64_t inside = end - begin < 64 ? (uint64_t(1) << (end - begin)) - 1 : ~uint64_t(0);
      uint64_t pair[kMaxRepairHalfWindow + 1];
      uint64_t any_pair = 0;
      for (int32_t k = 1; k <= half; ++k) {
        pair[k] = bits_from_left(words, w, k) & bits_from_right(words, w, words_per_row, k) & ~own & inside;
        any_pair |= pair[k];
      }
      if ((own | any_pair) == 0) {
        for (int32_t c = begin; c < end; c += kSize<A>) {
          zero.store(range_out_m + c);
          zero.store(elevation_out_rad + c);
        }
        words_out[w] = 0;
        continue;
      }

      uint64_t word_out = own;
      for (int32_t c = begin; c < end; c += kSize<A>) {
        const int32_t shift = c - begin;
        const Mask<A> keeps = Mask<A>::from_bits(uint32_t(own >> shift));
        Float<A> range_out = keep(keeps, Float<A>::load(range_m + c));
        Float<A> elevation_out = keep(keeps, Float<A>::load(elevation_rad + c));
        if ((any_pair >> shift) & kGroup) {
          Float<A> range_mean_m, elevation_mean_rad;
          const Mask<A> repaired = repair_pixels(range_m + c, elevation_rad + c, pair, half, shift, limit_m,
                                                 range_mean_m, elevation_mean_rad);
          range_out = select(repaired, range_mean_m, range_out);
          elevation_out = select(repaired, elevation_mean_rad, elevation_out);
          word_out |= uint64_t(repaired.bits()) << shift;
        }
        range_out.store(range_out_m + c);
        elevation_out.store(elevation_out_rad + c);
      }
      words_out[w] = word_out;
    }

    // The windows of the pixels at the edges end in these words.
    const uint64_t last_words = words[words_per_row - 1] | (words_per_row > 1 ? words[words_per_row - 2] : 0);
    if (!params.wraps || (words[0] | last_words) == 0) continue;
    for (int32_t i = 0; i < 2 * half; ++i) {
      const int32_t c = i < half ? i : cols - 2 * half + i;
      if (c >= own_columns.first && c < own_columns.last && !nonground.test(r, c))
        repair_wrapped_pixel(range_m, elevation_rad, nonground, r, c, half, params.range_limit_m, range_out_m,
                             elevation_out_rad, nonground_repaired);
    }
  }
}

}  // namespace overtake::simd
