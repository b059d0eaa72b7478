// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
#include "pipeline/track/lane_motion.h"

#include <algorithm>
#include <cmath>

#include "core/math.h"

namespace overtake {
namespace {

constexpr double kLeastNoise = 1e-9;  // share of the yaw rate's variance

// Of the yaw rate: next = kappa v + (omega - kappa v) decay; mean over the step = kappa v + (omega - kappa v) mean.
// decay is e^(-h), h = dt / tau, to 4 % of 1 - decay for h up to 0.5.
struct Pull {
  double decay = 1, mean = 1;
};
Pull pull_of(double time_s, double dt_s) {
  const double h = dt_s / time_s, decay = 1.0 / (1.0 + h * (1.0 + 0.5 * h));
  return {decay, (1.0 - decay) / h};
}

// The share that a step keeps of the difference between the course and the lane's heading, and the course after it; the
// heading has turned by turn_rad.
double keep_of(const LanePull& lane, double dt_s) {
  return lane.course_s > 0.0 ? pull_of(lane.course_s, dt_s).decay : 1.0;
}
double pull_course(const LanePull& lane, double turn_rad, double keep, double course_rad) {
  if (!(lane.course_s > 0.0)) return course_rad;
  const double heading_rad = lane.heading_rad + turn_rad;
  return wrap_angle(heading_rad + keep * wrap_angle(course_rad - heading_rad));
}

// Whether the covariance of all six elements is positive definite in spite of rounding: q^T P^-1 q < var a, by P = L D
// L^T. Where variances lie far apart, the acceleration is not known well enough to be of use.
bool is_sound_with_acceleration(const LaneEstimate& e) {
  constexpr double kMost = 0.99;
  const auto& p = e.covariance;
  double ld[kTrackStateSize][kTrackStateSize], inverse[kTrackStateSize], left[kTrackStateSize], known = 0.0;
  for (int r = 0; r < kTrackStateSize; ++r) {
    double pivot = p[r][r];
    left[r] = e.accel_cov[r];
    for (int c = 0; c < r; ++c) {
      double sum = p[r][c];
      for (int k = 0; k < c; ++k) sum -= ld[r][k] * ld[c][k] * inverse[k];
      ld[r][c] = sum;
      pivot -= sum * sum * inverse[c];
      left[r] -= sum * inverse[c] * left[c];
    }
    if (!(pivot > 1e-9 * p[r][r])) return false;
    inverse[r] = 1.0 / pivot;
    known += left[r] * left[r] * inverse[r];
  }
  return known <= kMost * e.accel_var;
}

bool is_pulled(const LanePull& lane, double dt_s) { return lane.time_s > 0.0 && dt_s > 0.0; }

// What is left of an acceleration after a step, and what it adds to the speed at the end and in the mean of the step.
struct AccelStep {
  double keep = 1.0, end_s = 0.0, mean_s = 0.0;
};
AccelStep accel_step_of(const CourseNoise& noise, double dt_s) {
  if (!(noise.accel_s > 0.0 && dt_s > 0.0)) return {};
  const Pull decay = pull_of(noise.accel_s, dt_s);
  return {decay.decay, decay.mean * dt_s, noise.accel_s * (1.0 - decay.mean)};
}

// The entries of d next / d state, as MotionJacobian, that a pull to the lane makes other ones.
//
//        x  y  v        phi      omega
//   x    1  .  x_v      x_phi    x_omega
//   y    .  1  y_v      y_phi    y_omega
//   v    .  .  1        .        .
//   phi  .  .  phi_v    phi_phi  phi_omega
//   om.  .  .  omega_v  .        omega_omega
struct LaneJacobian {
  double x_v, x_phi, x_omega, y_v, y_phi, y_omega;
  double phi_v, phi_phi, phi_omega, omega_v, omega_omega;

