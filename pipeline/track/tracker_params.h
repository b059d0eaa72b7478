// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// Parameters of a tracker. A policy reads those of its motion model and association only.
#pragma once

#include <cstdint>

namespace overtake {

// Largest values that a car can have.
inline constexpr double kMaxPlace_m = 1e8, kMaxAngle_rad = 1e6, kMaxSpeed_mps = 1e3, kMaxYawRate_rps = 100.0;

inline constexpr double kMaxStampSpread_s = 1.0;  // largest distance of a measurement's stamp from its frame's
inline constexpr double kMaxBackward_s = 0.5;     // largest age of a measurement relative to its track's state
inline constexpr double kMaxPredict_s = 60.0;

// Parameters of LanePolicy only (params.def: lane_tracker.*).
struct LaneTrackerParams {
  double q_along = 0.02, q_across = 0.006, q_speed = 0.5, q_course = 0.0002;
  double q_yaw_rate = 0.008, lane_s = 0.08, stand_mps = 3.0, part_share = 3.0, steady_lag = 3.0;
  double manoeuvre_gain = 20.0, birth_speed_share = 0.6, birth_sigma_share = 0.4, birth_sigma_course = 0.1;
  double birth_sigma_yaw_rate = 0.05, p_detect = 0.5, half_m = 110.0, p_hidden = 0.1, p_wing = 0.1;
  double clutter_per_m2 = 1e-05, clutter_reach_m = 10.0, clutter_area_m2 = 100.0, hit_score = 3.0;
  double unknown_score = -3.0, low_m = 0.3, low_score = -3.0, car_points = 80000.0, sparse_score = -3.0;
  double thin_score = -1.5, confirm_score = 4.0, drop_score = -2.0;
  double most_score = 8.0, coast_s = 4.0, coast_sigma_m = 20.0;
  int32_t confirm_hits = 3, tentative_misses = 8;
  double length_m = 4.921, width_m = 1.886;  // of the cars
  double path_turn_s = 0.3, path_speed = 10.0, path_across = 0.4;
};

struct KernelTable;

struct TrackerParams {
  double q_diag[5] = {0.005, 0.005, 0.5, 0.005, 0.0005};  // per q_step_s, scales with dt
  double q_step_s = 0.05;
  double r_diag[2] = {5.0, 5.0};  // m^2; a measurement may carry its own
  double birth_sigma_v = 20.0, birth_sigma_phi = 0.2, birth_sigma_omega = 0.1;
  double birth_speed_share = 0.8;  // of the ego speed
  double gate_d2 = 9.21, gate_m = 8.0;
  int32_t window = 20, confirm_hits = 6, keep_hits = 5;  // N (1..64), M_c, M_e
  double max_silence_s = 4.0;                            // a track without a hit for longer is deleted; at most 60
  double predict_step_s = 0.05;                          // a longer prediction is split into steps
  double horizon_s = 3.0, horizon_step_s = 0.1;
  double heading_speed_mps = 3.0;   // in the map the course of a confirmed track this fast tells front from rear
  double lead_s = 0;                // pushed detections may be ahead of scans by this much
  double history_s = 0.5;           // a frame at most this much older than the newest is inserted,
  int32_t history_iterations = 32;  // at most this many iterations back (1..256)
  int32_t track_capacity = 256, detection_capacity = 256;
  LaneTrackerParams lane;
  double work_limit = 1e7;               // steps of about 2 ns that a frame may take
  const KernelTable* kernels = nullptr;  // null: the best of this CPU
};

// Clamps the parameters, so that any values give a tracker that works. The configuration refuses invalid ones by name.
TrackerParams make_sane(TrackerParams params) noexcept;

// The number of points of a predicted path over a horizon: the nearest number of steps.
inline int32_t path_points(const TrackerParams& params, double horizon_s) noexcept {
  return int32_t(horizon_s / params.horizon_step_s + 0.5);
}

}  // namespace overtake
