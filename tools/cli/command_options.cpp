// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
#include "tools/cli/command_options.h"

#include <charconv>

#include "tools/io/formats.h"
#include "tools/io/rig.h"
#include "tools/io/text.h"

namespace overtake::cli {

void add_parameter_options(CLI::App& command, Options& options) {
  command.add_option("--preset", options.preset, "best (default) or paper, the publication");
  command.add_option("--set", options.set, "key=value: one parameter (overtake params lists them); may be repeated")
      ->expected(1)
      ->take_all();
  command.add_option("--config", options.config,
                     "TOML file: parameters, rig, map, ego (every result has one beside it)");
  command
      .add_option("--capacity", options.capacity,
                  "NAME=ROWS: size of a table of the detector (" + capacity_names() + "); may be repeated")
      ->expected(1)
      ->take_all();
}

void add_common_options(CLI::App& command, Options& options) {
  add_parameter_options(command, options);
  command.add_option("--out", options.out, "folder for the results, made if needed")->required();
  add_force_option(command, options.force);
  add_quiet_option(command, options.quiet);
}

void add_map_option(CLI::App& command, std::string& map, const std::string& map_default, const std::string& use) {
  command.add_option("--map", map,
                     "track map: centre line with widths, or two bounds FILE1,FILE2; none: without (default: " +
                         map_default + ")" + use);
}

void add_detector_options(CLI::App& command, Options& options) {
  command.add_option("input", options.input, io::describe_inputs())->required();
  add_rig_options(command, options, "that of a simulated log or folder");
}

void add_rig_options(CLI::App& command, Options& options, const std::string& rig_default) {
  command.add_option(
      "--rig", options.rig,
      "sensors: a TOML file, or " + io::join(io::builtin_rig_names(), ", ") + " (default: " + rig_default + ")");
  command.add_option("--urdf", options.urdf,
                     "FILE[,LINK]: mounting of the rig's sensors from a URDF, relative to LINK (default: its root)");
  command.add_option("--isa", options.isa, "force an instruction set (ref: the scalar reference)");
}

void add_force_option(CLI::App& command, bool& force) {
  command.add_flag("--force", force,
                   "also overwrite files other than unchanged results of Overtake; no option overwrites a file that "
                   "the command reads");
}

void add_quiet_option(CLI::App& command, bool& quiet) { command.add_flag("--quiet", quiet, "print errors only"); }

void add_progress_option(CLI::App& command, double& interval_s) {
  command
      .add_option("--progress", interval_s,
                  "interval in seconds of progress lines instead of the bar, also with --quiet")
      ->check(in_range(0.0, 36000.0));
}

void add_json_option(CLI::App& command, bool& json) {
  command.add_flag("--json", json, "one JSON object instead of text (its keys: tools/README.md)");
}

CLI::Validator in_range(double low, double high) {
  const auto check = [low, high](const std::string& text) {
    double value = 0;
    if (CLI::detail::lexical_cast(text, value) && value >= low && value <= high) return std::string();
    std::string wrong = "Value " + text + " not in range ";
    io::append_number(wrong, low);
    io::append_number(wrong += " to ", high);
    return wrong;
  };
  return CLI::Validator(check, CLI::Range(low, high).get_description());
}

CLI::Validator whole_number() {
  const auto check = [](const std::string& text) {
    uint64_t value = 0;
    const char* end = text.data() + text.size();
    const auto [last, error] = std::from_chars(text.data() + (text.starts_with('+') ? 1 : 0), end, value);
    return error == std::errc() && last == end ? std::string() : "Value " + text + " is not a whole number from 0 on";
  };
  return CLI::Validator(check, "");
}

}  // namespace overtake::cli
