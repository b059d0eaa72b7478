// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// The tracker of the method `plain`: an alpha-beta filter on position and velocity, and a greedy nearest-neighbour
// association (closest pair first) with a distance gate. It shows that a new tracker is a policy and nothing else:
// ReplayTracker does history, frames out of sequence, their work limit, ids and counters.
#pragma once

#include <algorithm>
#include <cmath>
#include <new>
#include <tuple>

#include "core/math.h"
#include "pipeline/track/life_cycle.h"
#include "pipeline/track/replay_tracker.h"

namespace overtake::test {

struct PlainState {
  double x_m, y_m, vx_mps, vy_mps;
  double var_x, var_y, cov_xy;  // of the last measurement, plus the growth since then
  double heading_rad, length_m, width_m;
  bool has_heading;
  LifeCycle life;
};

class PlainPolicy {
 public:
  using State = PlainState;

  PlainPolicy(const TrackerParams& params, const CircuitMap*, const Allocator& allocator)
      : params_(params), life_cycle_{params.window, params.confirm_hits, params.keep_hits} {
    const auto slots = std::size_t(params.track_capacity), rows = std::size_t(params.detection_capacity);
    const bool built = arena_.build(allocator, [&](Carver& carver) {
      pairs_ = carver.take<Pair>(slots * rows);
      taken_ = carver.take<bool>(rows);
    });
    if (!built) throw std::bad_alloc();
  }

  void predict(State& s, double dt_s) const noexcept {
    s.x_m += s.vx_mps * dt_s;
    s.y_m += s.vy_mps * dt_s;
    if (dt_s < 0.0) return;
    s.var_x += kVariancePerS * dt_s;
    s.var_y += kVariancePerS * dt_s;
  }
  Place place(const State& s) const noexcept { return {s.x_m, s.y_m}; }
  bool is_sound(const State& s) const noexcept {
    return std::fabs(s.x_m) <= 1e12 && std::fabs(s.y_m) <= 1e12 && std::fabs(s.vx_mps) <= 700.0 &&
           std::fabs(s.vy_mps) <= 700.0;
  }

  // Examining a pair costs one step; a pair within the gate costs 16 more, as it is sorted. Skips the pairs beyond the
  // limit.
  Effort associate(const TrackView<State>& tracks, const Iteration& it, int32_t* measurement_of_slot) noexcept {
    Effort effort;
    int32_t count = 0;
    for (int32_t slot = 0; slot < tracks.slot_count; ++slot) {
      measurement_of_slot[slot] = -1;
      if (!tracks.head[slot].alive) continue;
      for (int32_t i = 0; i < it.count; ++i) {
        if (double(effort.work) >= params_.work_limit) {
          effort.limited = true;
          break;
        }
        ++effort.work;
        const Measurement& z = it.measurement[i];
        const double dt_s = seconds_between(tracks.head[slot].state_ns, z.stamp_ns);
        State ahead = tracks.state[slot];
        predict(ahead, dt_s);
        const double dx = z.x_m - ahead.x_m, dy = z.y_m - ahead.y_m, distance_m2 = dx * dx + dy * dy;
        if (dt_s < -kMaxBackward_s || !(distance_m2 <= params_.gate_m * params_.gate_m)) continue;
        effort.work += 16;
        pairs_[count++] = {distance_m2, i, slot};
      }
    }
    std::sort(pairs_, pairs_ + count, [](const Pair& a, const Pair& b) {
      return std::tie(a.distance_m2, a.measurement, a.slot) < std::tie(b.distance_m2, b.measurement, b.slot);
    });
    std::fill_n(taken_, it.count, false);
    for (int32_t k = 0; k < count; ++k) {
      const Pair& pair = pairs_[k];
      if (taken_[pair.measurement] || measurement_of_slot[pair.slot] >= 0) continue;
      measurement_of_slot[pair.slot] = pair.measurement;
      taken_[pair.measurement] = true;
    }
    return effort;
  }

