// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// The extended Kalman filter of one track (eqs. 6 and 7): state (x, y, v, phi, omega), measurement (x, y). Double
// precision; only the .cpp includes the matrix library.
#pragma once

#include "core/track_table.h"
#include "kernels/predict_paths.h"
#include "pipeline/track/measurement.h"
#include "pipeline/track/motion_model.h"

namespace overtake {

struct TrackEstimate {
  MotionState mean;
  double covariance[kTrackStateSize][kTrackStateSize] = {};  // symmetric
};

// Growth of the variances per second (Q scales with dt), and the longest step of one linearisation.
struct ProcessNoise {
  double variance_per_s[kTrackStateSize] = {};
  double max_step_s = 0.05;
};

struct Innovation {
  double d2 = 0;       // squared Mahalanobis distance
  double log_det = 0;  // ln det S
};

// The steps of a prediction by dt_s. With more than kPlainSteps, predict() guards P against rounding.
int predict_steps(const ProcessNoise& noise, double dt_s) noexcept;
inline constexpr int kPlainSteps = 8;

// Predicts by dt_s. The mean is exact for any dt; the covariance advances in equal steps <= max_step_s. A prediction
// back (dt_s < 0) only inverts the motion and adds no process noise. `whole`: advance() by dt_s, if the caller has it
// already; a prediction in one step then does not compute it again.
void predict(TrackEstimate& estimate, const ProcessNoise& noise, double dt_s, const Advanced* whole = nullptr) noexcept;

// False when S is not positive definite (then the pair is impossible).
bool innovate(const TrackEstimate& estimate, const Measurement& z, Innovation* out) noexcept;

// Joseph form, symmetrised, phi wrapped, v >= 0 (turn_round; `turned`, which may be null, gets its result). False,
// nothing changed, when S is not positive definite.
bool update(TrackEstimate& estimate, const Measurement& z, bool* turned = nullptr) noexcept;

// The second measurement of a track, dt_s after the first one, when (v, phi) is a guess only: each component of the
// velocity has the deviation of v, and the place's covariance holds what that adds in dt_s. Linear in the velocity: an
// update in (v, phi) cannot turn the course by more than a few tenths of a radian. False, nothing changed, when S is
// not positive definite.
bool find_course(TrackEstimate& estimate, const Measurement& z, double dt_s) noexcept;

// (v, phi) and (-v, phi + pi) are the same motion with the same omega. Chooses the form with v >= 0, and changes the
// signs of v's row and column to match. True if it changed the form.
bool turn_round(TrackEstimate& estimate) noexcept;

// After a prediction that is not one of predict(): keeps P positive definite in spite of rounding. `adds_little`: the
// prediction added so little noise that rounding may remove more.
void keep_sound(TrackEstimate& estimate, bool adds_little) noexcept;

// Writes the mean and the covariance to row i of a table.
void write_estimate(const TrackEstimate& estimate, TrackTable& t, std::size_t i) noexcept;

// Writes the estimate to a point of a path.
void write_point(const TrackEstimate& estimate, const PathRows& rows, int32_t point) noexcept;

// Finite and within what a car can do (|v| <= 1000 m/s, |omega| <= 100 rad/s, positive variances).
bool is_sound(const TrackEstimate& estimate) noexcept;

}  // namespace overtake
