// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// Figures of confirmed tracks that a planner depends on: predicted paths, probability of existence, errors by what the
// car does and by range, identity, confirmation. One preset on one scenario, or on all. README "Track figures" defines
// each of them.
#pragma once

#include <array>
#include <map>
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

#include "tools/evaluation/metrics/calibration.h"
#include "tools/evaluation/path_judge.h"
#include "tools/evaluation/places.h"
#include "tools/evaluation/track_identity.h"

namespace overtake::evaluation {

// What a car does from now to the horizon h. Limits are means over it: change of the speed over h, change of the offset
// over h. A car that does neither clearly is only in kAll.
enum class Manoeuvre : std::size_t { kAll, kCruising, kSpeedChange, kLaneChange, kCount };
inline constexpr std::size_t kManoeuvres = std::size_t(Manoeuvre::kCount), kHorizons = std::size(kHorizonsS);
inline constexpr double kCruiseMps2 = 1, kCruiseOffsetMps = 0.2;  // at most, both
inline constexpr double kHardMps2 = 3;                            // more: braking, or accelerating
inline constexpr double kLaneChangeMps = 0.5;                     // more
inline constexpr double kSpinSlipRad = 0.175, kSpinYawRateRps = 0.7;
inline constexpr std::array<double, 4> kRangesM = {0, 40, 80, 110};  // ranges of the position errors
inline constexpr double kFalseGoalPerHour = 0.1;

struct Spread {  // of a signed error
  metrics::Summary error;
  double size_p95 = 0, rms = 0;  // of its size; root mean square, with the bias
};
Spread spread_of(const std::vector<double>& errors);

struct PathFigures {
  Spread along_m, across_m;
  metrics::Share in_70, in_95;  // of those with a covariance; in_70: of a steady car, where it is published
};

struct FoundAfter {  // per presence of a car (track_identity.h)
  int64_t presences = 0, never = 0;
  double median_s = 0, p99_s = 0;  // of those found
  int64_t already_found = 0;       // from their first row on: not among the presences
};
FoundAfter found_after(const Delays& delays);

struct ConfirmedAt {  // per approach of a car
  int64_t approaches = 0, never = 0;
  double median_m = 0, least_m = 0;  // of those confirmed
};

// What would happen if a track were confirmed at this existence.
struct Threshold {
  double existence = 0;
  int64_t false_tracks = 0;
  double false_per_hour = 0;
  FoundAfter delay;
};

struct TrackQuality {
  std::string variant, scenario;
  double hours = 0;  // of the logs
  std::array<std::array<PathFigures, kManoeuvres>, kHorizons> paths;
  metrics::Calibration existence;
  std::vector<Threshold> thresholds;  // rising; empty: the method publishes no existence
  Spread speed_mps, speed_cruising_mps, speed_braking_mps;
  std::array<Spread, kRangesM.size() - 1> along_m, across_m;  // by range, in the true ego's axes
  Spread course_rad, spin_heading_rad, spin_axis_rad;         // axis: the heading modulo 180 deg
  metrics::Group overtakes, gaps, losses;
  FoundAfter confirmed;
  ConfirmedAt from_ahead, from_behind;

  // The least threshold with at most kFalseGoalPerHour; null: none.
  const Threshold* least_threshold() const;
};

// One for each variant and scenario, and one for each variant on all of them (scenario "all") if there are several.
std::vector<TrackQuality> find_track_quality(const std::vector<Run>& runs);
nlohmann::json json_of(const TrackQuality& quality);

// Tables of text, a column for each preset, the last one with the goal ("-": none). Rows without a value are left out.
Rows track_rows(const std::vector<TrackQuality>& columns);
Rows path_rows(const std::vector<TrackQuality>& columns);
Rows calibration_rows(const std::vector<TrackQuality>& columns);
Rows threshold_rows(const std::vector<TrackQuality>& columns);
// Those of one scenario; without sweeps.
std::vector<TrackQuality> track_quality_of(const std::vector<TrackQuality>& all, const std::string& scenario);
// Prints the tables of tracks and paths of one scenario.
void print_track_quality(const std::vector<TrackQuality>& all, const std::string& scenario);

}  // namespace overtake::evaluation