  // Multiplies a column with it: at(i) is element i.
  template <class At>
  void apply(At&& at) const {
    at(0) += x_v * at(2) + x_phi * at(3) + x_omega * at(4);
    at(1) += y_v * at(2) + y_phi * at(3) + y_omega * at(4);
    at(3) = phi_phi * at(3) + phi_v * at(2) + phi_omega * at(4);
    at(4) = omega_v * at(2) + omega_omega * at(4);
  }
};

struct LaneStep {
  MotionState next;
  LaneJacobian jacobian;
  double x_v, y_v;  // of CVTR alone
};
LaneStep step_mean(const LaneEstimate& estimate, const LanePull& lane, const AccelStep& accel, double dt_s) {
  const bool pulled = is_pulled(lane, dt_s);
  const Pull pull = pulled ? pull_of(lane.time_s, dt_s) : Pull{};
  const double kappa = pulled ? lane.curvature_per_m : 0.0;
  const double of_lane = kappa * estimate.mean.speed_mps, off = estimate.mean.yaw_rate_rps - of_lane;
  MotionState mean = estimate.mean;
  if (pulled) mean.yaw_rate_rps = of_lane + off * pull.mean;
  mean.speed_mps += estimate.accel_mps2 * accel.mean_s;
  MotionJacobian f;
  MotionState next = advance(mean, dt_s, &f);
  next.speed_mps = estimate.mean.speed_mps + estimate.accel_mps2 * accel.end_s;
  const double keep = pulled ? keep_of(lane, dt_s) : 1.0;
  if (pulled) {
    next.yaw_rate_rps = of_lane + off * pull.decay;
    next.course_rad = pull_course(lane, of_lane * dt_s, keep, next.course_rad);
  }
  // The mean yaw rate depends on the speed and on the yaw rate before.
  const double mean_v = kappa * (1.0 - pull.mean), mean_omega = pull.mean;
  const LaneJacobian jacobian = {.x_v = f.x_v + f.x_omega * mean_v,
                                 .x_phi = f.x_phi,
                                 .x_omega = f.x_omega * mean_omega,
                                 .y_v = f.y_v + f.y_omega * mean_v,
                                 .y_phi = f.y_phi,
                                 .y_omega = f.y_omega * mean_omega,
                                 .phi_v = keep * f.phi_omega * mean_v + (1.0 - keep) * kappa * dt_s,
                                 .phi_phi = keep,
                                 .phi_omega = keep * f.phi_omega * mean_omega,
                                 .omega_v = kappa * (1.0 - pull.decay),
                                 .omega_omega = pull.decay};
  return {next, jacobian, f.x_v, f.y_v};
}

// F P F^T, also of the acceleration's covariances.
void turn_covariance(LaneEstimate& estimate, const LaneJacobian& jacobian) {
  auto& p = estimate.covariance;
  jacobian.apply([&](int i) -> double& { return estimate.accel_cov[i]; });
  for (int c = 0; c < kTrackStateSize; ++c) jacobian.apply([&](int i) -> double& { return p[i][c]; });
  for (auto& row : p) jacobian.apply([&](int i) -> double& { return row[i]; });
}

// The acceleration moves x, y and v.
void add_acceleration(LaneEstimate& estimate, const AccelStep& accel, const LaneStep& step) {
  if (accel.end_s > 0.0 && estimate.accel_var > 0.0 && !is_sound_with_acceleration(estimate))
    forget_acceleration(estimate);
  auto& p = estimate.covariance;
  auto& q = estimate.accel_cov;
  const double by[3] = {step.x_v * accel.mean_s, step.y_v * accel.mean_s, accel.end_s}, variance = estimate.accel_var;
  for (int r = 0; r < 3; ++r)
    for (int c = 0; c < kTrackStateSize; ++c) {
      const double more = by[r] * (c < 3 ? q[c] + 0.5 * by[c] * variance : q[c]);
      p[r][c] += more;
      p[c][r] += more;
    }
  for (int i = 0; i < kTrackStateSize; ++i) q[i] = accel.keep * (i < 3 ? q[i] + by[i] * variance : q[i]);
  estimate.accel_mps2 *= accel.keep;
  estimate.accel_var = accel.keep * accel.keep * variance;
  if (estimate.mean.speed_mps < 0.0 && accel.end_s > 0.0) {  // who brakes comes to rest
    estimate.mean.speed_mps = 0.0;
    forget_acceleration(estimate);
  }
}

// Along and across the course.
void add_noise(LaneEstimate& estimate, const CourseNoise& noise, double dt_s) {
  auto& p = estimate.covariance;
  double s, c;
  sin_cos_f64(estimate.mean.course_rad, s, c);
  const double along = noise.along * dt_s, across = noise.across * dt_s;
  p[0][0] += c * c * along + s * s * across;
  p[1][1] += s * s * along + c * c * across;
  p[0][1] += c * s * (along - across);
  p[1][0] += c * s * (along - across);
  p[2][2] += noise.speed * dt_s;
  p[3][3] += noise.course * dt_s;
  p[4][4] += noise.yaw_rate * dt_s;
  estimate.accel_var += noise.accel * dt_s;
}

}  // namespace

MotionState advance_on_lane(const MotionState& state, const LanePull& lane, double dt_s) noexcept {
  if (!is_pulled(lane, dt_s)) return advance(state, dt_s);
  const Pull pull = pull_of(lane.time_s, dt_s);
  const double of_lane = lane.curvature_per_m * state.speed_mps, off = state.yaw_rate_rps - of_lane;
  MotionState mean = state;
  mean.yaw_rate_rps = of_lane + off * pull.mean;
  MotionState next = advance(mean, dt_s);
  next.yaw_rate_rps = of_lane + off * pull.decay;
  next.course_rad = pull_course(lane, of_lane * dt_s, keep_of(lane, dt_s), next.course_rad);
  return next;
}

LanePull lane_after(const LanePull& lane, double speed_mps, double dt_s) noexcept {
  LanePull after = lane;
  after.heading_rad += lane.curvature_per_m * speed_mps * dt_s;
  return after;
}

void forget_acceleration(LaneEstimate& estimate) noexcept {
  estimate.accel_mps2 = estimate.accel_var = 0.0;
  std::fill_n(estimate.accel_cov, kTrackStateSize, 0.0);
}

void begin_acceleration(LaneEstimate& estimate, double sigma_mps2, double since_s) noexcept {
  double sine, cosine;
  sin_cos_f64(estimate.mean.course_rad, sine, cosine);
  const double way = 0.5 * since_s * since_s, by[3] = {cosine * way, sine * way, since_s};
  const double variance = sigma_mps2 * sigma_mps2;
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) estimate.covariance[i][j] += variance * by[i] * by[j];
    estimate.accel_cov[i] += variance * by[i];
  }
  estimate.accel_var += variance;
}

