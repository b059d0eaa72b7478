// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
#include "pipeline/track/cvtr_tracker.h"

#include <cmath>

#include "core/math.h"

namespace overtake {
namespace {

ProcessNoise make_process_noise(const TrackerParams& params) noexcept {
  ProcessNoise noise;
  for (int i = 0; i < kTrackStateSize; ++i) noise.variance_per_s[i] = params.q_diag[i] / params.q_step_s;
  noise.max_step_s = params.predict_step_s;
  return noise;
}

void turn_heading(CvtrState& s, double dt_s) {
  s.heading_rad = wrap_angle(s.heading_rad + s.estimate.mean.yaw_rate_rps * dt_s);
}

// psi of the last measurement, rotated by omega since. An L-shape does not tell front from rear; the course of a track
// that surely drives does. Not in the vehicle frame: there an overtaken car moves backwards. A track without any
// measured heading has its course as heading.
double choose_heading(const CvtrState& s, bool in_map, double min_speed_mps) {
  const MotionState& m = s.estimate.mean;
  if (!s.has_heading) return m.course_rad;
  const bool drives = in_map && s.life.state == TrackState::kConfirmed && m.speed_mps >= min_speed_mps;
  const bool opposes = std::fabs(wrap_angle(s.heading_rad - m.course_rad)) > kHalfPi;
  return drives && opposes ? wrap_angle(s.heading_rad + kPi) : s.heading_rad;
}

}  // namespace

CvtrPolicy::CvtrPolicy(const TrackerParams& params, const CircuitMap* map, const Allocator& allocator)
    : params_(params),
      map_(map),
      kernels_(params.kernels ? *params.kernels : *find_kernels(nullptr)),
      life_cycle_{params.window, params.confirm_hits, params.keep_hits},
      noise_(make_process_noise(params)),
      no_noise_{{}, params.predict_step_s},
      assignment_(params, allocator) {}

void CvtrPolicy::predict(State& s, double dt_s) const noexcept {
  turn_heading(s, dt_s);
  overtake::predict(s.estimate, noise_, dt_s);
}

// A measurement older than the state: predicts back without noise, updates, and predicts forward to the state's time
// without noise, so that no noise counts twice.
void CvtrPolicy::update(int32_t slot, State& s, double dt_s, const Measurement& z) const noexcept {
  turn_heading(s, dt_s);
  if (const TrackEstimate* gated = assignment_.find_estimate(slot, dt_s))
    s.estimate = *gated;
  else
    overtake::predict(s.estimate, noise_, dt_s);
  overtake::update(s.estimate, z);
  if (std::isfinite(z.heading_rad)) {
    s.has_heading = true;
    s.heading_rad = z.heading_rad;
  }
  if (std::isfinite(z.length_m)) s.length_m = z.length_m;
  if (std::isfinite(z.width_m)) s.width_m = z.width_m;
  if (dt_s < 0.0) {
    turn_heading(s, -dt_s);
    overtake::predict(s.estimate, no_noise_, -dt_s);
  }
}

CvtrState CvtrPolicy::initiate(const Measurement& z, const Iteration& it) const noexcept {
  State s;
  s.has_heading = std::isfinite(z.heading_rad);
  s.heading_rad = s.has_heading ? z.heading_rad : 0.0;
  s.length_m = std::isfinite(z.length_m) ? z.length_m : 0.0;
  s.width_m = std::isfinite(z.width_m) ? z.width_m : 0.0;

  MotionState& mean = s.estimate.mean;
  mean.x_m = z.x_m;
  mean.y_m = z.y_m;
  mean.speed_mps = it.ego.known ? std::max(0.0, params_.birth_speed_share * it.ego.speed_mps) : 0.0;
  double var_phi = params_.birth_sigma_phi * params_.birth_sigma_phi;
  if (map_ && !map_->empty() && it.in_map && it.ask_map) {
    const MapProjection lane = map_->project(z.x_m, z.y_m);
    mean.course_rad = wrap_angle(lane.heading_rad);
    mean.yaw_rate_rps = mean.speed_mps * lane.curvature_per_m;
  } else if (it.ego.known) {
    mean.course_rad = wrap_angle(it.ego.heading_rad);
  } else {
    var_phi = kPi * kPi;
  }

  auto& cov = s.estimate.covariance;
  cov[0][0] = z.var_x;
  cov[1][1] = z.var_y;
  cov[0][1] = cov[1][0] = z.cov_xy;
  cov[2][2] = params_.birth_sigma_v * params_.birth_sigma_v;
  cov[3][3] = var_phi;
  cov[4][4] = params_.birth_sigma_omega * params_.birth_sigma_omega;
  s.life.record(true, life_cycle_);
  return s;
}

CvtrState CvtrPolicy::publishable(const State& state, bool in_map) const noexcept {
  State s = state;
  s.heading_rad = choose_heading(state, in_map, params_.heading_speed_mps);
  return s;
}

void CvtrPolicy::write(const State& s, TrackTable& t, std::size_t i) const noexcept {
  write_estimate(s.estimate, t, i);
  t.state[i] = int32_t(s.life.state);
  t.heading_rad[i] = s.heading_rad;
  t.length_m[i] = s.length_m;
  t.width_m[i] = s.width_m;
  t.age[i] = s.life.age;
  t.hits[i] = s.life.hits();
}

void CvtrPolicy::write_path(const State& s, const PathRows& rows, int32_t points) const noexcept {
  TrackEstimate estimate = s.estimate;
  for (int32_t k = 0; k < points; ++k) {
    overtake::predict(estimate, noise_, params_.horizon_step_s);
    write_point(estimate, rows, k);
  }
}

// In groups by the kernel; a car that it leaves, and every car if a point takes many steps, by the filter.
void CvtrPolicy::write_paths(std::span<const State> states, PathTable& t) const noexcept {
  PredictPathsParams params = {0, predict_steps(noise_, params_.horizon_step_s), {}};
  params.step_s = params_.horizon_step_s / params.steps;
  for (int i = 0; i < kTrackStateSize; ++i) params.noise[i] = noise_.variance_per_s[i] * params.step_s;
  const int32_t points = t.points_per_track;
  for (std::size_t first = 0; first < states.size(); first += kPathCars) {
    const auto group = states.subspan(first, std::min(states.size() - first, std::size_t(kPathCars)));
    const auto count = int32_t(group.size());
    const auto rows_from = [&t](int32_t row) {
      return PathRows{t.x_m + row,   t.y_m + row,   t.course_rad + row, t.speed_mps + row,
                      t.var_x + row, t.var_y + row, t.cov_xy + row};
    };
    uint32_t left = ~0u;
    if (params.steps <= kPlainSteps) {
      PathCars cars;
      for (int32_t i = 0; i < count; ++i) {
        const TrackEstimate& e = group[std::size_t(i)].estimate;
        cars.x_m[i] = e.mean.x_m;
        cars.y_m[i] = e.mean.y_m;
        cars.speed_mps[i] = e.mean.speed_mps;
        cars.course_rad[i] = e.mean.course_rad;
        cars.yaw_rate_rps[i] = e.mean.yaw_rate_rps;
        int32_t entry = 0;
        for (int32_t r = 0; r < kTrackStateSize; ++r)
          for (int32_t c = 0; c <= r; ++c) cars.covariance[entry++][i] = e.covariance[r][c];
      }
      left = kernels_.predict_paths(params, cars, count, points, rows_from(t.count));
    }
    for (int32_t i = 0; i < count; ++i)
      if ((left >> i & 1) != 0) write_path(group[std::size_t(i)], rows_from(t.count + i * points), points);
    t.count += count * points;
  }
}

template class ReplayTracker<CvtrPolicy>;

std::unique_ptr<FrameTracker> make_cvtr_tracker(const TrackerParams& params, const CircuitMap* map,
                                                const Allocator& allocator) {
  return std::make_unique<CvtrTracker>(params, map, allocator);
}

}  // namespace overtake
