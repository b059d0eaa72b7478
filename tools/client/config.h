// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// The configuration of a command. Later sources override earlier ones: the preset's defaults, the --config file, the
// command line. Reader and writer use the same text form, so the config.toml beside a result works with --config.
//
//   preset = "best"   map = "FILE"   ego = "FILE"   workers = 1   isa = "ref"      (all optional)
//   rig = "NAME or FILE", or the table [rig] with its [[rig.sensor]] (see tools/io/rig.h)
//   [capacities]   clusters = 4096      (rows of the detector's tables, before the rig's: tools/io/rig.h)
//   [node]   domain = 0      (of overtake node only: tools/ros2/node_options.h)
//   [tracker]   confirm_hits = 3      (any parameter "group.name"; overtake params lists them)
//
// Without a rig, map or ego option, the input's own are used: attachments rig.toml and map.csv and the ego poses of an
// MCAP log; rig.toml, map.csv and ego.csv of a folder that overtake simulate wrote. map = "none" and ego = "none" turn
// that off. Relative paths in a file start at its folder. The writer writes absolute paths, so that the file can be
// moved.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "pipeline/overtake.h"
#include "tools/io/output.h"
#include "tools/io/rig.h"

namespace overtake::cli {

// The options of the command line; an option that was not given is empty or negative.
struct Options {
  std::string command, input, out;
  std::string rig, urdf, preset, map, ego, config, isa;
  std::vector<std::string> set, capacity;  // key=value
  int32_t workers = -1;
  bool quiet = false, force = false;
};

struct Config {
  std::string command, input, preset = "best", map, ego, isa;
  int32_t workers = 1;
  ovt_params params;
  bool keep_images = true;  // false: the detector need not keep images (ovt_detector_def.keep_images)
  bool in_pieces = false;   // push scans in pieces, by the points' times
  bool live = false;        // the newest scan replaces one that waits (OVT_PUSH_REPLACE)
  int64_t deadline_ns = 0;  // ovt_detector_def.deadline_ns
  bool has_rig = false;
  bool own_rig = false, own_map = false, own_ego = false;  // from the input: an MCAP log, a folder of simulate
  bool no_ego = false;                                     // --ego none: do not use the recording's own poses either
  io::Rig rig;
  io::Capacities capacities;  // a missing one comes from the rig, else from the library's default
};

// Whether the preset of `params` reads the parameter; false also if there is none of that name.
bool reads_param(const ovt_params& params, std::string_view name);

// Uses the rig's period as frame.period_s unless that is set. Throws io::Error.
Config load_config(const Options& options);
// Like load_config, for a command that reads scans: also throws if there is no rig.
Config load_config_with_rig(const Options& options);
// Throws io::Error where the path of the map or of the ego poses is not UTF-8, which TOML cannot hold.
std::string format_config(const Config& config);
// Adds the files that the command reads to the guard, so that no output overwrites them.
void add_inputs(io::OutputGuard& guard, const Options& options, const Config& config);

// The capacities of the detector: the config's, else the rig's, else the library's default.
io::Capacities effective_capacities(const Config& config);
// "points, clusters, ...": the names that --capacity accepts.
std::string capacity_names();

// Parameters with the defaults of a preset. Throws Error if there is no such preset.
struct PresetParam {
  ovt_param_info info;  // value_default: of the preset
  bool has_effect;      // the preset reads it
};
std::vector<PresetParam> describe_preset(const std::string& preset);
// The same as text with units and limits, one per line.
std::string list_params(const std::string& preset);

}  // namespace overtake::cli
