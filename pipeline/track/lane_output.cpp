// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// What is published of the tracks of LanePolicy: rows, optional columns and predicted paths.
#include <algorithm>
#include <bit>
#include <cmath>

#include "core/cluster_table.h"
#include "core/math.h"
#include "pipeline/track/lane_tracker.h"

namespace overtake {
namespace {

// Of a predicted path: what a steady car has of path_speed and the square of path_across; how both grow with its lag.
constexpr double kSteadySpeed = 0.3, kSteadyPlace = 0.8, kPlaceLag = 0.5, kMostPathLag = 3.0;
// Of path_steady_along_m and path_steady_across_m, the deviations of a car that goes on as it drives: what counts of
// the variances of its estimate, of path_speed and of path_across, and how much more with the square of the lag.
constexpr double kSteadyAlong = 0.012, kSteadyAlongLag = 1.1, kSteadyAcross = 0.055, kSteadyAcrossLag = 1.0;
constexpr double kSteadyGrowth = 0.0015, kSteadyDrift = 0.002, kSteadyDriftLag = 0.4;

constexpr double kHeadingKnown_rad2 = 0.25;  // variance of a heading that is more than a guess

// Where a heading was measured, told by the lane or by a way that the car drove, the errors of the places of a car that
// stands turn its course round and back.
bool seems_to_reverse(const LaneTrack& s) {
  return s.hits >= kSteadyHits && !moves_for_sure(s) && s.is_backwards == 0 && s.heading_var < kHeadingKnown_rad2 &&
         std::fabs(wrap_angle(s.estimate.mean.course_rad - s.heading_rad)) > kHalfPi;
}

// What is published: at rest, with the course along the heading, where the estimate only seems to reverse.
LaneEstimate published(const LaneTrack& s) {
  LaneEstimate e = s.estimate;
  if (!seems_to_reverse(s)) return e;
  e.mean.speed_mps = -1.0;  // of any size: turn_round() looks at its sign
  turn_round(e);
  e.mean.speed_mps = 0.0;
  return e;
}

}  // namespace

void LanePolicy::write(const State& s, TrackTable& t, std::size_t i) const noexcept {
  write_estimate(published(s), t, i);
  t.state[i] = int32_t(is_confirmed(s) ? TrackState::kConfirmed : TrackState::kTentative);
  t.heading_rad[i] = s.heading_rad;
  t.length_m[i] = s.length_m;
  t.width_m[i] = s.width_m;
  t.age[i] = s.age;
  const uint64_t window = params_.window >= 64 ? ~uint64_t(0) : (uint64_t(1) << params_.window) - 1;
  t.hits[i] = std::popcount(s.history & window);
}

void LanePolicy::write_optional(const State& s, OptionalTrackTable& t, std::size_t i) const noexcept {
  t.existence[i] = 1.0 / (1.0 + exp_f64(-s.score));
  const ObjectClass object = s.class_votes > 0   ? ObjectClass::kCar
                             : s.class_votes < 0 ? ObjectClass::kDebris
                                                 : ObjectClass::kUnknown;
  t.object_class[i] = int32_t(object);
  t.visibility[i] = int32_t(s.visibility);
  t.heading_sigma_rad[i] = std::sqrt(std::clamp(s.heading_var, 0.0, kPi * kPi));
}

// A car that drives follows its lane, else the arc of its yaw rate.
PathKind LanePolicy::path_of(const State& s) const noexcept {
  if (comes_to_rest(s)) return PathKind::kRest;
  if (!(s.estimate.mean.speed_mps > kDrives_mps)) return PathKind::kStraight;
  return s.lane.time_s > 0.0 ? PathKind::kLane : PathKind::kArc;
}

// Detections that run ahead of a car's track, or fall behind it, tell that the car changes its speed; those to one
// side, that it changes its place across the lane.
PathNoise LanePolicy::path_noise(const State& s) const noexcept {
  if (s.hits < kSteadyHits) return {};
  const double along = std::min(std::fabs(s.lag_along), kMostPathLag), along2 = along * along;
  const double across = std::min(std::fabs(s.lag_across), kMostPathLag), across2 = across * across;
  return {.along = kSteadySpeed + along2,
          .across = kSteadyPlace + kPlaceLag * across2,
          .steady_along = kSteadyAlong + kSteadyAlongLag * along2,
          .steady_across = kSteadyAcross + kSteadyAcrossLag * across2,
          .steady_speed = kSteadyGrowth,
          .steady_drift = kSteadyDrift + kSteadyDriftLag * across2};
}

// Where the course is unknown, the car may go to any side (spread).
void LanePolicy::spread_path(const State& s, int32_t first, PathTable& t) const noexcept {
  double sine, cosine;
  sin_cos_f64(s.estimate.mean.course_rad, sine, cosine);
  for (int32_t i = first; i < t.count; ++i) {
    TrackEstimate e = s.estimate;
    spread(e, s.uncorrected_s, s.uncorrected_s + (i - first + 1) * params_.horizon_step_s);
    const double xx = e.covariance[0][0], yy = e.covariance[1][1], xy = e.covariance[0][1];
    t.x_m[i] = e.mean.x_m, t.y_m[i] = e.mean.y_m;
    t.var_x[i] = xx, t.var_y[i] = yy, t.cov_xy[i] = xy;
    t.steady_along_m[i] = std::sqrt(cosine * cosine * xx + sine * sine * yy + 2.0 * sine * cosine * xy);
    t.steady_across_m[i] = std::sqrt(sine * sine * xx + cosine * cosine * yy - 2.0 * sine * cosine * xy);
  }
}

void LanePolicy::write_paths(std::span<const State> states, PathTable& t) const noexcept {
  for (const State& s : states) {
    const int32_t first = t.count;
    path_.write(published(s), path_of(s), s.segment, path_noise(s), t);
    if (!s.has_course) spread_path(s, first, t);
  }
}

}  // namespace overtake
