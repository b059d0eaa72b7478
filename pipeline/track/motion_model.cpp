// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
#include "pipeline/track/motion_model.h"

#include <cmath>

#include "core/math.h"

namespace overtake {
namespace {

// d sinc(h) / dh = (cos h - sinc h) / h. Below 1/4 that difference loses its digits; there the function uses the
// series. Its first omitted term is 12 h^11 / 13!, below 1e-14 of the sum.
double sinc_slope(double h, double cos_h, double sinc_h) noexcept {
  if (std::fabs(h) >= 0.25) return (cos_h - sinc_h) / h;
  const double z = h * h;
  return h * (-1.0 / 3.0 + z * (1.0 / 30.0 + z * (-1.0 / 840.0 + z * (1.0 / 45360.0 + z * (-1.0 / 3991680.0)))));
}

}  // namespace

MotionState advance(const MotionState& state, double dt_s, MotionJacobian* jacobian) noexcept {
  const double half_turn = 0.5 * state.yaw_rate_rps * dt_s;
  double sin_chord, cos_chord;
  sin_cos_f64(state.course_rad + half_turn, sin_chord, cos_chord);
  const double arc = state.speed_mps * dt_s, shrink = sinc(half_turn);

  MotionState next = state;
  next.x_m += arc * shrink * cos_chord;
  next.y_m += arc * shrink * sin_chord;
  next.course_rad = wrap_angle(state.course_rad + state.yaw_rate_rps * dt_s);

  if (jacobian) {
    double sin_half = 0, cos_half = 1;
    if (std::fabs(half_turn) >= 0.25) sin_cos_f64(half_turn, sin_half, cos_half);
    const double slope = sinc_slope(half_turn, cos_half, shrink);
    const double half_arc_dt = 0.5 * arc * dt_s;  // d half_turn / d omega = dt / 2
    *jacobian = {.x_v = dt_s * shrink * cos_chord,
                 .x_phi = -arc * shrink * sin_chord,
                 .x_omega = half_arc_dt * (slope * cos_chord - shrink * sin_chord),
                 .y_v = dt_s * shrink * sin_chord,
                 .y_phi = arc * shrink * cos_chord,
                 .y_omega = half_arc_dt * (slope * sin_chord + shrink * cos_chord),
                 .phi_omega = dt_s};
  }
  return next;
}

}  // namespace overtake
