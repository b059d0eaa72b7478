// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// The paper's tracker (IV-C, eqs. 6 and 7) as a policy: constant velocity and turn rate EKF with variable step,
// Mahalanobis gating, Munkres assignment, M/N life cycle.
#pragma once

#include <cmath>

#include "kernels/kernel_table.h"
#include "pipeline/track/global_assignment.h"
#include "pipeline/track/life_cycle.h"
#include "pipeline/track/replay_tracker.h"
#include "pipeline/track/track_filter.h"

namespace overtake {

struct CvtrState {
  TrackEstimate estimate;
  LifeCycle life;
  bool has_heading = false;
  double heading_rad = 0;            // of the last measurement with a heading, rotated by omega since
  double length_m = 0, width_m = 0;  // 0: never measured
};

class CvtrPolicy {
 public:
  using State = CvtrState;

  CvtrPolicy(const TrackerParams& params, const CircuitMap* map, const Allocator& allocator);

  void predict(State& state, double dt_s) const noexcept;
  Place place(const State& s) const noexcept { return {s.estimate.mean.x_m, s.estimate.mean.y_m}; }
  bool is_sound(const State& s) const noexcept { return overtake::is_sound(s.estimate); }
  Effort associate(const TrackView<State>& tracks, const Iteration& it, int32_t* measurement_of_slot) noexcept {
    return assignment_.run(*this, tracks, it, measurement_of_slot);
  }
  void update(int32_t slot, State& state, double dt_s, const Measurement& z) const noexcept;
  State initiate(const Measurement& z, const Iteration& it) const noexcept;
  bool record(int32_t, State& s, bool hit) const noexcept { return s.life.record(hit, life_cycle_); }
  bool is_confirmed(const State& s) const noexcept { return s.life.state == TrackState::kConfirmed; }
  State publishable(const State& state, bool in_map) const noexcept;
  void write(const State& state, TrackTable& t, std::size_t i) const noexcept;
  void write_paths(std::span<const State> states, PathTable& t) const noexcept;

  // For the assignment.
  using Estimate = TrackEstimate;
  using Ahead = Advanced;
  Ahead look_ahead(const State& s, double dt_s) const noexcept {
    Ahead ahead;
    ahead.state = advance(s.estimate.mean, dt_s, &ahead.jacobian);
    return ahead;
  }
  Place place(const Ahead& ahead) const noexcept { return {ahead.state.x_m, ahead.state.y_m}; }
  Estimate estimate(const State& s, double dt_s, const Ahead& ahead) const noexcept {
    Estimate e = s.estimate;
    overtake::predict(e, noise_, dt_s, &ahead);
    return e;
  }
  bool cost(const Estimate& e, const Measurement& z, double& cost) const noexcept {
    Innovation innovation;
    if (!innovate(e, z, &innovation) || !(innovation.d2 <= params_.gate_d2)) return false;
    cost = innovation.d2 + innovation.log_det;
    return true;
  }
  double travel_m(const State& s, double dt_s) const noexcept { return s.estimate.mean.speed_mps * std::fabs(dt_s); }

 private:
  void write_path(const State& state, const PathRows& rows, int32_t points) const noexcept;

  const TrackerParams params_;
  const CircuitMap* const map_;
  const KernelTable& kernels_;
  const LifeCycleParams life_cycle_;
  const ProcessNoise noise_, no_noise_;
  GlobalAssignment<CvtrPolicy> assignment_;
};

extern template class ReplayTracker<CvtrPolicy>;
using CvtrTracker = ReplayTracker<CvtrPolicy>;
MakeTracker make_cvtr_tracker;

}  // namespace overtake
