// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// Section 3: angle image (eq. 1). The reference's loop on vectors: stripes of two vectors, the row above in registers.
#pragma once

#include "core/math.h"
#include "kernels/angle_image.h"
#include "kernels/float_pair.h"
#include "kernels/simd.h"

namespace overtake::simd {

template <class V>
struct AngleRow {
  V range_m, elevation_rad, h_m, z_m;

  OVT_INLINE void read(const float* range, const float* elevation) {
    range_m = V::load(range);
    elevation_rad = V::load(elevation);
    V s, c;
    sin_cos_small_of(elevation_rad, s, c);
    h_m = range_m * c;
    z_m = range_m * s;
  }
};

// All rows of one stripe, as wide as V.
template <class V>
OVT_INLINE void angle_stripe(const AngleImageParams& params, Plane<const float> range_filled_m,
                             Plane<const float> elevation_filled_rad, Plane<float> angle_rad, int32_t c) {
  const V zero(0.0f), skip(params.skip_elevation_rad), undefined(kAngleUndefined);
  AngleRow<V> above;
  above.read(range_filled_m.row(0) + c, elevation_filled_rad.row(0) + c);
  for (int32_t r = 1; r < range_filled_m.rows; ++r) {
    AngleRow<V> own;
    own.read(range_filled_m.row(r) + c, elevation_filled_rad.row(r) + c);
    const auto missing = (above.range_m == zero) | (own.range_m == zero);
    V angle = undefined;
    if ((~missing).any()) {
      const auto touching = abs_of(above.elevation_rad - own.elevation_rad) < skip;
      angle = atan2_quarter_of(abs_of(above.z_m - own.z_m), abs_of(above.h_m - own.h_m));
      angle = select(missing, undefined, select(touching, V(kAngleSkipped), angle));
    }
    angle.store(angle_rad.row(r - 1) + c);
    above = own;
  }
  undefined.store(angle_rad.row(range_filled_m.rows - 1) + c);
}

template <class A>
void angle_image(const AngleImageParams& params, Plane<const float> range_filled_m,
                 Plane<const float> elevation_filled_rad, Plane<float> angle_rad, ColumnSpan columns) noexcept {
  const ColumnSpan own = columns.within(range_filled_m.cols);
  if (range_filled_m.rows == 0) return;
  int32_t c = own.first;
  for (; c + kSize<A> < own.last; c += FloatPair<A>::kCount)
    angle_stripe<FloatPair<A>>(params, range_filled_m, elevation_filled_rad, angle_rad, c);
  if (c < own.last) angle_stripe<Float<A>>(params, range_filled_m, elevation_filled_rad, angle_rad, c);
}

}  // namespace overtake::simd
