// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// The numbers behind the figures of one contestant on one scenario, pooled over its runs (logs, seeds).
#pragma once

#include <map>
#include <set>
#include <string>
#include <vector>

#include "tools/evaluation/metrics/clear_mot.h"
#include "tools/evaluation/metrics/hota.h"
#include "tools/evaluation/metrics/summary.h"
#include "tools/evaluation/run_logs.h"

namespace overtake::evaluation {

inline constexpr double kBinM = 10, kWindowS = 20;
inline constexpr int32_t kMinCarPoints = 5;  // a car with fewer points is not asked for its clusters
inline constexpr double kNearCarM = 60;      // where nobody knows a car's points: one farther off is not asked
inline constexpr double kMovesM = 1.5;       // of a car in a frame, against the map

enum class Origin { kSimulated, kRecorded, kMixed };
bool is_simulated(const Run& run);
Origin origin_of(const std::vector<Run>& runs);

struct GroundFigures {
  std::vector<double> tpr, ppv, f1;  // a value a scan; NaN where it is not defined
};

struct DistanceBin {  // longitudinal, ego to car
  double middle_m = 0;
  metrics::Share detected, confirmed;  // of the frames a car is there; intervals by event
  int64_t events = 0;
  double false_detections = 0, false_confirmed = 0;  // per frame, at this distance
};

struct TrackFigures {
  metrics::ClearMotCounts mot;
  metrics::HotaResult hota;         // the mean over the runs, a race as one sequence
  metrics::HotaResult hota_window;  // the same with every 20 s a sequence of its own: ids need to hold for so long only
  double gospa_located_m2 = 0, gospa_missed_m2 = 0, gospa_false_m2 = 0;  // means of the parts of its square
  int64_t doubles = 0;  // false positives at a car that has another track
  metrics::Summary gospa_m, nees, nis, time_to_confirm_s, longest_gap_s, data_age_s;
  double nees_low = 0, nees_high = 0, nis_low = 0, nis_high = 0;  // 95 % of a consistent filter's mean lies in here
  int64_t cars_seen = 0, never_confirmed = 0, false_tracks = 0;
  double false_per_hour = 0;
};

struct Figures {
  std::string contestant, scenario;
  int64_t runs = 0, frames = 0;
  Origin origin = Origin::kSimulated;
  bool surface_known = false;  // what each point lies on; else all that needs it is empty
  int32_t most_cars = 0;       // within reach at once, the ego apart
  double closest_cars_m = 0;   // between the middles of two of them; NaN: never two
  double seconds = 0;
  GroundFigures ground, grid;                              // against the surface truth
  GroundFigures ground_auto, grid_auto;                    // against the automatic labels
  GroundFigures auto_label;                                // these against the truth
  std::map<double, std::pair<double, double>> car_points;  // range -> points, found
  std::vector<double> clusters_per_car, boxed_per_car, mixed_other,
      mixed_cars;                                                       // a value a car and frame; mixed: a frame
  std::vector<double> mixed_by_size;                                    // the same by the paper's rule
  std::map<double, std::vector<double>> euclid_clusters, euclid_boxed;  // by radius, as above
  std::map<double, std::vector<double>> euclid_mixed, euclid_mixed_cars, euclid_mixed_by_size;
  metrics::Group seams;                                       // cars over a seam; those in one cluster
  std::vector<double> across_left_ahead, across_left_behind;  // of across_in_left_turns: the car before, behind the ego
  std::vector<double> across_in_left_turns, across_elsewhere;  // y_veh_m of detections at a car
  std::vector<double> along_moving_m;                          // size of x_veh_m, of detections at a car that moves
  std::vector<DistanceBin> distance;
  std::map<std::string, std::vector<double>> detection_errors, track_errors;  // by column; those at a car
  TrackFigures tracks;
  std::map<std::string, std::vector<double>> times_ms;  // by stage; a value a scan or frame
  std::set<std::string> cpus;                           // these times are of
  std::set<std::string> every;                          // baselines, labels and sweeps: every so many frames
};

// Throws what read tables throw where a column is missing.
std::vector<Figures> make_figures(const std::vector<Run>& runs);  // by contestant, then scenario

// The event a row belongs to: the passing nearest in time. `ahead_m` in order of time; events count from 0.
std::vector<int32_t> events_of(const std::vector<double>& ahead_m);

}  // namespace overtake::evaluation
