// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// Differences between configurations on the same logs, with their 95 % intervals: overtaking events are drawn again,
// the same ones for every configuration. For a grid of parameters: what each value costs. README "Differences".
#pragma once

#include <array>
#include <map>
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

#include "tools/evaluation/metrics/resample.h"
#include "tools/evaluation/run_logs.h"

namespace overtake::evaluation {

struct Measure {
  const char* key;   // in metrics.json
  const char* name;  // of a column
  int32_t digits;
};
inline constexpr Measure kMeasures[] = {
    {"detected", "detected", 4},
    {"false_detections_a_frame", "false a frame", 4},
    {"centre_along_m", "along m", 3},
    {"centre_across_m", "across m", 3},
    {"confirmed", "confirmed", 4},
    {"false_tracks_a_frame", "false tracks a frame", 4},
    {"track_position_m", "track position m", 3},
    {"track_speed_mps", "track speed m/s", 2},
};
inline constexpr std::size_t kMeasureCount = std::size(kMeasures);
using Estimates = std::array<metrics::Estimate, kMeasureCount>;

struct ContestantDifference {
  std::string contestant;
  Estimates values, differences;  // differences: this one less the base
};

// One value of one parameter: the mean over all configurations with it, less the same configurations with the
// reference value. A configuration that does not change the parameter has the preset's default.
struct ParameterValue {
  std::string preset, parameter;
  double value = 0;
  bool is_reference = false;   // the preset's default, else the least value
  int32_t configurations = 0;  // 0: none has both values
  Estimates differences;
};

struct Differences {
  std::string base;  // the first preset without changes, else the first configuration; "": nothing to compare
  // Left out: not run by all of them, or not with the truth of the base's run. Runs of another race or of other frames
  // (--frames, --compare-every) can have the same name of a log.
  int64_t logs = 0, logs_left_out = 0;
  int64_t events = 0;  // drawn again
  std::vector<ContestantDifference> contestants;
  std::vector<ParameterValue> parameters;
};

// Presets and configurations; without oracles, controls and sweeps of --sweep.
// base: a variant of `runs`; "": as Differences::base says.
Differences find_differences(const std::vector<Run>& runs, const std::string& base = "");
// The runs of several results of overtake evaluate: a variant's name begins with that of its folder. Throws io::Error.
std::vector<Run> read_results(const std::vector<std::string>& folders);
nlohmann::json json_of(const Differences& differences);
std::string json_text(const Differences& differences);  // the same as text

// Tables of text. An asterisk: the interval does not contain 0.
Rows difference_rows(const Differences& differences);
Rows parameter_rows(const Differences& differences);
void print_differences(const Differences& differences);

}  // namespace overtake::evaluation
