// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// Section 11: lanes are cars.
#pragma once

#include "kernels/predict_paths.h"
#include "kernels/simd.h"

namespace overtake::simd {

template <class A>
OVT_INLINE void store_rows(Double<A> value, double* rows, int32_t cars, int32_t points) {
  double lane[kDoubles<A>];
  value.store(lane);
  for (int32_t i = 0; i < cars; ++i) rows[std::ptrdiff_t(i) * points] = lane[i];
}

template <class A>
uint32_t predict_paths(const PredictPathsParams& params, const PathCars& cars, int32_t count, int32_t points,
                       const PathRows& rows) noexcept {
  using V = Double<A>;
  const V dt(params.step_s),
      noise[5] = {V(params.noise[0]), V(params.noise[1]), V(params.noise[2]), V(params.noise[3]), V(params.noise[4])};
  uint32_t left = 0;
  for (int32_t first = 0; first < count; first += kDoubles<A>) {
    const int32_t in_use = count - first < kDoubles<A> ? count - first : kDoubles<A>;
    const auto p = [&](int32_t entry) OVT_INLINED { return V::load(cars.covariance[entry] + first); };
    PathState<V> s;
    s.x = V::load(cars.x_m + first), s.y = V::load(cars.y_m + first), s.v = V::load(cars.speed_mps + first);
    s.course = V::load(cars.course_rad + first), s.omega = V::load(cars.yaw_rate_rps + first);
    s.p00 = p(0), s.p01 = s.p10 = p(1), s.p11 = p(2), s.p02 = p(3), s.p12 = p(4), s.p22 = p(5);
    s.p03 = s.p30 = p(6), s.p13 = s.p31 = p(7), s.p23 = p(8), s.p33 = p(9);
    s.p04 = p(10), s.p14 = p(11), s.p24 = p(12), s.p34 = p(13), s.p44 = p(14);
    const PathMotion<V> motion(s, dt);
    auto plain = (abs_of(motion.half_turn) < V(0.1)) & (abs_of(s.course) <= V(4.0));
    for (int32_t k = 0; k < points; ++k) {
      for (int32_t step = 0; step < params.steps; ++step) step_path(s, motion, dt, noise);
      symmetrise_path(s);
      plain = plain & (s.p00 + s.p11 < V(1e6));
      const std::ptrdiff_t row = std::ptrdiff_t(first) * points + k;
      store_rows(s.x, rows.x_m + row, in_use, points);
      store_rows(s.y, rows.y_m + row, in_use, points);
      store_rows(s.course, rows.course_rad + row, in_use, points);
      store_rows(s.v, rows.speed_mps + row, in_use, points);
      store_rows(s.p00, rows.var_x + row, in_use, points);
      store_rows(s.p11, rows.var_y + row, in_use, points);
      store_rows(s.p10, rows.cov_xy + row, in_use, points);
    }
    double marks[kDoubles<A>];
    select(plain, V(0.0), V(1.0)).store(marks);
    for (int32_t i = 0; i < in_use; ++i) left |= uint32_t(marks[i] != 0.0) << (first + i);
  }
  return left;
}

}  // namespace overtake::simd
