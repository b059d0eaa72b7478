// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// Options that several commands share.
#pragma once

#include <CLI/App.hpp>
#include <CLI/Config.hpp>
#include <CLI/Formatter.hpp>
#include <string>

#include "tools/client/config.h"

namespace overtake::cli {

// Preset, parameters, configuration, capacities.
void add_parameter_options(CLI::App& command, Options& options);
// The same, and the folder for the results.
void add_common_options(CLI::App& command, Options& options);
// The command uses no map if `map` is empty or "none". Texts for help: the map without --map, and its use.
void add_map_option(CLI::App& command, std::string& map, const std::string& map_default, const std::string& use = "");
// The rig, its mounting, the instruction set. Text for help: the rig without --rig.
void add_rig_options(CLI::App& command, Options& options, const std::string& rig_default);
// The recording and its rig.
void add_detector_options(CLI::App& command, Options& options);
// --force, for each command that writes files (tools/io/output.h).
void add_force_option(CLI::App& command, bool& force);
void add_quiet_option(CLI::App& command, bool& quiet);
void add_progress_option(CLI::App& command, double& interval_s);
void add_json_option(CLI::App& command, bool& json);
// A number within the limits; CLI::Range takes NaN as such a one, too.
CLI::Validator in_range(double low, double high);
// For an option of type uint64_t: CLI11 reads -1 as 2^64 - 1, and anything larger as well.
CLI::Validator whole_number();

}  // namespace overtake::cli
