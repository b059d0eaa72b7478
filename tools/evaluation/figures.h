// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// The numbers behind the figures of one variant on one scenario, pooled over its runs (logs, seeds).
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
inline constexpr int32_t kMinCarPoints = 5;  // clusters of a car with fewer points are not evaluated
inline constexpr double kNearCarM = 60;      // the same for cars farther away, if the points of cars are unknown
inline constexpr double kMovesM = 1.5;       // of a car per frame, relative to the map

enum class Origin { kSimulated, kRecorded, kMixed };
bool is_simulated(const Run& run);
std::string scenario_of(const Run& run);  // its log's name if it has none
Origin origin_of(const std::vector<Run>& runs);

struct GroundFigures {
  std::vector<double> tpr, ppv, f1;  // one value per scan; NaN if undefined
};

struct DistanceBin {  // longitudinal, ego to car
  double middle_m = 0;
  metrics::Share detected, confirmed;  // of the frames with a car; intervals by event
  int64_t events = 0;
  double false_detections = 0, false_confirmed = 0;  // per frame, at this distance
};

struct TrackFigures {
  metrics::ClearMotCounts mot;
  metrics::HotaResult hota;         // mean over the runs; a race is one sequence
  metrics::HotaResult hota_window;  // the same with sequences of 20 s: ids need to last only that long
  double gospa_located_m2 = 0, gospa_missed_m2 = 0, gospa_false_m2 = 0;  // means of the parts of its square
  int64_t doubles = 0;  // false positives at a car that already has a track
  metrics::Summary gospa_m, nees, nis, nis_own, time_to_confirm_s, longest_gap_s, data_age_s;
  double nees_low = 0, nees_high = 0, nis_low = 0, nis_high = 0;  // contains 95 % of a consistent filter's means
  metrics::Share nees_inside, nis_inside, nis_own_inside;         // of single values, within bounds that contain 95 %
  int64_t cars_seen = 0, never_confirmed = 0, false_tracks = 0;
  double false_per_hour = 0;
  double false_s = 0, false_s_per_hour = 0;  // seconds of all confirmed tracks while they are at no car
};

struct Figures {
  std::string variant, scenario;
  int64_t runs = 0, frames = 0;
  Origin origin = Origin::kSimulated;
  bool surface_known = false;  // surface of each point known; otherwise values that need it are empty
  int32_t most_cars = 0;       // at once within reach, without the ego
  double closest_cars_m = 0;   // between the middles of two cars; NaN: never two
  double seconds = 0;
  GroundFigures ground, grid;                                  // compared with the surface truth
  GroundFigures ground_auto, grid_auto;                        // compared with the automatic labels
  GroundFigures auto_label;                                    // automatic labels compared with the truth
  std::map<double, std::pair<double, double>> car_points;      // range -> points, found
  std::vector<double> clusters_per_car;                        // one value per car and frame with a cluster of it
  metrics::Group with_cluster;                                 // cars and frames; those with a cluster of the car
  std::vector<double> boxed_per_car, mixed_other, mixed_cars;  // one value per car and frame; mixed: per frame
  std::vector<double> mixed_by_size;                           // the same by the paper's rule
  std::map<double, std::vector<double>> euclid_clusters, euclid_boxed;  // by radius, as above
  std::map<double, std::vector<double>> euclid_mixed, euclid_mixed_cars, euclid_mixed_by_size;
  metrics::Group seams;                                        // cars over a seam; those in one cluster
  std::vector<double> across_left_ahead, across_left_behind;   // across_in_left_turns: car ahead, behind
  std::vector<double> across_in_left_turns, across_elsewhere;  // y_veh_m of detections at a car
  std::vector<double> along_moving_m;                          // size of x_veh_m, of detections at a moving car
  std::vector<DistanceBin> distance;
  std::map<std::string, std::vector<double>> detection_errors, track_errors;  // by column; only those at a car
  TrackFigures tracks;
  std::map<std::string, std::vector<double>> times_ms;  // by stage; one value per scan or frame
  std::set<std::string> cpus;                           // CPUs of these times
  std::set<std::string> every;                          // interval in frames of baselines, labels and sweeps
};

// Throws like read tables if a column is missing.
std::vector<Figures> make_figures(const std::vector<Run>& runs);  // by variant, then scenario

// The event of each row: the pass nearest in time. `ahead_m` in order of time; events count from 0.
std::vector<int32_t> events_of(const std::vector<double>& ahead_m);

}  // namespace overtake::evaluation
