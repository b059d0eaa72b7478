// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// Parameters of a tracker. Those of a motion model or an association are read by the policies that have one.
#pragma once

#include <cstdint>

namespace overtake {

// Beyond these a number is nothing of a car's.
inline constexpr double kMaxPlace_m = 1e8, kMaxAngle_rad = 1e6, kMaxSpeed_mps = 1e3, kMaxYawRate_rps = 100.0;

inline constexpr double kMaxStampSpread_s = 1.0;  // a measurement's stamp lies this near to its frame's
inline constexpr double kMaxBackward_s = 0.5;     // a track goes back so far to take an older measurement
inline constexpr double kMaxPredict_s = 60.0;

struct TrackerParams {
  double q_diag[5] = {0.005, 0.005, 0.5, 0.005, 0.0005};  // per q_step_s, scales with dt
  double q_step_s = 0.05;
  double r_diag[2] = {5.0, 5.0};  // m^2; a measurement may carry its own
  double birth_sigma_v = 20.0, birth_sigma_phi = 0.2, birth_sigma_omega = 0.1;
  double birth_speed_share = 0.8;  // of the ego speed
  double gate_d2 = 9.21, gate_m = 8.0;
  int32_t window = 20, confirm_hits = 6, keep_hits = 5;  // N (1..64), M_c, M_e
  double max_silence_s = 4.0;                            // without a hit a track dies in any case; at most 60
  double predict_step_s = 0.05;                          // longer steps are cut into such
  double horizon_s = 3.0, horizon_step_s = 0.1;
  double heading_speed_mps = 3.0;   // in the map a confirmed track this fast turns its heading
  double history_s = 0.5;           // a frame this much older than the newest is taken in, at
  int32_t history_iterations = 32;  // most so many iterations back (1..256)
  int32_t track_capacity = 256, detection_capacity = 256;
  double work_limit = 1e7;  // steps of about 2 ns that a frame may take
};

// Parameters of any value give a tracker that works; the configuration refuses senseless ones by name.
TrackerParams make_sane(TrackerParams params) noexcept;

}  // namespace overtake
