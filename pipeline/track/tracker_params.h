// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// Parameters of a tracker, with the defaults of params.def. A policy reads those of its motion model and association
// only.
#pragma once

#include <cstdint>

#include "pipeline/param_defaults.h"

namespace overtake {

// Largest values that a car can have.
inline constexpr double kMaxPlace_m = 1e8, kMaxAngle_rad = 1e6, kMaxSpeed_mps = 1e3, kMaxYawRate_rps = 100.0;

inline constexpr double kMaxStampSpread_s = 1.0;  // largest distance of a measurement's stamp from its frame's
inline constexpr double kMaxBackward_s = 0.5;     // largest age of a measurement relative to its track's state
inline constexpr double kMaxPredict_s = 60.0;

// Parameters of LanePolicy only (params.def: lane_tracker.*).
struct LaneTrackerParams {
  double q_along = param_default::lane_tracker_q_along;
  double q_across = param_default::lane_tracker_q_across;
  double q_speed = param_default::lane_tracker_q_speed;
  double q_course = param_default::lane_tracker_q_course;
  double q_yaw_rate = param_default::lane_tracker_q_yaw_rate;
  double lane_s = param_default::lane_tracker_lane_s;
  double stand_mps = param_default::lane_tracker_stand_mps;
  double part_share = param_default::lane_tracker_part_share;
  double steady_lag = param_default::lane_tracker_steady_lag;
  double manoeuvre_gain = param_default::lane_tracker_manoeuvre_gain;
  double birth_speed_share = param_default::lane_tracker_birth_speed_share;
  double birth_sigma_share = param_default::lane_tracker_birth_sigma_share;
  double birth_sigma_course = param_default::lane_tracker_birth_sigma_course_rad;
  double birth_sigma_yaw_rate = param_default::lane_tracker_birth_sigma_yaw_rate;
  double p_detect = param_default::lane_tracker_p_detect;
  double half_m = param_default::lane_tracker_half_m;
  double p_hidden = param_default::lane_tracker_p_hidden;
  double p_wing = param_default::lane_tracker_p_wing;
  double clutter_per_m2 = param_default::lane_tracker_clutter_per_m2;
  double clutter_reach_m = param_default::lane_tracker_clutter_reach_m;
  double clutter_area_m2 = param_default::lane_tracker_clutter_area_m2;
  double hit_score = param_default::lane_tracker_hit_score;
  double unknown_score = param_default::lane_tracker_unknown_score;
  double low_m = param_default::lane_tracker_low_m;
  double low_score = param_default::lane_tracker_low_score;
  double car_points = param_default::lane_tracker_car_points;
  double sparse_score = param_default::lane_tracker_sparse_score;
  double thin_score = param_default::lane_tracker_thin_score;
  double confirm_score = param_default::lane_tracker_confirm_score;
  double drop_score = param_default::lane_tracker_drop_score;
  double most_score = param_default::lane_tracker_most_score;
  double coast_s = param_default::lane_tracker_coast_s;
  double coast_sigma_m = param_default::lane_tracker_coast_sigma_m;
  int32_t confirm_hits = param_default::lane_tracker_confirm_hits;
  int32_t tentative_misses = param_default::lane_tracker_tentative_misses;
  double length_m = param_default::vehicle_length_m;  // of the cars
  double width_m = param_default::vehicle_width_m;
  double path_turn_s = param_default::lane_tracker_path_turn_s;
  double path_speed = param_default::lane_tracker_path_speed;
  double path_across = param_default::lane_tracker_path_across;
};

struct KernelTable;

struct TrackerParams {
  // Per q_step_s, scales with dt.
  double q_diag[5] = {param_default::tracker_q_x, param_default::tracker_q_y, param_default::tracker_q_speed,
                      param_default::tracker_q_course, param_default::tracker_q_yaw_rate};
  double q_step_s = 0.05;
  double r_diag[2] = {param_default::tracker_r_x, param_default::tracker_r_y};  // m^2; a measurement may carry its own
  double birth_sigma_v = param_default::tracker_birth_sigma_speed;
  double birth_sigma_phi = param_default::tracker_birth_sigma_course_rad;
  double birth_sigma_omega = param_default::tracker_birth_sigma_yaw_rate;
  double birth_speed_share = param_default::tracker_birth_speed_share;  // of the ego speed
  double gate_d2 = param_default::tracker_gate_d2, gate_m = param_default::tracker_gate_m;
  int32_t window = param_default::tracker_window;              // N (1..64)
  int32_t confirm_hits = param_default::tracker_confirm_hits;  // M_c
  int32_t keep_hits = param_default::tracker_keep_hits;        // M_e
  // A track without a hit for longer is deleted; at most 60.
  double max_silence_s = param_default::tracker_max_silence_s;
  double predict_step_s = 0.05;  // a longer prediction is split into steps
  double horizon_s = param_default::tracker_horizon_s, horizon_step_s = param_default::tracker_horizon_step_s;
  double heading_speed_mps = 3.0;   // in the map the course of a confirmed track this fast tells front from rear
  double lead_s = 0;                // pushed detections may be ahead of scans by this much
  double history_s = 0.5;           // a frame at most this much older than the newest is inserted,
  int32_t history_iterations = 32;  // at most this many iterations back (1..256)
  int32_t track_capacity = 256, detection_capacity = 256;
  LaneTrackerParams lane;
  double work_limit = param_default::tracker_work_limit;  // steps of about 2 ns that a frame may take
  const KernelTable* kernels = nullptr;                   // null: the best of this CPU
};

// Clamps the parameters, so that any values give a tracker that works. The configuration refuses invalid ones by name.
TrackerParams make_sane(TrackerParams params) noexcept;

// The number of points of a predicted path over a horizon: the nearest number of steps.
inline int32_t path_points(const TrackerParams& params, double horizon_s) noexcept {
  return int32_t(horizon_s / params.horizon_step_s + 0.5);
}

}  // namespace overtake
