// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// Does a filter know how wrong it is? NEES = e^T P^-1 e of an estimate's error e and its covariance P, NIS the same of
// an innovation (Bar-Shalom et al. 2001, section 5.4): for a consistent filter both have the mean of their dimension.
// And how a car was followed over time: when its track was confirmed, how long it was not there, which were of no car.
#pragma once

#include <cstdint>
#include <map>
#include <set>
#include <vector>

namespace overtake::metrics {

// e^T P^-1 e of `n` components, n <= 8; `lower` holds P's lower triangle row by row. NaN unless P is positive definite.
double normalized_square(const double* error, const double* lower, int32_t n);

// One car from coming into view to leaving it.
struct Presence {
  uint64_t object = 0;
  double begin_s = 0, end_s = 0;  // first and last frame it was there
  double time_to_confirm_s = 0;   // from begin_s; NaN: never
  double longest_gap_s = 0;       // after it was first confirmed: between confirmed frames, or to the end
};

// Frame by frame: which cars are there, and which of them a confirmed track follows.
class Continuity {
 public:
  // A car that is away for longer than this comes anew.
  explicit Continuity(double away_s = 1.0) : away_s_(away_s) {}
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

// Confirmed tracks that were at no car in any frame of their life.
class FalseTracks {
 public:
  void add(uint64_t track, bool at_a_car) { (at_a_car ? good_ : seen_).insert(track); }
  int64_t count() const;
  double per_hour(double seconds) const;  // NaN without time

 private:
  std::set<uint64_t> seen_, good_;
};

}  // namespace overtake::metrics
