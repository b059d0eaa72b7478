// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// Section 4: Savitzky-Golay smoothing down each column. The reference's loop on vectors. A window of 5 has a separate
// loop, in which the compiler unrolls the taps.
#pragma once

#include "kernels/simd.h"
#include "kernels/smooth_sg.h"

namespace overtake::simd {

struct SmoothTaps {
  const float* row[2 * kMaxHalfWindow + 1];
  float weight[2 * kMaxHalfWindow + 1];
};

// Reflect-101 (the border row is not repeated), repeated as often as needed.
OVT_INLINE int32_t mirror_row(int32_t r, int32_t rows) {
  if (rows == 1) return 0;
  while (r < 0 || r >= rows) r = r < 0 ? -r : 2 * (rows - 1) - r;
  return r;
}

template <class A>
OVT_INLINE void smooth_row(const SmoothTaps& tap, int32_t taps, const float* own_row, ColumnSpan columns, float* out) {
  const Float<A> zero(0.0f), undefined(kAngleUndefined);
  for (int32_t c = columns.first; c < columns.last; c += kSize<A>) {
    const Float<A> own = Float<A>::load(own_row + c);
    if (!(own != undefined).any()) {  // whole vectors of sky, or of rows without a layer
      undefined.store(out + c);
      continue;
    }
    Float<A> sum = zero, weight_sum = zero;
    for (int32_t t = 0; t < taps; ++t) {
      const Float<A> angle = Float<A>::load(tap.row[t] + c), weight(tap.weight[t]);
      const Mask<A> defined = angle >= zero;
      sum = add_where(defined, sum, weight * angle);
      weight_sum = add_where(defined, weight_sum, weight);
    }
    const Mask<A> enough = abs_of(weight_sum) >= Float<A>(kLeastSmoothWeight);
    const Float<A> alone = select(own == Float<A>(kAngleSkipped), zero, own);
    Float<A> value = select(enough, sum / weight_sum, alone);
    value = select(value == undefined, Float<A>(kBesideUndefined), value);
    select(own == undefined, undefined, value).store(out + c);
  }
}

template <class A>
void smooth_sg(const SmoothSgParams& params, int32_t pairs, Plane<const float> angle_rad, Plane<float> smooth_rad,
               ColumnSpan columns) noexcept {
  OVT_CHECK(pairs >= 0 && pairs <= angle_rad.rows && params.half_window <= kMaxHalfWindow);
  const int32_t half = params.half_window, taps = 2 * half + 1;
  const ColumnSpan own = columns.within(angle_rad.cols);
  for (int32_t r = 0; r < pairs; ++r) {
    SmoothTaps tap;
    for (int32_t t = 0; t < taps; ++t) {
      tap.row[t] = angle_rad.row(mirror_row(r + t - half, pairs));
      tap.weight[t] = params.weight[t < half ? half - t : t - half];
    }
    if (taps == 5)
      smooth_row<A>(tap, 5, angle_rad.row(r), own, smooth_rad.row(r));
    else
      smooth_row<A>(tap, taps, angle_rad.row(r), own, smooth_rad.row(r));
  }
  for (int32_t r = pairs; r < smooth_rad.rows; ++r)
    for (int32_t c = own.first; c < own.last; c += kSize<A>) Float<A>(kAngleUndefined).store(smooth_rad.row(r) + c);
}

}  // namespace overtake::simd
