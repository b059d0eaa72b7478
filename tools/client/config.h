// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// What a command runs with: defaults of the preset, then the --config file, then the command line. The same text form
// is read and written, so the config.toml beside a result can be given to --config.
//
//   preset = "paper"   map = "FILE"   ego = "FILE"   workers = 1   isa = "ref"      (all optional)
//   rig = "NAME or FILE", or the table [rig] with its [[rig.sensor]] (see tools/io/rig.h)
//   [capacities]   clusters = 1024      (rows of the detector's tables, before the rig's: tools/io/rig.h)
//   [tracker]   confirm_hits = 3      (any parameter "group.name"; overtake params lists them)
//
// An MCAP log that holds a rig (attachment rig.toml) or a map (map.csv) is read by them where none are given; its ego
// poses likewise, and so are rig.toml, map.csv and ego.csv of a folder that overtake simulate wrote. map = "none",
// ego = "none": without all the same. Relative paths in a file start at its folder; those written are absolute, so that
// the file means the same wherever it is used.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "pipeline/overtake.h"
#include "tools/io/output.h"
#include "tools/io/rig.h"

namespace overtake::cli {

// As given on the command line; empty or negative where not given.
struct Options {
  std::string command, input, out;
  std::string rig, urdf, preset, map, ego, config, isa;
  std::vector<std::string> set, capacity;  // key=value
  int32_t workers = -1;
  bool quiet = false, force = false;
};

struct Config {
  std::string command, input, preset = "paper", map, ego, isa;
  int32_t workers = 1;
  ovt_params params;
  bool keep_images = true;  // false: nobody reads them (ovt_detector_def.keep_images)
  bool has_rig = false;
  bool own_rig = false, own_map = false, own_ego = false;  // out of the input itself: an MCAP log, a folder of simulate
  bool no_ego = false;                                     // --ego none: not even the recording's own poses
  io::Rig rig;
  io::Capacities capacities;  // what is not given here the rig gives, else the library's default holds
};

// Throws io::Error. A rig's period becomes frame.period_s unless that is set.
Config load_config(const Options& options);
// The same for a command that reads scans: throws as well where there is no rig.
Config load_config_with_rig(const Options& options);
std::string format_config(const Config& config);
// Tells the guard what the command reads.
void add_inputs(io::OutputGuard& guard, const Options& options, const Config& config);

// The capacities a detector is made with: the config's, the rig's, the library's default.
io::Capacities effective_capacities(const Config& config);
// For --capacity: "points, clusters, ...".
std::string capacity_names();

// The parameters with units, defaults and limits, a line each.
std::string list_params();

}  // namespace overtake::cli
