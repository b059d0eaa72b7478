// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// The content of a simulated race: plain data, read from a TOML file (README.md lists the keys).
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "tools/sim/ego_localisation.h"
#include "tools/sim/mesh.h"
#include "tools/sim/motion.h"
#include "tools/sim/rain.h"
#include "tools/sim/scan_pattern.h"

namespace overtake::sim {

struct SensorErrors {
  double range_noise_m = 0.01;                                           // one sigma
  double beam_rad = 0.0015;                                              // full width of a beam (4 sigma of its energy)
  double missing_line_share = 0;                                         // of missing lines
  double clock_jitter_s = 0.0002;                                        // of a scan's stamp, one sigma
  double mounting_error_m = 0.005, mounting_error_rad = 0.1 * kDegree;   // one sigma per axis, one draw per run
  double head_overlap_rad = 1 * kDegree, head_spread_rad = 1 * kDegree;  // of a sensor's two heads: mean, one sigma
  double head_step_rad = 0.08 * kDegree;                                 // difference of their elevations, one sigma
  double range_min_m = 0.5, range_max_m = 300;
  bool second_returns = true;
  // The own car always blocks the view. Recorded front scans contain a few returns from it, side scans none.
  double own_nose_share = 0.03;  // of the front sensor's beams on the own car that give a return, in patches
  bool report_own_car = false;   // every return from the own car, in all scans
};

struct PatternChange {
  double at_s;
  ScanPattern pattern;
};

struct Puffs {  // tyre smoke or dust behind a car
  std::string car;
  double from_s, to_s, per_s, density_pm, life_s;
};

struct Debris {
  double s_m, d_m, size_m, height_m;
  bool tyre;  // a tyre that lies on its side; else a box
};

struct Reflectors {  // plates on posts, facing the oncoming cars
  double s_m, d_m, height_m, size_m;
  int32_t count;
  double every_m;
};

inline constexpr int32_t kSensors = 3;
inline constexpr const char* kSensorName[kSensors] = {"front", "left", "right"};

struct Dirt {  // on the window of a sensor: no beam in this sector returns
  int32_t sensor;
  double azimuth_rad, width_rad, from_s, to_s;
};

struct Scenario {
  std::string name, track = "oval", ego = "ego";
  double seconds = 20;
  std::vector<int64_t> tune_seeds, test_seeds;
  double seam_strip_m = 0.82;                   // blind strip between front and side sensors
  double map_error_m = 0.05, map_wave_m = 200;  // survey error of the written map: one sigma, correlation length
  double map_shift_m = 0;                       // of the whole map, to the left
  std::vector<PatternChange> patterns;          // at least one, the first from the start
  SensorErrors errors;
  LocalisationErrors localisation;
  std::vector<CarPlan> cars;
  std::vector<Puffs> puffs;
  Rain rain;
  std::vector<Debris> debris;
  std::vector<Reflectors> reflectors;
  std::vector<Dirt> dirt;
  Verge verge;
  bool without_map = false, without_poses = false;  // the log does not hold them

  int32_t find_car(const std::string& car) const;  // -1: none
  const ScanPattern& pattern_at(double time_s) const;
};

// A built-in name, or else a file: ./NAME is a file of a built-in name. Throws io::Error with file and line.
Scenario load_scenario(const std::string& file_or_name);
Scenario parse_scenario(const std::string& path_in_errors, std::string_view text);
std::vector<std::string> builtin_scenario_names();
bool is_builtin_scenario(const std::string& name);

}  // namespace overtake::sim