  void update(int32_t, State& s, double dt_s, const Measurement& z) const noexcept {
    constexpr double kAlpha = 0.6, kBeta = 0.2, kLeastStep_s = 0.05;
    predict(s, dt_s);
    const double rx_m = z.x_m - s.x_m, ry_m = z.y_m - s.y_m, per_s = kBeta / std::max(dt_s, kLeastStep_s);
    s.x_m += kAlpha * rx_m;
    s.y_m += kAlpha * ry_m;
    s.vx_mps += per_s * rx_m;
    s.vy_mps += per_s * ry_m;
    take_shape(s, z);
    if (dt_s < 0.0) predict(s, -dt_s);
  }

  State initiate(const Measurement& z, const Iteration& it) const noexcept {
    State s{};
    s.x_m = z.x_m;
    s.y_m = z.y_m;
    if (it.ego.known) {
      double sine, cosine;
      sin_cos_f64(it.ego.heading_rad, sine, cosine);
      s.vx_mps = params_.birth_speed_share * it.ego.speed_mps * cosine;
      s.vy_mps = params_.birth_speed_share * it.ego.speed_mps * sine;
    }
    take_shape(s, z);
    s.life.record(true, life_cycle_);
    return s;
  }

  bool record(int32_t, State& s, bool hit) const noexcept { return s.life.record(hit, life_cycle_); }
  bool is_confirmed(const State& s) const noexcept { return s.life.state == TrackState::kConfirmed; }
  State publishable(const State& s, bool) const noexcept { return s; }

  // The filter has no covariance. The position gets that of the last measurement, grown since then; the rest gets the
  // variances of an initiation.
  void write(const State& s, TrackTable& t, std::size_t i) const noexcept {
    t.state[i] = int32_t(s.life.state);
    t.x_m[i] = s.x_m;
    t.y_m[i] = s.y_m;
    t.speed_mps[i] = speed_of(s);
    t.course_rad[i] = course_of(s);
    t.yaw_rate_rps[i] = 0.0;
    for (double* column : t.covariance) column[i] = 0.0;
    t.covariance[0][i] = s.var_x;
    t.covariance[1][i] = s.cov_xy;
    t.covariance[2][i] = s.var_y;
    t.covariance[5][i] = params_.birth_sigma_v * params_.birth_sigma_v;
    t.covariance[9][i] = params_.birth_sigma_phi * params_.birth_sigma_phi;
    t.covariance[14][i] = params_.birth_sigma_omega * params_.birth_sigma_omega;
    t.heading_rad[i] = s.has_heading ? s.heading_rad : course_of(s);
    t.length_m[i] = s.length_m;
    t.width_m[i] = s.width_m;
    t.age[i] = s.life.age;
    t.hits[i] = s.life.hits();
  }

  void write_paths(std::span<const State> states, PathTable& t) const noexcept {
    for (State s : states)
      for (int32_t k = 0; k < t.points_per_track; ++k) {
        predict(s, params_.horizon_step_s);
        const auto i = std::size_t(t.count++);
        t.x_m[i] = s.x_m;
        t.y_m[i] = s.y_m;
        t.course_rad[i] = course_of(s);
        t.speed_mps[i] = speed_of(s);
        t.var_x[i] = s.var_x;
        t.var_y[i] = s.var_y;
        t.cov_xy[i] = s.cov_xy;
      }
  }

 private:
  static constexpr double kVariancePerS = 20.0;  // m^2
  struct Pair {
    double distance_m2;
    int32_t measurement, slot;
  };

  static double speed_of(const State& s) noexcept { return hypot_f64(s.vx_mps, s.vy_mps); }
  static double course_of(const State& s) noexcept { return atan2_f64(s.vy_mps, s.vx_mps); }
  static void take_shape(State& s, const Measurement& z) noexcept {
    s.var_x = z.var_x;
    s.var_y = z.var_y;
    s.cov_xy = z.cov_xy;
    if (std::isfinite(z.heading_rad)) {
      s.has_heading = true;
      s.heading_rad = z.heading_rad;
    }
    if (std::isfinite(z.length_m)) s.length_m = z.length_m;
    if (std::isfinite(z.width_m)) s.width_m = z.width_m;
  }

  const TrackerParams params_;
  const LifeCycleParams life_cycle_;
  Arena arena_;
  Pair* pairs_ = nullptr;
  bool* taken_ = nullptr;
};

}  // namespace overtake::test
