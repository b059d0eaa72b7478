// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// Section 5: ground removal, a word of 64 columns at a time.
#pragma once

#include "kernels/mark_ground.h"
#include "kernels/simd.h"

namespace overtake::simd {

template <class A>
void mark_ground(const MarkGroundParams& params, int32_t row_count, Plane<const float> angle_smooth_rad,
                 Plane<const float> range_filled_m, Plane<const int32_t> pixel_point, BitPlane nonground,
                 ColumnSpan columns) noexcept {
  OVT_CHECK(row_count >= 0 && row_count <= nonground.rows + 1);
  const Float<A> zero(0.0f), undefined(kAngleUndefined), threshold(params.threshold_rad);
  const Int<A> no_point(kNoPoint);
  const ColumnSpan own = columns.within(nonground.cols);
  for (int32_t w = own.first_word(); w < own.end_word(); ++w) {
    const int32_t begin = 64 * w, end = begin + 64 < nonground.cols ? begin + 64 : nonground.cols;
    const uint64_t inside = end - begin < 64 ? (uint64_t(1) << (end - begin)) - 1 : ~uint64_t(0);
    uint64_t below = 0;  // columns with a return in a lower row
    for (int32_t r = nonground.rows - 1; r >= 0; --r) {
      uint64_t steep = 0, unknown = 0, returns = 0;
      for (int32_t c = begin; c < end; c += kSize<A>) {
        const Float<A> angle = Float<A>::load(angle_smooth_rad.row(r) + c);
        const Mask<A> has_return = ~(Int<A>::load(pixel_point.row(r) + c) == no_point);
        const Mask<A> exists = Float<A>::load(range_filled_m.row(r) + c) > zero;
        steep |= uint64_t(((angle > threshold) & exists).bits()) << (c - begin);
        unknown |= uint64_t(((angle == undefined) & exists & has_return).bits()) << (c - begin);
        returns |= uint64_t(has_return.bits()) << (c - begin);
      }
      nonground.row(r)[w] = r < row_count - 1 ? (steep | (unknown & below)) & inside : 0;
      below |= returns;
    }
  }
}

}  // namespace overtake::simd
