// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// Declarations shared by the parts of figures.cpp.
#pragma once

#include <algorithm>
#include <map>
#include <string>
#include <vector>

#include "tools/evaluation/figures.h"

namespace overtake::evaluation {

std::vector<double> column_of(const Table& table, const std::string& name);
int32_t bin_of(double ahead_m);  // of distance, -1: outside
double step_of(const Run& run);  // seconds from a compared frame to the next
// The limit of a pause, long enough for runs that compare every N-th frame.
inline double away_of(const Run& run, double least_s) { return std::max(least_s, 1.5 * step_of(run)); }

// The rows of one car in the table of cars, in order, and the event (events_of) of each of them.
struct CarRows {
  double car;
  std::vector<std::size_t> rows;
  std::vector<int32_t> events;
};
std::vector<CarRows> rows_by_car(const Table& cars);

// Cars within reach and confirmed tracks of each compared frame, by its number. Cars count from kNearestM to
// kFarthestM, even if no beam can hit them; a track at a car farther away is left out.
struct MotFrame {
  double time_s = 0;
  std::vector<metrics::MotPlace> objects, tracks;
};
std::map<double, MotFrame> mot_frames(const Run& run);
// Confirmed tracks that, while confirmed, were never at a car nor on a parked vehicle.
int64_t count_false_tracks(const Run& run);

struct TrackSamples {
  std::vector<double> gospa, located, missed, false_tracks, nees, nis, nis_own, to_confirm, gap, age;
  metrics::HotaResult hota, hota_window;                    // sums over the runs
  int64_t runs = 0, with_pairs = 0, with_pairs_window = 0;  // with_pairs: with a localisation
};
void add_tracks(const Run& run, Figures& out, TrackSamples& samples);
void finish_tracks(Figures& out, const TrackSamples& samples);

}  // namespace overtake::evaluation
