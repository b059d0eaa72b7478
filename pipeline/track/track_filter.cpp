// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
#include "pipeline/track/track_filter.h"

#ifndef EIGEN_DONT_VECTORIZE
#define EIGEN_DONT_VECTORIZE  // one order of additions on every machine
#endif
#include <Eigen/Core>
#include <algorithm>
#include <cmath>

#include "core/math.h"
#include "pipeline/track/tracker_params.h"

namespace overtake {
namespace {

using Matrix5 = Eigen::Matrix<double, 5, 5, Eigen::RowMajor>;
using Matrix52 = Eigen::Matrix<double, 5, 2>;
using Matrix2 = Eigen::Matrix<double, 2, 2>;
using Vector2 = Eigen::Matrix<double, 2, 1>;
using Vector5 = Eigen::Matrix<double, 5, 1>;

constexpr int kMaxSteps = 4096;  // of one prediction; a longer prediction has longer steps

Eigen::Map<Matrix5> matrix_of(TrackEstimate& e) { return Eigen::Map<Matrix5>(&e.covariance[0][0]); }

void symmetrise(TrackEstimate& e) {
  for (int r = 1; r < kTrackStateSize; ++r)
    for (int c = 0; c < r; ++c)
      e.covariance[r][c] = e.covariance[c][r] = 0.5 * (e.covariance[r][c] + e.covariance[c][r]);
}

// Whether P is positive definite in spite of rounding. P = L D L^T gives the determinant of the correlation matrix; its
// least eigenvalue is at least 0.4 times that determinant.
bool is_surely_positive(const TrackEstimate& e) {
  constexpr double kLeast = 1e-13;
  const auto& p = e.covariance;
  double ld[kTrackStateSize][kTrackStateSize];  // below the diagonal: L D
  double inverse[kTrackStateSize], pivots = 1.0, variances = kLeast;
  for (int r = 0; r < kTrackStateSize; ++r) {
    double pivot = p[r][r];
    for (int c = 0; c < r; ++c) {
      double sum = p[r][c];
      for (int k = 0; k < c; ++k) sum -= ld[r][k] * ld[c][k] * inverse[k];
      ld[r][c] = sum;
      pivot -= sum * sum * inverse[c];
    }
    if (!(pivot > 0.0)) return false;
    if (r + 1 < kTrackStateSize) inverse[r] = 1.0 / pivot;
    pivots *= pivot;
    variances *= p[r][r];
  }
  return pivots >= variances && variances < 1e300;
}

// P loses positive definiteness where variances lie far apart (a measurement of micrometres beside one of kilometres, a
// prediction back after a minute without measurements). Then all variances grow by 1e-11 of their value, or by more if
// needed.
//
// The check costs a tenth of an update, and few updates in traffic need it. A few steps forward add more noise than
// rounding removes, and an update loses little unless the measurement is a thousand times more precise than the track.
bool is_wide(const TrackEstimate& e) { return !(e.covariance[0][0] + e.covariance[1][1] < 1e6); }
void keep_positive(TrackEstimate& e) {
  for (double share = 1e-11; share <= 1.0 && !is_surely_positive(e); share *= 10.0)
    for (int i = 0; i < kTrackStateSize; ++i) e.covariance[i][i] *= 1.0 + share;
}

// P <- F P F^T. F is the identity except for seven entries, so the product is two passes of row (then column)
// additions: 70 multiply-adds instead of 250. Rows x, y and phi read only rows below them that are still unchanged.
void transport(TrackEstimate& e, const MotionJacobian& f) {
  auto& p = e.covariance;
  for (int c = 0; c < kTrackStateSize; ++c) {
    p[0][c] += f.x_v * p[2][c] + f.x_phi * p[3][c] + f.x_omega * p[4][c];
    p[1][c] += f.y_v * p[2][c] + f.y_phi * p[3][c] + f.y_omega * p[4][c];
    p[3][c] += f.phi_omega * p[4][c];
  }
  for (auto& row : p) {
    row[0] += f.x_v * row[2] + f.x_phi * row[3] + f.x_omega * row[4];
    row[1] += f.y_v * row[2] + f.y_phi * row[3] + f.y_omega * row[4];
    row[3] += f.phi_omega * row[4];
  }
}

// S = H P H^T + R and its determinant.
struct Innovator {
  double xx, xy, yy, det;
  bool sound;
};
Innovator make_innovator(const TrackEstimate& e, const Measurement& z) {
  Innovator s{};
  s.xx = e.covariance[0][0] + z.var_x;
  s.xy = e.covariance[1][0] + z.cov_xy;
  s.yy = e.covariance[1][1] + z.var_y;
  s.det = s.xx * s.yy - s.xy * s.xy;
  s.sound = s.xx > 0.0 && s.yy > 0.0 && s.det > 1e-12 * s.xx * s.yy && s.det > 1e-200 && s.det < 1e200;
  return s;
}

}  // namespace

int predict_steps(const ProcessNoise& noise, double dt_s) noexcept {
  const double ratio = std::fabs(dt_s) / noise.max_step_s;
  // The slack keeps 50 ms one step of 50 ms, whatever the rounding of the division.
  return ratio >= kMaxSteps ? kMaxSteps : 1 + int(ratio * (1.0 - 1e-9));
}

void predict(TrackEstimate& estimate, const ProcessNoise& noise, double dt_s, const Advanced* whole) noexcept {
  if (dt_s == 0.0) return;
  const int steps = predict_steps(noise, dt_s);
  const double step_s = dt_s / steps;
  const bool is_known = whole && steps == 1;
  for (int k = 0; k < steps; ++k) {
    Advanced next;
    if (!is_known) next.state = advance(estimate.mean, step_s, &next.jacobian);
    const Advanced& to = is_known ? *whole : next;
    estimate.mean = to.state;
    transport(estimate, to.jacobian);
    if (step_s > 0.0)
      for (int i = 0; i < kTrackStateSize; ++i) estimate.covariance[i][i] += noise.variance_per_s[i] * step_s;
  }
  symmetrise(estimate);
  if (steps > kPlainSteps || dt_s < 0.0 || is_wide(estimate)) keep_positive(estimate);
}

bool innovate(const TrackEstimate& estimate, const Measurement& z, Innovation* out) noexcept {
  const Innovator s = make_innovator(estimate, z);
  if (!s.sound) return false;
  const double dx = z.x_m - estimate.mean.x_m, dy = z.y_m - estimate.mean.y_m;
  out->d2 = (s.yy * dx * dx - 2.0 * s.xy * dx * dy + s.xx * dy * dy) / s.det;
  out->log_det = log_f64(s.det);
  return true;
}

bool update(TrackEstimate& estimate, const Measurement& z, bool* turned) noexcept {
  const Innovator s = make_innovator(estimate, z);
  if (!s.sound) return false;
  const bool was_wide = is_wide(estimate);
  auto p = matrix_of(estimate);
  Matrix2 s_inverse, r;
  s_inverse << s.yy / s.det, -s.xy / s.det, -s.xy / s.det, s.xx / s.det;
  r << z.var_x, z.cov_xy, z.cov_xy, z.var_y;
  const Matrix52 gain = p.leftCols<2>() * s_inverse;  // H picks the first two columns

  const Vector5 change = gain * Vector2(z.x_m - estimate.mean.x_m, z.y_m - estimate.mean.y_m);
  MotionState& m = estimate.mean;
  m.x_m += change[0];
  m.y_m += change[1];
  m.speed_mps += change[2];
  m.course_rad = wrap_angle(m.course_rad + change[3]);
  m.yaw_rate_rps += change[4];

  // Joseph: (I - K H) P (I - K H)^T + K R K^T stays positive definite where (I - K H) P does not.
  Matrix5 keep = Matrix5::Identity();
  keep.leftCols<2>() -= gain;
  const Matrix5 kept = keep * p;
  const Matrix52 gain_r = gain * r;
  p.noalias() = kept * keep.transpose();
  p.noalias() += gain_r * gain.transpose();
  symmetrise(estimate);
  if (was_wide || z.var_x * z.var_y - z.cov_xy * z.cov_xy < 1e-6 * s.det) keep_positive(estimate);
  const bool changed = turn_round(estimate);
  if (turned) *turned = changed;
  return true;
}

bool find_course(TrackEstimate& estimate, const Measurement& z, double dt_s) noexcept {
  const Innovator s = make_innovator(estimate, z);
  if (!s.sound || !(dt_s > 0.0)) return false;
  MotionState& m = estimate.mean;
  const double speed_var = estimate.covariance[2][2], cov = speed_var * dt_s;
  auto p = matrix_of(estimate);
  const Matrix2 one = Matrix2::Identity(), place = p.topLeftCorner<2, 2>();
  Matrix2 s_inverse;
  s_inverse << s.yy / s.det, -s.xy / s.det, -s.xy / s.det, s.xx / s.det;
  const Matrix2 gain = place * s_inverse, speed_gain = cov * s_inverse;
  double sine, cosine;
  sin_cos_f64(m.course_rad, sine, cosine);
  const Vector2 innovation(z.x_m - m.x_m, z.y_m - m.y_m), way = gain * innovation;
  const Vector2 velocity = Vector2(m.speed_mps * cosine, m.speed_mps * sine) + speed_gain * innovation;
  const Matrix2 place_var = place - gain * place, place_velocity = cov * (one - gain);
  const Matrix2 velocity_var = speed_var * one - cov * speed_gain;

  m.x_m += way[0];
  m.y_m += way[1];
  m.speed_mps = hypot_f64(velocity[0], velocity[1]);
  m.course_rad = atan2_f64(velocity[1], velocity[0]);
  sin_cos_f64(m.course_rad, sine, cosine);
  // Where the speed is less than its own deviation, any course is possible: 1 rad.
  const double across = sine * sine * velocity_var(0, 0) + cosine * cosine * velocity_var(1, 1) -
                        2.0 * sine * cosine * velocity_var(0, 1);
  const double fast_mps = std::sqrt(std::max(m.speed_mps * m.speed_mps, across));
  Matrix2 to_course;  // (v, phi) of a velocity
  to_course << cosine, sine, -sine / fast_mps, cosine / fast_mps;
  p.topLeftCorner<2, 2>() = place_var;
  p.block<2, 2>(0, 2) = place_velocity * to_course.transpose();
  p.block<2, 2>(2, 0) = p.block<2, 2>(0, 2).transpose().eval();
  p.block<2, 2>(2, 2) = to_course * velocity_var * to_course.transpose();
  symmetrise(estimate);
  keep_positive(estimate);
  return true;
}

bool turn_round(TrackEstimate& estimate) noexcept {
  if (!(estimate.mean.speed_mps < 0.0)) return false;
  estimate.mean.speed_mps = -estimate.mean.speed_mps;
  estimate.mean.course_rad = wrap_angle(estimate.mean.course_rad + kPi);
  for (int i = 0; i < kTrackStateSize; ++i) {
    if (i == 2) continue;
    estimate.covariance[2][i] = -estimate.covariance[2][i];
    estimate.covariance[i][2] = -estimate.covariance[i][2];
  }
  return true;
}

void keep_sound(TrackEstimate& estimate, bool adds_little) noexcept {
  if (adds_little || is_wide(estimate)) keep_positive(estimate);
}

void write_estimate(const TrackEstimate& estimate, TrackTable& t, std::size_t i) noexcept {
  const MotionState& mean = estimate.mean;
  t.x_m[i] = mean.x_m;
  t.y_m[i] = mean.y_m;
  t.speed_mps[i] = mean.speed_mps;
  t.course_rad[i] = mean.course_rad;
  t.yaw_rate_rps[i] = mean.yaw_rate_rps;
  int32_t entry = 0;
  for (int32_t r = 0; r < kTrackStateSize; ++r)
    for (int32_t c = 0; c <= r; ++c) t.covariance[entry++][i] = estimate.covariance[r][c];
}

void write_point(const TrackEstimate& estimate, const PathRows& rows, int32_t k) noexcept {
  rows.x_m[k] = estimate.mean.x_m;
  rows.y_m[k] = estimate.mean.y_m;
  rows.course_rad[k] = estimate.mean.course_rad;
  rows.speed_mps[k] = estimate.mean.speed_mps;
  rows.var_x[k] = estimate.covariance[0][0];
  rows.var_y[k] = estimate.covariance[1][1];
  rows.cov_xy[k] = estimate.covariance[1][0];
}

bool is_sound(const TrackEstimate& estimate) noexcept {
  const MotionState& m = estimate.mean;
  bool sound = std::fabs(m.x_m) <= 1e12 && std::fabs(m.y_m) <= 1e12 && std::fabs(m.speed_mps) <= kMaxSpeed_mps &&
               std::fabs(m.course_rad) <= 4.0 && std::fabs(m.yaw_rate_rps) <= kMaxYawRate_rps;
  for (int r = 0; r < kTrackStateSize; ++r) {
    sound = sound && estimate.covariance[r][r] > 0.0;
    for (int c = 0; c < kTrackStateSize; ++c) sound = sound && std::fabs(estimate.covariance[r][c]) <= 1e100;
  }
  return sound;
}

}  // namespace overtake
