// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// Section 11 of kernels/README.md: the predicted paths of a group of cars by eq. 6, for cars that drive as cars do.
#pragma once

#include "core/math.h"

namespace overtake {

inline constexpr int32_t kPathCars = 8;  // of one call

// One place per car. Every place is read, so all must hold numbers. Covariance: the lower triangle, row by row.
struct PathCars {
  double x_m[kPathCars] = {}, y_m[kPathCars] = {}, speed_mps[kPathCars] = {}, course_rad[kPathCars] = {},
         yaw_rate_rps[kPathCars] = {};
  double covariance[15][kPathCars] = {};
};

struct PredictPathsParams {
  double step_s;    // > 0
  int32_t steps;    // of a point
  double noise[5];  // added to the variances after each step
};

// Point k of car i is row i * points + k.
struct PathRows {
  double *x_m, *y_m, *course_rad, *speed_mps, *var_x, *var_y, *cov_xy;
};

// State and covariance of a car on its way. The covariance is symmetric again after each point. In between, only three
// pairs of entries can differ: (x, y), (x, phi) and (y, phi); the other pairs have the same bytes, by the same
// operations on the same values.
template <class V>
struct PathState {
  V x, y, v, course, omega;
  V p00, p01, p10, p11, p02, p12, p22, p03, p30, p13, p31, p23, p33, p04, p14, p24, p34, p44;
};

// What does not change on the way, because v and omega do not: of motion_model.h, with |half_turn| < 0.1.
template <class V>
struct PathMotion {
  V half_turn, arc, shrink, slope, half_arc_dt, turn;
  OVT_INLINE PathMotion(const PathState<V>& s, V dt) {
    half_turn = V(0.5) * s.omega * dt;
    arc = s.v * dt;
    const V z = half_turn * half_turn, one(1.0);
    shrink = one - z / V(6.0) * (one - z / V(20.0) * (one - z / V(42.0) * (one - z / V(72.0))));
    slope =
        half_turn * (V(-1.0 / 3.0) +
                     z * (V(1.0 / 30.0) + z * (V(-1.0 / 840.0) + z * (V(1.0 / 45360.0) + z * V(-1.0 / 3991680.0)))));
    half_arc_dt = V(0.5) * arc * dt;
    turn = s.omega * dt;
  }
};

// One step of predict() in track_filter.h: the same operations in the same order.
template <class V>
OVT_INLINE void step_path(PathState<V>& s, const PathMotion<V>& m, V dt, const V noise[5]) {
  V sine, cosine;
  sin_cos_f64_of(s.course + m.half_turn, sine, cosine);
  s.x = s.x + m.arc * m.shrink * cosine;
  s.y = s.y + m.arc * m.shrink * sine;
  s.course = wrap_once_of(s.course + m.turn);
  const V x_v = dt * m.shrink * cosine, x_phi = m.arc * V(-1.0) * m.shrink * sine,
          x_omega = m.half_arc_dt * (m.slope * cosine - m.shrink * sine);
  const V y_v = dt * m.shrink * sine, y_phi = m.arc * m.shrink * cosine,
          y_omega = m.half_arc_dt * (m.slope * sine + m.shrink * cosine);
  // Rows x, y and phi, then the columns.
  const V q00 = s.p00 + (x_v * s.p02 + x_phi * s.p30 + x_omega * s.p04);
  const V q01 = s.p01 + (x_v * s.p12 + x_phi * s.p31 + x_omega * s.p14);
  const V q02 = s.p02 + (x_v * s.p22 + x_phi * s.p23 + x_omega * s.p24);
  const V q03 = s.p03 + (x_v * s.p23 + x_phi * s.p33 + x_omega * s.p34);
  const V q04 = s.p04 + (x_v * s.p24 + x_phi * s.p34 + x_omega * s.p44);
  const V q10 = s.p10 + (y_v * s.p02 + y_phi * s.p30 + y_omega * s.p04);
  const V q11 = s.p11 + (y_v * s.p12 + y_phi * s.p31 + y_omega * s.p14);
  const V q12 = s.p12 + (y_v * s.p22 + y_phi * s.p23 + y_omega * s.p24);
  const V q13 = s.p13 + (y_v * s.p23 + y_phi * s.p33 + y_omega * s.p34);
  const V q14 = s.p14 + (y_v * s.p24 + y_phi * s.p34 + y_omega * s.p44);
  const V q30 = s.p30 + dt * s.p04, q31 = s.p31 + dt * s.p14, q32 = s.p23 + dt * s.p24, q33 = s.p33 + dt * s.p34,
          q34 = s.p34 + dt * s.p44;
  s.p00 = q00 + (x_v * q02 + x_phi * q03 + x_omega * q04) + noise[0];
  s.p01 = q01 + (y_v * q02 + y_phi * q03 + y_omega * q04);
  s.p10 = q10 + (x_v * q12 + x_phi * q13 + x_omega * q14);
  s.p11 = q11 + (y_v * q12 + y_phi * q13 + y_omega * q14) + noise[1];
  s.p02 = q02;
  s.p12 = q12;
  s.p03 = q03 + dt * q04;
  s.p30 = q30 + (x_v * q32 + x_phi * q33 + x_omega * q34);
  s.p13 = q13 + dt * q14;
  s.p31 = q31 + (y_v * q32 + y_phi * q33 + y_omega * q34);
  s.p22 = s.p22 + noise[2];
  s.p23 = q32;
  s.p33 = q33 + dt * q34 + noise[3];
  s.p04 = q04;
  s.p14 = q14;
  s.p34 = q34;
  s.p44 = s.p44 + noise[4];
}

template <class V>
OVT_INLINE void symmetrise_path(PathState<V>& s) {
  s.p01 = s.p10 = V(0.5) * (s.p10 + s.p01);
  s.p03 = s.p30 = V(0.5) * (s.p30 + s.p03);
  s.p13 = s.p31 = V(0.5) * (s.p31 + s.p13);
}

// Predicts the cars' paths as predict() in pipeline/track/track_filter.h does, point by point, to the same bytes. A car
// that turns by 0.2 rad or more in a step, has no course within 4 rad, or is too uncertain for the plain formulas
// (var_x + var_y at least 1e6 m^2 at a point) is left to the caller: its rows are written, but not to be used.
//   reads    cars     writes   rows of `count` cars, `points` each
//   returns  bit i: car i is left to the caller
//   cost     sin and cos of an angle, 120 multiply-adds per step     agrees   exactly on every ISA
namespace ref {
uint32_t predict_paths(const PredictPathsParams& params, const PathCars& cars, int32_t count, int32_t points,
                       const PathRows& rows) noexcept;
}

}  // namespace overtake
