// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// How one car is followed over a run: its id over overtakes and gaps, and when and where it is confirmed. README "Track
// figures" has the definitions.
#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <vector>

#include "tools/evaluation/metrics/summary.h"
#include "tools/evaluation/run_logs.h"

namespace overtake::evaluation {

inline constexpr double kSeenPoints = 3;                  // a car with these points or more is detectable
inline constexpr double kOvertakeM = 60;                  // a whole overtake reaches this far ahead and behind
inline constexpr double kOvertakeAsideM = 30;             // ... and no farther aside
inline constexpr double kGapS = 3;                        // shortest gap
inline constexpr double kBeforeGapS = 1, kAfterGapS = 2;  // times in which the car must have its id
inline constexpr double kAwayS = 1.5;                     // a car without rows for longer has left (away_of)
inline constexpr double kApproachM = 250;                 // range from which on an approach is followed

// A car in a compared frame.
struct CarRow {
  double time_s = 0, ahead_m = 0, left_m = 0;
  double points = 0;        // NaN: unknown
  bool confirmed = false;   // a confirmed track is at it
  uint64_t id = 0;          // of the confirmed track that CLEAR MOT gives it, 0 none
  double existence = 0;     // the largest of the tracks at it, 0 none
  bool begins_log = false;  // of the log's first frame: no track is older
};
// Of each car of a run, in order of time.
std::map<double, std::vector<CarRow>> car_rows(const Run& run);

struct KeptIds {
  metrics::Group overtakes, gaps, losses;  // hits: the id is the same
};
KeptIds count_kept_ids(const std::vector<CarRow>& rows, double away_s = kAwayS);

// For each presence of the car from kNearestM to kFarthestM with a moment of kSeenPoints: time from the first one to
// the first row that `is_found`, 0 if that is earlier; NaN never. A pause of away_s does not end a presence. Presences
// whose first row is found (the car had its track before) say nothing of the delay and are only counted, but for those
// that begin with the log.
struct Delays {
  std::vector<double> seconds;
  int64_t already_found = 0;
};
Delays delays_to(const std::vector<CarRow>& rows, const std::function<bool(const CarRow&)>& is_found,
                 double away_s = kAwayS);

// A car that comes nearer from far away.
struct Approach {
  bool ahead = false;
  double confirmed_m = 0;  // distance at its first confirmed track; NaN: never
};
std::vector<Approach> find_approaches(const std::vector<CarRow>& rows, double away_s = kAwayS);

}  // namespace overtake::evaluation
