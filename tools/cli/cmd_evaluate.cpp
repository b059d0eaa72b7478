// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// overtake evaluate: presets on simulated logs against their truth.
#include <algorithm>
#include <cstdio>
#include <nlohmann/json.hpp>

#include "tools/cli/command.h"
#include "tools/cli/command_options.h"
#include "tools/client/console.h"
#include "tools/evaluation/recorded.h"
#include "tools/evaluation/report.h"
#include "tools/evaluation/run_logs.h"
#include "tools/evaluation/scaling.h"
#include "tools/evaluation/tune.h"
#include "tools/evaluation/variant.h"
#include "tools/io/output.h"
#include "tools/io/text.h"

namespace overtake::cli {

namespace {

struct EvaluateOptions : evaluation::RunOptions {
  std::string recordings;
  bool tune = false, scaling = false, all_variants = false, check = false, force = false;
};

// Also with --quiet. Returns the exit code.
int print_damages(const std::vector<std::string>& damages) {
  for (const std::string& damage : damages) std::fprintf(stderr, "overtake: %s\n", printable(damage).c_str());
  return damages.empty() ? 0 : kDamaged;
}

// --tune takes only logs, frames and workers; --recordings beside it takes presets.
void check_tune(const EvaluateOptions& o) {
  const bool no_preset = o.recordings.empty();
  const std::pair<const char*, bool> without_effect[] = {{"--config", no_preset && !o.configs.empty()},
                                                         {"--preset", no_preset && !o.presets.empty()},
                                                         {"--variants", o.all_variants},
                                                         {"--sweep", !o.sweep.empty()},
                                                         {"--compare-every", o.compare_every > 1},
                                                         {"--only-figures", o.only_figures},
                                                         {"--from", o.from_s > 0},
                                                         {"--to", o.to_s >= 0},
                                                         {"--rig", !o.rig.empty()},
                                                         {"--scaling", o.scaling}};
  for (const auto& [name, given] : without_effect)
    if (given) throw CLI::ExcludesError("--tune", name);
}

int evaluate(const EvaluateOptions& given) {
  EvaluateOptions options = given;
  if (options.logs.empty() && options.recordings.empty() && !options.check)
    throw CLI::RequiredError("LOG or --recordings");
  const evaluation::ConfigFiles configs = evaluation::read_configs(options.configs);
  for (const std::string& file : options.configs)
    if (const std::string name = evaluation::config_name(file);
        std::find(options.presets.begin(), options.presets.end(), name) == options.presets.end())
      options.presets.push_back(name);
  const std::string preset = options.presets.empty() ? "paper" : options.presets[0];
  const std::vector<std::string> of_recordings = evaluation::names_for_recordings(options.presets);
  if (options.all_variants)
    for (const std::string& variant : evaluation::variants_of(preset, configs))
      options.presets.push_back(preset + ":" + variant);
  if (options.tune) check_tune(options);
  if (options.check) {
    evaluation::variants_to_run(options);
    return 0;
  }
  if ((options.from_s > 0 || options.to_s >= 0) && !options.only_figures)
    throw CLI::RequiredError("--only-figures (for a piece of a log)");
  if (options.presets.empty() && !options.logs.empty() && !options.tune)
    throw CLI::RequiredError("--preset or --config");
  io::OutputGuard guard(options.force);
  for (const std::string& log : options.logs) guard.add_input(log);
  for (const std::string& file : options.configs) guard.add_input(file);
  guard.add_input(options.rig);
  guard.add_input(options.map);
  if (!options.recordings.empty()) guard.add_input_tree(options.recordings);
  guard.add_folder(options.out);
  const bool report = !options.logs.empty() && !options.tune;
  if (!options.recordings.empty()) guard.check(options.out + "/recordings.json");
  if (!options.logs.empty() && options.tune) guard.check(options.out + "/tuning.csv");
  if (report && options.scaling) guard.check(options.out + "/scaling.json");
  if (report) evaluation::check_report(guard, options.out);
  if (!options.recordings.empty())
    evaluation::evaluate_recordings(options.recordings, of_recordings, configs, options.out, !options.quiet);
  guard.commit();
  if (options.logs.empty()) return 0;
  for (const std::string& log : options.logs)
    if (const std::string partial = io::why_partial(log); !partial.empty())
      std::fprintf(stderr, "overtake: %s: this log is partial: %s\n", printable(log).c_str(),
                   printable(partial).c_str());
  if (options.tune) {
    const std::vector<std::string> damages = evaluation::tune_baselines(
        options.logs, options.every, options.most_frames, options.workers, options.out, !options.quiet);
    guard.commit();
    return print_damages(damages);
  }
  if (options.scaling)
    evaluation::measure_scaling(options.logs[0], evaluation::options_of(preset, configs), options.out, !options.quiet);
  guard.commit();
  std::vector<std::string> damages;
  if (!evaluation::run_logs(options, &damages)) {
    std::fprintf(stderr,
                 "overtake: interrupted, no report; %s keeps the finished runs, and the same command continues\n",
                 options.out.c_str());
    return kInterrupted;
  }
  evaluation::write_report(options.out, !options.quiet);
  guard.commit();
  return print_damages(damages);
}

void add_evaluate_options(CLI::App& command, EvaluateOptions& options) {
  command.add_option("logs", options.logs,
                     "MCAP logs of overtake simulate; with --rig, recordings that hold the odometry of two cars");
  command
      .add_option("--preset", options.presets,
                  "NAME or NAME:VARIANT, several with commas; variants (oracles and controls): " +
                      io::join(evaluation::variant_names(), ", ") +
                      "; conditions: " + io::join(evaluation::condition_names(), ", "))
      ->delimiter(',');
  command
      .add_option("--config", options.configs,
                  "TOML files with parameters (overtake run writes such files), several with commas; each is named by "
                  "its file, and NAME:VARIANT works as with presets")
      ->delimiter(',');
  command.add_flag("--variants", options.all_variants, "the first preset with every variant as well");
  command.add_option("--out", options.out, "folder for the results; keeps runs of this build with the same options")
      ->required();
  command.add_option("--sweep", options.sweep, "group.name=FROM:TO:STEP: the first preset with each of these values");
  command.add_option("--every", options.every, "sweep and baselines use every N-th frame")
      ->check(CLI::Range(1, 1000))
      ->capture_default_str();
  command
      .add_option("--compare-every", options.compare_every,
                  "compare every N-th frame with the truth; the presets still get all frames")
      ->check(CLI::Range(1, 1000))
      ->capture_default_str();
  command.add_flag("--only-figures", options.only_figures,
                   "no baselines, times or pictures, and all presets at the same time: the fastest way to the table");
  command.add_option("--frames", options.most_frames, "end each log after this number of frames")
      ->check(CLI::Range(1, 1000000000));
  CLI::Option* const from =
      command.add_option("--from", options.from_s,
                         "a piece of each log: its frames from this many seconds on; merge joins pieces. Needs "
                         "--only-figures");
  from->check(in_range(0.0, 1e6));
  command.add_option("--to", options.to_s, "until before this many seconds (default: the end)")
      ->check(in_range(0.0, 1e6));
  command
      .add_option("--warm-up", options.warm_up_s, "seconds before --from that the pipeline gets, but nothing compares")
      ->check(in_range(0.0, 1e6))
      ->needs(from)
      ->capture_default_str();
  command.add_option("--workers", options.workers, "parallel runs, 0: one per CPU; the results are the same")
      ->check(CLI::Range(0, 256));
  CLI::Option* const rig = command.add_option(
      "--rig", options.rig, "sensors and topics of recordings whose truth is the odometry of two cars");
  command
      .add_option("--map", options.map,
                  "track map of these recordings: centre line with widths, or an MCAP log that holds one")
      ->needs(rig);
  command.add_option("--recordings", options.recordings,
                     "folder of the recorded data sets: evaluates those that exist (recordings.json)");
  command.add_flag("--tune", options.tune,
                   "instead: tries parameters of the grid and of the automatic labels (tuning.csv)");
  command.add_flag("--scaling", options.scaling, "also: time against sensors and workers (scaling.json)");
  add_quiet_option(command, options.quiet);
  add_progress_option(command, options.progress_s);
  add_force_option(command, options.force);
  command.add_flag("--check", options.check, "only: whether --preset and --sweep can be run; needs no log");
}

}  // namespace

Command evaluate_command() {
  return make_command("evaluate", "compares presets with the truth of simulated logs", kListed, add_evaluate_options,
                      evaluate);
}

}  // namespace overtake::cli
