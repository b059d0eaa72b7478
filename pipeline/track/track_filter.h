// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// The extended Kalman filter of one track (eqs. 6 and 7): state (x, y, v, phi, omega), measurement (x, y). Double
// precision; the matrix library stays in the .cpp.
#pragma once

#include "core/track_table.h"
#include "pipeline/track/measurement.h"
#include "pipeline/track/motion_model.h"

namespace overtake {

struct TrackEstimate {
  MotionState mean;
  double covariance[kTrackStateSize][kTrackStateSize] = {};  // symmetric
};

// Growth of the variances a second (Q scales with dt), and the longest step one linearisation may stand for.
struct ProcessNoise {
  double variance_per_s[kTrackStateSize] = {};
  double max_step_s = 0.05;
};

struct Innovation {
  double d2 = 0;       // squared Mahalanobis distance
  double log_det = 0;  // ln det S
};

// Moves the estimate by dt_s. The mean is exact for any dt; the covariance goes in equal steps <= max_step_s. Backward
// (dt_s < 0) there is no process noise: the way back undoes the motion, it does not forget anything new. `whole`: where
// the mean is after dt_s, when that is known already; a prediction in one step need not find it again.
void predict(TrackEstimate& estimate, const ProcessNoise& noise, double dt_s, const Advanced* whole = nullptr) noexcept;

// False when S is not positive definite (then the pair is impossible).
bool innovate(const TrackEstimate& estimate, const Measurement& z, Innovation* out) noexcept;

// Joseph form, symmetrised, phi wrapped, v >= 0 (turn_round). False, nothing changed, when S is not positive definite.
bool update(TrackEstimate& estimate, const Measurement& z) noexcept;

// (v, phi) and (-v, phi + pi) are one motion with one omega. Chooses the one with v >= 0; the signs of v's row and
// column change with it.
void turn_round(TrackEstimate& estimate) noexcept;

// Finite and within what a car can do (|v| <= 1000 m/s, |omega| <= 100 rad/s, positive variances).
bool is_sound(const TrackEstimate& estimate) noexcept;

}  // namespace overtake
