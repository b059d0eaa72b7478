// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// The figures that presets are compared and tuned by: found cars, false detections, clusters, ground, errors of the
// centres. One preset on one scenario, or on all. README "Quality figures" defines each of them.
#pragma once

#include <array>
#include <map>
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

#include "tools/evaluation/metrics/summary.h"
#include "tools/evaluation/run_logs.h"

namespace overtake::evaluation {

inline constexpr double kQualityBinM = 20;

// Car-frames (a car in a frame), in all and detected; [0]: with 3 points or more, [1]: with 5.
struct CarFrames {
  int64_t all = 0;
  std::array<int64_t, 2> seen = {}, detected = {};
  double bound(std::size_t k) const;           // share of all that is seen: no detector finds more
  double detected_share(std::size_t k) const;  // share of the seen ones that is detected
};

struct Quality {
  std::string variant, scenario;
  int64_t frames = 0, cars_judged = 0;  // cars_judged: car-frames with 5 points or more, the base of the clusters
  CarFrames near;                       // from -100 to +150 m
  metrics::Share detected;              // of near.seen[0], with the interval by event
  CarFrames first_lap, later_laps;      // of near, before and after the ego has driven the length of the map once
  std::vector<CarFrames> by_distance;   // bins of kQualityBinM from -100 m on; the last one ends at +150 m

  double false_detections = 0;               // a frame, from -100 to +150 m
  double false_anywhere = 0;                 // a frame, at any distance; each table below divides it
  std::map<std::string, double> by_surface;  // by the main surface of their points; "unknown": the log does not know
  std::map<std::string, double> by_range;
  std::map<std::string, double> by_bank;  // roll of the ego, away from level; those with a true ego pose
  std::map<std::string, double> by_lap;   // pieces of 200 m of the centre line; those on the map
  int64_t frames_without_car = 0;         // no car from -100 to +150 m
  double false_without_car = 0;           // in each of these, from -100 to +150 m

  int64_t debris_frames = 0;  // frames that see debris with 3 points or more
  double debris_found = 0;    // share of them with a detection of class debris on it

  double clusters_per_car = 0, without_cluster = 0;  // mean of the car-frames with a cluster; share of those without
  double mixed_per_car = 0;
  double tpr = 0, ppv = 0, ppv_p5 = 0, f1 = 0;  // means over the scans; 5th percentile
  metrics::Summary along_m, across_m;           // sizes of the centre errors, in the axes of the car
  std::array<double, 2> heading_rms_deg = {};   // error of the ego heading: as pushed, and as the method corrects it
  metrics::Share in_ellipse;                    // of the detections at a car that have a covariance
};

// One for each variant and scenario, and one for each variant on all of them (scenario "all") if there are several.
std::vector<Quality> find_quality(const std::vector<Run>& runs);
nlohmann::json json_of(const Quality& quality);

// A table of text: the header and the rows of figures, with a column for each. Rows without a value in any column are
// left out.
Rows quality_rows(const std::vector<Quality>& columns);
// One scenario in each row, with found cars and false detections of each variant.
Rows scenario_rows(const std::vector<Quality>& all);
// Those of one scenario; without sweeps.
std::vector<Quality> quality_of(const std::vector<Quality>& all, const std::string& scenario);
// The scenario of the main table: "all" if there are several.
std::string main_scenario(const std::vector<Quality>& all);
// Prints both tables.
void print_quality(const std::vector<Quality>& all);

}  // namespace overtake::evaluation
