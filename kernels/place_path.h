// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// Section 12 of kernels/README.md: the predicted path of a car, from the frame of its lane to x and y.
#pragma once

#include "core/math.h"

namespace overtake {

inline constexpr int32_t kPathBlock = 32;  // points of one call; every column has this many places

// A car at the start of its path. Covariances of s (along the course), d (left of it), v (speed), c (course), w (yaw
// rate), in m, m/s, rad, rad/s; those of w are 0 where a lane determines the yaw rate.
struct PathCar {
  double speed_mps = 0;
  double p_ss = 0, p_sd = 0, p_dd = 0, p_sv = 0, p_dv = 0, p_vv = 0, p_sc = 0, p_dc = 0, p_vc = 0, p_cc = 0;
  double p_sw = 0, p_dw = 0, p_vw = 0, p_cw = 0, p_ww = 0;
  // Of the variances along and across that come from these: what counts for a car that goes on as it drives.
  double steady_along = 0, steady_across = 0;
};

// By point. What an error of its state at the start changes there: along, m per m/s; across, m per m/s of speed and rad
// of course, and per m/s and rad/s of yaw rate. The variances that the motion adds, of all cars and of a steady one.
struct PathTimes {
  const double *along_s, *across_s, *across_s2, *along_m2, *across_m2, *steady_along_m2, *steady_across_m2;
};

// By point: a place of the lane, its heading, in (-pi, pi]; how far the car is ahead of it and left of it, and its
// course less the heading.
struct LanePlaces {
  const double *x_m, *y_m, *heading_rad, *ahead_m, *left_m, *turn_rad;
};

struct PathColumns {
  double *x_m, *y_m, *course_rad, *var_x, *var_y, *cov_xy, *steady_along_m, *steady_across_m;
};

template <class V>
struct PathPoint {
  V x_m, y_m, course_rad, var_x, var_y, cov_xy, steady_along_m, steady_across_m;
};

// One point. V: double, or a vector of doubles; the other arguments are loaded to V. The ellipse's narrow half axis is
// at least 1e-5 of what the wide one can be, and the correlation at most 0.999: so the covariance is positive definite
// in spite of rounding. A steady car's deviations are at least as large, and at most those of all cars.
template <class V>
OVT_INLINE PathPoint<V> place_path_point(const PathCar& car, V along_s, V across_s, V across_s2, V along_m2,
                                         V across_m2, V steady_along_m2, V steady_across_m2, V lane_x_m, V lane_y_m,
                                         V lane_heading_rad, V ahead_m, V left_m, V turn_rad) {
  const V speed(car.speed_mps), two(2.0);
  V sine, cosine;
  sin_cos_f64_of(lane_heading_rad, sine, cosine);
  PathPoint<V> p;
  p.x_m = lane_x_m + (cosine * ahead_m - sine * left_m);
  p.y_m = lane_y_m + (sine * ahead_m + cosine * left_m);
  p.course_rad = wrap_once_of(lane_heading_rad + turn_rad);

  // s + a v along, d + b c + e w across.
  const V a = along_s, b = speed * across_s, e = speed * across_s2;
  const V a2 = a * a * V(car.p_vv), b2 = b * b * V(car.p_cc), e2 = e * e * V(car.p_ww);
  const V along = V(car.p_ss) + two * a * V(car.p_sv) + a2;
  const V across = V(car.p_dd) + two * b * V(car.p_dc) + b2 + two * e * (V(car.p_dw) + b * V(car.p_cw)) + e2;
  const V both =
      V(car.p_sd) + a * V(car.p_dv) + b * (V(car.p_sc) + a * V(car.p_vc)) + e * (V(car.p_sw) + a * V(car.p_vw));
  const V least = V(1e-10) * (V(car.p_ss) + V(car.p_dd) + a2 + b2 + e2 + along_m2 + across_m2);
  const V wide = max_of(along + along_m2, least), narrow = max_of(across + across_m2, least);
  const V most = V(0.999) * sqrt_of(wide * narrow);
  const V joint = max_of(min_of(both, most), V(0.0) - most);

  sin_cos_f64_of(p.course_rad, sine, cosine);
  const V ss = sine * sine, cc = cosine * cosine, sc = sine * cosine;
  p.var_x = cc * wide + ss * narrow - two * sc * joint;
  p.var_y = ss * wide + cc * narrow + two * sc * joint;
  p.cov_xy = sc * (wide - narrow) + (cc - ss) * joint;

  const V steady_along = V(car.steady_along) * along + steady_along_m2;
  const V steady_across = V(car.steady_across) * across + steady_across_m2;
  p.steady_along_m = sqrt_of(min_of(max_of(steady_along, least), wide));
  p.steady_across_m = sqrt_of(min_of(max_of(steady_across, least), narrow));
  return p;
}

// Points 0 to count - 1 of a path; count <= kPathBlock. Up to round_up(count, 8) places of each column are read and
// written.
//   reads    car times lane     writes   columns
//   cost     sin and cos of two angles, three roots per point     agrees   exactly on every ISA
namespace ref {
void place_path(const PathCar& car, const PathTimes& times, const LanePlaces& lane, int32_t count,
                const PathColumns& columns) noexcept;
}

}  // namespace overtake
