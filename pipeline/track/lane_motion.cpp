// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
#include "pipeline/track/lane_motion.h"

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

bool is_pulled(const LanePull& lane, double dt_s) { return lane.time_s > 0.0 && dt_s > 0.0; }

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

void predict_on_lane(TrackEstimate& estimate, const LanePull& lane, const CourseNoise& noise, double dt_s) noexcept {
  if (dt_s == 0.0) return;
  const bool pulled = is_pulled(lane, dt_s);
  const Pull pull = pulled ? pull_of(lane.time_s, dt_s) : Pull{};
  const double kappa = pulled ? lane.curvature_per_m : 0.0;
  const double of_lane = kappa * estimate.mean.speed_mps, off = estimate.mean.yaw_rate_rps - of_lane;
  MotionState mean = estimate.mean;
  if (pulled) mean.yaw_rate_rps = of_lane + off * pull.mean;
  MotionJacobian f;
  MotionState next = advance(mean, dt_s, &f);
  const double keep = pulled ? keep_of(lane, dt_s) : 1.0;
  if (pulled) {
    next.yaw_rate_rps = of_lane + off * pull.decay;
    next.course_rad = pull_course(lane, of_lane * dt_s, keep, next.course_rad);
  }
  // The mean yaw rate depends on the speed and on the yaw rate before.
  const double mean_v = kappa * (1.0 - pull.mean), mean_omega = pull.mean;
  const double x_v = f.x_v + f.x_omega * mean_v, y_v = f.y_v + f.y_omega * mean_v, phi_phi = keep;
  const double phi_v = keep * f.phi_omega * mean_v + (1.0 - keep) * kappa * dt_s;
  const double x_omega = f.x_omega * mean_omega, y_omega = f.y_omega * mean_omega;
  const double phi_omega = keep * f.phi_omega * mean_omega;
  const double omega_v = kappa * (1.0 - pull.decay), omega_omega = pull.decay;
  auto& p = estimate.covariance;
  for (int c = 0; c < kTrackStateSize; ++c) {
    p[0][c] += x_v * p[2][c] + f.x_phi * p[3][c] + x_omega * p[4][c];
    p[1][c] += y_v * p[2][c] + f.y_phi * p[3][c] + y_omega * p[4][c];
    p[3][c] = phi_phi * p[3][c] + phi_v * p[2][c] + phi_omega * p[4][c];
    p[4][c] = omega_v * p[2][c] + omega_omega * p[4][c];
  }
  for (auto& row : p) {
    row[0] += x_v * row[2] + f.x_phi * row[3] + x_omega * row[4];
    row[1] += y_v * row[2] + f.y_phi * row[3] + y_omega * row[4];
    row[3] = phi_phi * row[3] + phi_v * row[2] + phi_omega * row[4];
    row[4] = omega_v * row[2] + omega_omega * row[4];
  }
  estimate.mean = next;
  if (dt_s > 0.0) {
    double s, c;
    sin_cos_f64(next.course_rad, s, c);
    const double along = noise.along * dt_s, across = noise.across * dt_s;
    p[0][0] += c * c * along + s * s * across;
    p[1][1] += s * s * along + c * c * across;
    p[0][1] += c * s * (along - across);
    p[1][0] += c * s * (along - across);
    p[2][2] += noise.speed * dt_s;
    p[3][3] += noise.course * dt_s;
    p[4][4] += noise.yaw_rate * dt_s;
  }
  for (int r = 1; r < kTrackStateSize; ++r)
    for (int c = 0; c < r; ++c) p[r][c] = p[c][r] = 0.5 * (p[r][c] + p[c][r]);
  // Without noise, the pull makes the yaw rate a function of the speed, and many steps lose digits: P becomes singular.
  keep_sound(estimate, dt_s < 0.0 || noise.yaw_rate * dt_s < kLeastNoise * p[4][4]);
}

}  // namespace overtake
