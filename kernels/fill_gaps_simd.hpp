// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// Section 2: fills gaps of the range image. The reference's loop on vectors.
#pragma once

#include "kernels/fill_gaps.h"
#include "kernels/simd.h"

namespace overtake::simd {

template <class A>
void fill_gaps(const FillGapsParams& params, Plane<const float> range_m, Plane<const float> elevation_rad,
               Plane<float> range_filled_m, Plane<float> elevation_filled_rad, ColumnSpan columns) noexcept {
  const Float<A> zero(0.0f), half(0.5f), limit_floor_m(params.limit_m), limit_share(params.limit_share);
  const ColumnSpan own_columns = columns.within(range_m.cols);
  for (int32_t r = 0; r < range_m.rows; ++r) {
    // The top and the bottom row read themselves as the missing neighbour; a gap has no return, so none is filled.
    const int32_t r_above = r > 0 ? r - 1 : 0, r_below = r + 1 < range_m.rows ? r + 1 : r;
    const float *own_row = range_m.row(r), *up_row = range_m.row(r_above), *down_row = range_m.row(r_below);
    const float *e_row = elevation_rad.row(r), *e_up_row = elevation_rad.row(r_above);
    const float* e_down_row = elevation_rad.row(r_below);
    float *range_out = range_filled_m.row(r), *e_out = elevation_filled_rad.row(r);
    for (int32_t c = own_columns.first; c < own_columns.last; c += kSize<A>) {
      const Float<A> own = Float<A>::load(own_row + c);
      const Float<A> up = Float<A>::load(up_row + c), down = Float<A>::load(down_row + c);
      const Float<A> limit_m = max_of(limit_floor_m, limit_share * min_of(up, down));
      const Mask<A> fill = (own == zero) & (up > zero) & (down > zero) & (abs_of(up - down) < limit_m);
      const Float<A> mean_e = (Float<A>::load(e_up_row + c) + Float<A>::load(e_down_row + c)) * half;
      select(fill, (up + down) * half, own).store(range_out + c);
      select(fill, mean_e, Float<A>::load(e_row + c)).store(e_out + c);
    }
  }
}

}  // namespace overtake::simd
