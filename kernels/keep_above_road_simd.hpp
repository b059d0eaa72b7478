// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// Ground removal by height, a word of 64 columns at a time.
#pragma once

#include "core/math.h"
#include "kernels/keep_above_road.h"
#include "kernels/simd.h"

namespace overtake::simd {

template <class A>
void keep_above_road(const Transform& T_vehicle_sensor, Plane<const float> range_filled_m,
                     Plane<const float> elevation_filled_rad, Plane<float> range_repaired_m,
                     Plane<float> elevation_repaired_rad, BitPlane nonground_repaired) noexcept {
  const Float<A> zero(0.0f), sensor_height_m(T_vehicle_sensor.t[2]), road_m(kRoadHeight_m);
  const int32_t cols = range_filled_m.cols;
  for (int32_t r = 0; r < range_filled_m.rows; ++r)
    for (int32_t w = 0; w < nonground_repaired.words_per_row; ++w) {
      const int32_t begin = 64 * w, end = begin + 64 < cols ? begin + 64 : cols;
      const uint64_t inside = end - begin < 64 ? (uint64_t(1) << (end - begin)) - 1 : ~uint64_t(0);
      uint64_t word = 0;
      for (int32_t c = begin; c < end; c += kSize<A>) {
        const Float<A> range = Float<A>::load(range_filled_m.row(r) + c);
        const Float<A> elevation = Float<A>::load(elevation_filled_rad.row(r) + c);
        Float<A> sine, cosine;
        sin_cos_small_of(elevation, sine, cosine);
        const Mask<A> kept = (range > zero) & (sensor_height_m + range * sine > road_m);
        keep(kept, range).store(range_repaired_m.row(r) + c);
        keep(kept, elevation).store(elevation_repaired_rad.row(r) + c);
        word |= uint64_t(kept.bits()) << (c - begin);
      }
      nonground_repaired.row(r)[w] = word & inside;
    }
}

}  // namespace overtake::simd
