// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// Section 12: lanes are points of one path.
#pragma once

#include "kernels/place_path.h"
#include "kernels/simd.h"

namespace overtake::simd {

template <class A>
void place_path(const PathCar& car, const PathTimes& times, const LanePlaces& lane, int32_t count,
                const PathColumns& columns) noexcept {
  using V = Double<A>;
  for (int32_t k = 0; k < count; k += kDoubles<A>) {
    const PathPoint<V> p = place_path_point<V>(
        car, V::load(times.along_s + k), V::load(times.across_s + k), V::load(times.across_s2 + k),
        V::load(times.along_m2 + k), V::load(times.across_m2 + k), V::load(times.steady_along_m2 + k),
        V::load(times.steady_across_m2 + k), V::load(lane.x_m + k), V::load(lane.y_m + k),
        V::load(lane.heading_rad + k), V::load(lane.ahead_m + k), V::load(lane.left_m + k), V::load(lane.turn_rad + k));
    p.x_m.store(columns.x_m + k);
    p.y_m.store(columns.y_m + k);
    p.course_rad.store(columns.course_rad + k);
    p.var_x.store(columns.var_x + k);
    p.var_y.store(columns.var_y + k);
    p.cov_xy.store(columns.cov_xy + k);
    p.steady_along_m.store(columns.steady_along_m + k);
    p.steady_across_m.store(columns.steady_across_m + k);
  }
}

}  // namespace overtake::simd
