// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// Section 7 of kernels/README.md: links neighbouring pixels of one object (eq. 2; Bogoslavskyi & Stachniss 2016).
#pragma once

#include "core/math.h"
#include "core/plane.h"

namespace overtake {

// beta > threshold, of two pixels and the angle between their beams. The denominator d1 - d2 cos alpha of eq. 2 is
// never negative, so the tangents compare as the angles do. Equal ranges with no angle between the beams (two layers at
// one elevation) give no link: 0 > 0 is false. V: float, or a vector of floats.
template <class V>
OVT_INLINE auto pixels_join(V range_a_m, V range_b_m, V sin_alpha, V cos_alpha, V tan_threshold) {
  const V d1 = max_of(range_a_m, range_b_m), d2 = min_of(range_a_m, range_b_m);
  return d2 * sin_alpha > tan_threshold * (d1 - d2 * cos_alpha);
}

// beta = atan2(d2 sin a, d1 - d2 cos a) > th_seg, d1 = max, d2 = min of the ranges, without the arctangent:
// d2 sin a > tan(th) (d1 - d2 cos a). a is the column pitch to the right, and |e - e_below| downwards, at most pi/2
// (neighbouring layers are a degree or two apart).
//   reads    range_repaired_m elevation_repaired_rad nonground_repaired
//   writes   link_right (pixel joins column + 1; the last column joins column 0 when wrapping), link_down, every word
//   cost     sin and cos of one small angle per pixel    agrees  exactly on every ISA
struct LinkPixelsParams {
  float tan_threshold;  // of th_seg
  float sin_pitch, cos_pitch;
  bool wraps;
};
namespace ref {
void link_pixels(const LinkPixelsParams& params, Plane<const float> range_repaired_m,
                 Plane<const float> elevation_repaired_rad, ConstBitPlane nonground_repaired, BitPlane link_right,
                 BitPlane link_down, ColumnSpan columns = {}) noexcept;
}

}  // namespace overtake