void predict_on_lane(LaneEstimate& estimate, const LanePull& lane, const CourseNoise& noise, double dt_s) noexcept {
  if (dt_s == 0.0) return;
  const AccelStep accel = accel_step_of(noise, dt_s);
  const LaneStep step = step_mean(estimate, lane, accel, dt_s);
  turn_covariance(estimate, step.jacobian);
  estimate.mean = step.next;
  add_acceleration(estimate, accel, step);
  if (dt_s > 0.0) add_noise(estimate, noise, dt_s);
  auto& p = estimate.covariance;
  for (int r = 1; r < kTrackStateSize; ++r)
    for (int c = 0; c < r; ++c) p[r][c] = p[c][r] = 0.5 * (p[r][c] + p[c][r]);
  // Without noise, the pull makes the yaw rate a function of the speed, and many steps lose digits: P becomes singular.
  keep_sound(estimate, dt_s < 0.0 || noise.yaw_rate * dt_s < kLeastNoise * p[4][4]);
}

void spread(TrackEstimate& e, double from_s, double to_s) noexcept {
  const double more = e.covariance[2][2] * (to_s * to_s - from_s * from_s), way_m = e.mean.speed_mps * (to_s - from_s);
  e.covariance[0][0] += more;
  e.covariance[1][1] += more;
  if (way_m == 0.0) return;
  double sine, cosine;
  sin_cos_f64(e.mean.course_rad, sine, cosine);
  e.mean.x_m += way_m * cosine;
  e.mean.y_m += way_m * sine;
}

bool update_on_lane(LaneEstimate& estimate, const Measurement& z) noexcept {
  const LaneEstimate before = estimate;
  bool turned = false;
  if (!update(estimate, z, &turned)) return false;
  const auto& p = before.covariance;
  const auto& q = before.accel_cov;
  const double xx = p[0][0] + z.var_x, xy = p[1][0] + z.cov_xy, yy = p[1][1] + z.var_y, det = xx * yy - xy * xy;
  const double gain_x = (yy * q[0] - xy * q[1]) / det, gain_y = (xx * q[1] - xy * q[0]) / det;
  const double x_m = z.x_m - before.mean.x_m, y_m = z.y_m - before.mean.y_m;
  estimate.accel_mps2 += gain_x * x_m + gain_y * y_m;
  estimate.accel_var -= gain_x * q[0] + gain_y * q[1];
  for (int i = 0; i < kTrackStateSize; ++i) estimate.accel_cov[i] = q[i] - gain_x * p[0][i] - gain_y * p[1][i];
  // A car that has turned round drives the other way, and rounding may remove more than there is.
  if (turned || !(estimate.accel_var >= 0.0)) forget_acceleration(estimate);
  return true;
}

}  // namespace overtake
