// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// The command line: overtake run | inspect | track | info | doctor | scene | simulate | evaluate | merge |
// label | params.
#include <CLI/CLI.hpp>
#include <algorithm>
#include <cstdio>
#include <exception>
#include <new>

#include "tools/cli/cmd_evaluate.h"
#include "tools/cli/cmd_label.h"
#include "tools/cli/cmd_scene.h"
#include "tools/cli/cmd_simulate.h"
#include "tools/cli/commands.h"
#include "tools/cli/report_json.h"
#include "tools/client/console.h"
#include "tools/io/formats.h"
#include "tools/io/memory_limit.h"
#include "tools/io/rig.h"
#include "tools/io/text.h"
#include "tools/io/words.h"

namespace overtake::cli {
namespace {

constexpr int kFailed = 1, kBadUsage = 2;
constexpr const char* kExitCodes =
    "Exit codes: 0 done; 1 an error; 2 a wrong command line; 3 the recording is damaged (what came before it is "
    "done),\n"
    "or doctor found something wrong; 130 ended by Ctrl-C (what is done is kept).";

constexpr const char* kJsonText = "one JSON object instead of text (its keys: tools/README.md)";

std::string version_text() {
  ovt_build_info build;
  ovt_read_build_info(&build);
  return "overtake " + std::string(build.version_text) + "\ncommit   " + build.commit + "\ncompiler " + build.compiler +
         "\nISAs     " + build.isas;
}

// map_default: what is taken without --map.
void add_common(CLI::App& command, Options& options, const std::string& map_default = "none") {
  command.add_option("--preset", options.preset, "parameters to start from (paper)");
  command.add_option("--set", options.set, "key=value: one parameter (overtake params lists them); may be repeated")
      ->expected(1)
      ->take_all();
  command.add_option("--config", options.config,
                     "TOML file: parameters, rig, map, ego (every result has one beside it)");
  command.add_option(
      "--map", options.map,
      "track map: centre line with widths, or two bounds FILE1,FILE2; none: without (default: " + map_default + ")");
  command
      .add_option("--capacity", options.capacity,
                  "NAME=ROWS: how much a table of the detector holds (" + capacity_names() + "); may be repeated")
      ->expected(1)
      ->take_all();
  command.add_option("--out", options.out, "folder for the results, made if needed")->required();
  add_force_option(command, options.force);
  command.add_flag("--quiet", options.quiet, "print nothing but errors");
}

void add_detector(CLI::App& command, Options& options) {
  command.add_option("input", options.input, io::describe_inputs())->required();
  command.add_option("--rig", options.rig,
                     "sensors: a TOML file, or " + io::join(io::builtin_rig_names(), ", ") +
                         " (default: the rig that an MCAP log holds, if any)");
  command.add_option("--urdf", options.urdf,
                     "FILE[,LINK]: mounting of the rig's sensors from a URDF, as seen from LINK (default: its root)");
  command.add_option("--isa", options.isa, "force an instruction set (ref: the scalar reference)");
}

std::vector<std::string> command_names(const CLI::App& app) {
  std::vector<std::string> names;
  for (const CLI::App* command : app.get_subcommands({})) names.push_back(command->get_name());
  return names;
}

// What is wrong with the command line, in one sentence. CLI11 looks for what is missing first; a word that nobody knows
// explains more, since it may be the missing one.
std::string usage_error(const CLI::App& app, const std::vector<std::string>& words, const CLI::ParseError& error) {
  const auto names = command_names(app);
  const std::string help = " (overtake --help)";
  if (words.empty()) return "a command is needed: " + io::join(names, ", ") + help;
  const auto first = std::find_if(words.begin(), words.end(), [](const auto& word) { return !word.starts_with("-"); });
  if (first != words.end() && std::find(names.begin(), names.end(), *first) == names.end())
    return "unknown command '" + *first + "'" + io::did_you_mean(*first, names) + help;
  const auto parsed = app.get_subcommands();
  const CLI::App& command = parsed.empty() ? app : *parsed[0];
  const std::string place = parsed.empty() ? "" : command.get_name() + ": ";
  const std::string its_help = parsed.empty() ? help : " (overtake " + command.get_name() + " --help)";
  std::vector<std::string> options;
  for (const CLI::Option* option : command.get_options())
    for (const std::string& name : option->get_lnames()) options.push_back("--" + name);
  const auto rest = app.remaining(true);
  for (const std::string& word : rest)
    if (word.starts_with("-")) {
      const std::string name = word.substr(0, word.find('='));
      return place + "unknown option '" + name + "'" + io::did_you_mean(name, options) + its_help;
    }
  if (!rest.empty()) return place + "'" + rest[0] + "' is one argument too many" + its_help;
  return place + error.what() + its_help;
}

// Of every command: no file may make its reader take more.
void add_max_memory(CLI::App& app) {
  app.add_option_function<std::string>(
         "--max-memory",
         [](const std::string& text) {
           uint64_t bytes = 0;
           if (!io::parse_size(text, bytes))
             throw CLI::ValidationError("--max-memory", "'" + text + "' is no size of 1M or more (4G, 512M)");
           io::set_memory_limit(bytes);
         },
         "the most that one file may take in memory, as 4G or 512M (default: half of the machine's, " +
             io::format_size(io::memory_limit()) + ")")
      ->type_name("SIZE");
  for (CLI::App* command : app.get_subcommands({})) command->fallthrough();
}

int run_main(int argc, char** argv) {
  CLI::App app("Sees and tracks other cars with LiDAR.", "overtake");
  app.require_subcommand(1);
  app.footer(kExitCodes);
  app.set_version_flag("--version", version_text);
  Options options;

  CLI::App& run = *app.add_subcommand("run", "detects and tracks on a recording");
  add_detector(run, options);
  add_common(run, options, "the map that an MCAP log holds, if any");
  run.add_option("--ego", options.ego,
                 "CSV of ego poses: stamp_ns,x_m,y_m[,z_m][,roll_rad,pitch_rad],yaw_rad,speed_mps[,yaw_rate_rps] "
                 "(default: the recording's own, if any); none: without");
  run.add_option("--mcap", options.mcap,
                 "also writes what the pipeline saw, to open in Foxglove: clouds with labels, "
                 "images, candidates, tracks, map, times, counters");
  run.add_option("--workers", options.workers, "threads; 1: none but the main one (default), 0: one per CPU")
      ->check(CLI::Range(0, 256));
  run.add_option("--trace", options.trace,
                 "FILE: every stage of every frame on its thread, as Chrome trace JSON (ui.perfetto.dev)");

  run.add_option("--picture-at", options.picture_at,
                 "FRAME: draws that frame from above, with detections, tracks and paths, to frame_FRAME.png")
      ->check(CLI::Range(int64_t(0), INT64_MAX));

  CLI::App& inspect = *app.add_subcommand("inspect", "writes every image of one scan as NPY and PNG");
  add_detector(inspect, options);
  add_common(inspect, options);
  inspect.add_option("--frame", options.frame,
                     "the number in the scan's file name (may be left out where there is one frame)");
  inspect.add_option("--sensor", options.sensor, "sensor of the rig (may be left out where it has one)");

  CLI::App& track = *app.add_subcommand("track", "the tracker alone on detections");
  track
      .add_option("input", options.input,
                  "CSV: stamp_ns,x_m,y_m[,heading_rad][,var_x,var_y[,cov_xy]] in the map frame; rows of one stamp are "
                  "one scan, a row without x and y is an empty scan")
      ->required();
  add_common(track, options);
  track.add_option("--ego", options.ego, "CSV of ego poses");

  CLI::App& info = *app.add_subcommand("info", "says what a recording holds");
  info.add_option("input", options.input, io::describe_inputs())->required();

  info.add_flag("--json", options.json, kJsonText);
  info.footer("Formats, found by a file's first bytes, else by its name:\n" + io::list_formats());

  CLI::App& doctor = *app.add_subcommand("doctor", "says what is wrong with a recording for a rig, and what to do");
  add_detector(doctor, options);
  doctor.add_option("--config", options.config, "TOML file with the rig");
  doctor.add_option("--ego", options.ego, "CSV of ego poses, as for run");
  doctor.add_flag("--json", options.json, kJsonText);
  doctor.add_option("--map", options.map,
                    "map, as for run: whether the poses lie on it (default: the log's own, if any)");

  add_scene_command(app);
  add_simulate_command(app);
  add_evaluate_command(app);
  add_merge_command(app);
  add_label_command(app);
  CLI::App& params = *app.add_subcommand("params", "lists the parameters");
  params.add_flag("--json", options.json, kJsonText);
  add_max_memory(app);

  try {
    app.parse(argc, argv);
  } catch (const CLI::RuntimeError& error) {
    return error.get_exit_code();  // of a command: it has said why
  } catch (const CLI::ParseError& error) {
    if (error.get_exit_code() == 0) return app.exit(error);  // --help, --version
    if (dynamic_cast<const CLI::RuntimeError*>(&error)) return error.get_exit_code();
    std::fprintf(stderr, "overtake: %s\n", usage_error(app, {argv + 1, argv + argc}, error).c_str());
    return kBadUsage;
  }
  if (params.parsed()) {
    std::fputs((options.json ? params_json() : list_params()).c_str(), stdout);
    return 0;
  }
  if (run.parsed()) return options.command = "run", run_command(options);
  if (inspect.parsed()) return options.command = "inspect", inspect_command(options);
  if (info.parsed()) return options.command = "info", info_command(options);
  if (doctor.parsed()) return options.command = "doctor", doctor_command(options);
  if (track.parsed()) return options.command = "track", track_command(options);
  return 0;  // scene, simulate, evaluate, merge and label have done their work while they were parsed
}

}  // namespace
}  // namespace overtake::cli

int main(int argc, char** argv) {
  try {
    return overtake::cli::run_main(argc, argv);
  } catch (const std::bad_alloc&) {
    std::fprintf(stderr, "overtake: the memory is used up; --max-memory says how much a file may take (now %s)\n",
                 overtake::io::format_size(overtake::io::memory_limit()).c_str());
  } catch (const std::exception& error) {
    std::fprintf(stderr, "overtake: %s\n", overtake::cli::printable(error.what()).c_str());
  } catch (...) {
    std::fprintf(stderr, "overtake: an unknown error\n");
  }
  return overtake::cli::kFailed;
}
