// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// Constant velocity and turn rate (CVTR, eq. 6), discretised exactly in the half-angle form:
//
//   the chord of an arc of length v dt that turns by omega dt is v dt sinc(omega dt / 2) long
//   and points to phi + omega dt / 2
//
// One formula covers straight and curved, forward and backward motion. The textbook form, v / omega (sin(phi + omega
// dt) - sin phi), loses its digits as omega goes to 0.
#pragma once

namespace overtake {

struct MotionState {
  double x_m = 0, y_m = 0, speed_mps = 0, course_rad = 0, yaw_rate_rps = 0;  // course wrapped to (-pi, pi]
};

// The entries of d next / d state that differ from the identity.
//
//        x  y  v    phi    omega
//   x    1  .  x_v  x_phi  x_omega
//   y    .  1  y_v  y_phi  y_omega
//   v    .  .  1    .      .
//   phi  .  .  .    1      phi_omega
//   om.  .  .  .    .      1
struct MotionJacobian {
  double x_v, x_phi, x_omega, y_v, y_phi, y_omega, phi_omega;
};

struct Advanced {
  MotionState state;
  MotionJacobian jacobian;
};

// The state dt_s later (negative: earlier, the exact inverse). `jacobian` may be null.
MotionState advance(const MotionState& state, double dt_s, MotionJacobian* jacobian = nullptr) noexcept;

}  // namespace overtake
