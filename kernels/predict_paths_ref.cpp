// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
#include "kernels/predict_paths.h"

namespace overtake::ref {

uint32_t predict_paths(const PredictPathsParams& params, const PathCars& cars, int32_t count, int32_t points,
                       const PathRows& rows) noexcept {
  uint32_t left = 0;
  for (int32_t i = 0; i < count; ++i) {
    const auto& p = cars.covariance;
    PathState<double> s;
    s.x = cars.x_m[i], s.y = cars.y_m[i], s.v = cars.speed_mps[i];
    s.course = cars.course_rad[i], s.omega = cars.yaw_rate_rps[i];
    s.p00 = p[0][i], s.p01 = s.p10 = p[1][i], s.p11 = p[2][i], s.p02 = p[3][i], s.p12 = p[4][i], s.p22 = p[5][i];
    s.p03 = s.p30 = p[6][i], s.p13 = s.p31 = p[7][i], s.p23 = p[8][i], s.p33 = p[9][i];
    s.p04 = p[10][i], s.p14 = p[11][i], s.p24 = p[12][i], s.p34 = p[13][i], s.p44 = p[14][i];
    const PathMotion<double> motion(s, params.step_s);
    bool plain = abs_of(motion.half_turn) < 0.1 && abs_of(s.course) <= 4.0;
    for (int32_t k = 0; k < points; ++k) {
      for (int32_t step = 0; step < params.steps; ++step) step_path(s, motion, params.step_s, params.noise);
      symmetrise_path(s);
      plain = plain && s.p00 + s.p11 < 1e6;
      const int32_t row = i * points + k;
      rows.x_m[row] = s.x;
      rows.y_m[row] = s.y;
      rows.course_rad[row] = s.course;
      rows.speed_mps[row] = s.v;
      rows.var_x[row] = s.p00;
      rows.var_y[row] = s.p11;
      rows.cov_xy[row] = s.p10;
    }
    left |= uint32_t(!plain) << i;
  }
  return left;
}

}  // namespace overtake::ref
