// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// The beam directions of a vertically scanning LiDAR like the Hydra. Two heads scan +60..0 and 0..-60 degrees at the
// same time, line after line from top to bottom. The mirror keeps moving down during a line, so that a line falls by a
// part of its distance to the next one. Values of the recorded scans (README.md): 440 shots per head and line, 0.1366
// deg apart; a line falls by 0.42 of the spacing.
//
//     u = (line + sweep * shot / shots) / lines   in 0..1 is the way down; elevation(u) is the pattern:
//     uniform         equal steps
//     gaussian        steps like a normal distribution's quantiles: dense at the centre
//     horizon_dense   center + half (k w + (1 - k) w^3), w = 1 - 2u: the centre's spacing is k times that of uniform
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "tools/sim/sim_math.h"

namespace overtake::sim {

enum class PatternKind : uint8_t { uniform, gaussian, horizon_dense };

struct ScanPattern {
  PatternKind kind = PatternKind::uniform;
  double rate_hz = 20;  // 1 to 30; the scans share the lines of a second
  double lines_per_s = 640;
  double fov_top_rad = 7 * kDegree, fov_bottom_rad = -7 * kDegree;  // within +-15 deg
  double center_rad = 0;                                            // of the dense part
  double sigma_rad = 3.2 * kDegree;                                 // gaussian
  double dense_share = 0.42;                                        // horizon_dense: k
  double drift_rad = 0, drift_period_s = 10;                        // the whole pattern swings slowly up and down

  int32_t lines() const { return int32_t(lines_per_s / rate_hz + 1e-9); }
  double elevation(double u, double time_s) const;
};

inline constexpr int32_t kShots = 440;  // per head and line
inline constexpr double kShotStep = 0.1366 * kDegree;
inline constexpr double kAzimuthLeft = 60.1 * kDegree;  // left head's first shot; the right head's is 60 deg less
inline constexpr double kSweepShare = 0.42;             // of a line's period: the points; then the mirror returns

// Throws std::invalid_argument. "uniform", "gaussian", "horizon_dense".
PatternKind pattern_kind(const std::string& name);

// Inverse of the normal distribution, 0 < p < 1; by bisection.
double normal_quantile(double p);
double normal_distribution(double x);  // absolute error below 1e-12

}  // namespace overtake::sim
