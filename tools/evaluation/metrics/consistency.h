// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// Whether a filter's covariance fits its errors. NEES = e^T P^-1 e of an estimate's error e and its covariance P; NIS
// is the same for an innovation (Bar-Shalom et al. 2001, section 5.4). For a consistent filter the mean of both is
// their dimension. Also how a car was tracked over time: time to the confirmed track, gaps, and false tracks.
#pragma once

#include <cstdint>
#include <map>
#include <set>
#include <vector>

namespace overtake::metrics {

// e^T P^-1 e of `n` components, n <= 8; `lower` holds P's lower triangle row by row. NaN unless P is positive definite.
double normalized_square(const double* error, const double* lower, int32_t n);

inline constexpr double kAwayS = 1.0;  // a car that is absent for longer counts as a new one

// One car from coming into view to leaving it.
struct Presence {
  uint64_t object = 0;
  double begin_s = 0, end_s = 0;  // first and last frame with the car
  double time_to_confirm_s = 0;   // from begin_s; NaN: never
  double longest_gap_s = 0;       // after the first confirmation: between confirmed frames, or to the end
};

// For each frame: the cars that exist, and those with a confirmed track.
class Continuity {
 public:
  explicit Continuity(double away_s = kAwayS) : away_s_(away_s) {}
  void add(double time_s, uint64_t object, bool followed);
  std::vector<Presence> presences() const;

 private:
  struct State {
    Presence presence;
    double last_followed_s = 0;
    bool ever = false;
  };
  static Presence close(const State& state);
  double away_s_;
  std::map<uint64_t, State> open_;
  std::vector<Presence> done_;
};

// Confirmed tracks that were never at a car.
class FalseTracks {
 public:
  void add(uint64_t track, bool at_a_car) { (at_a_car ? good_ : seen_).insert(track); }
  int64_t count() const;
  double per_hour(double seconds) const;  // NaN without time

 private:
  std::set<uint64_t> seen_, good_;
};

}  // namespace overtake::metrics
