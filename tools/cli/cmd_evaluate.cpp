// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
#include "tools/cli/cmd_evaluate.h"

#include <CLI/Config.hpp>
#include <CLI/Formatter.hpp>
#include <cstdio>
#include <memory>
#include <nlohmann/json.hpp>

#include "tools/cli/commands.h"
#include "tools/client/console.h"
#include "tools/evaluation/contestant.h"
#include "tools/evaluation/recorded.h"
#include "tools/evaluation/report.h"
#include "tools/evaluation/run_logs.h"
#include "tools/evaluation/scaling.h"
#include "tools/evaluation/tune.h"
#include "tools/io/output.h"
#include "tools/io/text.h"

namespace overtake::cli {

namespace {

struct EvaluateOptions : evaluation::RunOptions {
  std::string recordings;
  bool tune = false, scaling = false, all_variants = false, check = false, force = false;
};

// Said before hours of work.
void check_report(io::OutputGuard& guard, const std::string& out) {
  for (const char* name : {"metrics.json", "times.json", "report.html", "errors.csv", "detection_by_distance.csv"})
    guard.check(out + "/" + name);
}

void evaluate(EvaluateOptions& options) {
  if (options.logs.empty() && options.recordings.empty() && !options.check)
    throw CLI::RequiredError("LOG or --recordings");
  const std::string preset = options.presets.empty() ? "paper" : options.presets[0];
  if (options.all_variants)
    for (const std::string& variant : evaluation::variant_names()) options.presets.push_back(preset + ":" + variant);
  if (options.check) {
    evaluation::contestant_names(options);
    return;
  }
  if (options.presets.empty() && !options.logs.empty() && !options.tune) throw CLI::RequiredError("--preset");
  io::OutputGuard guard(options.force);
  for (const std::string& log : options.logs) guard.add_input(log);
  guard.add_input(options.rig);
  guard.add_input(options.map);
  if (!options.recordings.empty()) guard.add_input_tree(options.recordings);
  guard.add_folder(options.out);
  const bool report = !options.logs.empty() && !options.tune;
  if (!options.recordings.empty()) guard.check(options.out + "/recordings.json");
  if (!options.logs.empty() && options.tune) guard.check(options.out + "/tuning.csv");
  if (report && options.scaling) guard.check(options.out + "/scaling.json");
  if (report) check_report(guard, options.out);
  if (!options.recordings.empty())
    evaluation::judge_recordings(options.recordings, preset, options.out, !options.quiet);
  guard.commit();
  if (options.logs.empty()) return;
  if (options.tune) {
    evaluation::tune_baselines(options.logs, options.every, options.most_frames, options.workers, options.out,
                               !options.quiet);
    return guard.commit();
  }
  if (options.scaling) evaluation::measure_scaling(options.logs[0], preset, options.out, !options.quiet);
  guard.commit();
  if (!evaluation::run_logs(options)) {
    std::fprintf(
        stderr, "overtake: interrupted, no report; runs that are done are kept in %s, the same command goes on there\n",
        options.out.c_str());
    throw CLI::RuntimeError(kInterrupted);
  }
  evaluation::write_report(options.out, !options.quiet);
  guard.commit();
}

}  // namespace

CLI::App& add_evaluate_command(CLI::App& app) {
  auto options = std::make_shared<EvaluateOptions>();
  CLI::App& command = *app.add_subcommand("evaluate", "presets on simulated logs, held against their truth");
  command.add_option("logs", options->logs,
                     "MCAP logs of overtake simulate; with --rig, recordings that hold the odometry of two cars");
  command
      .add_option("--preset", options->presets,
                  "NAME or NAME:VARIANT, several with commas; variants (oracles and controls): " +
                      io::join(evaluation::variant_names(), ", "))
      ->delimiter(',');
  command.add_flag("--variants", options->all_variants, "the first preset with every variant as well");
  command
      .add_option("--out", options->out,
                  "folder for the results; what this build has run into it with the same options is kept")
      ->required();
  command.add_option("--sweep", options->sweep, "group.name=FROM:TO:STEP: the first preset with each of these values");
  command.add_option("--every", options->every, "frames between two of the sweep and of the baselines")
      ->check(CLI::Range(1, 1000))
      ->capture_default_str();
  command.add_option("--frames", options->most_frames, "end each log after so many")->check(CLI::Range(1, 1000000000));
  command.add_option("--workers", options->workers, "runs at once, 0: one per CPU; the numbers are the same")
      ->check(CLI::Range(0, 256));
  command.add_option("--rig", options->rig, "sensors and topics of recordings whose truth is the odometry of two cars");
  command.add_option("--map", options->map,
                     "track map of these recordings: centre line with widths, or an MCAP log that holds one");
  command.add_option("--recordings", options->recordings,
                     "folder of the recorded data sets: judges what is there of them (recordings.json)");
  command.add_flag("--tune", options->tune,
                   "instead: tries parameters of the grid and of the automatic labels (tuning.csv)");
  command.add_flag("--scaling", options->scaling, "also: time against sensors and workers (scaling.json)");
  command.add_flag("--quiet", options->quiet, "print nothing but errors");
  command
      .add_option("--progress", options->progress_s, "a line every so many seconds instead of the bar, quiet or not")
      ->check(CLI::Range(0.0, 36000.0));
  add_force_option(command, options->force);
  command.add_flag("--check", options->check, "only: whether --preset and --sweep can be run; needs no log");
  command.callback([options] { evaluate(*options); });
  return command;
}

CLI::App& add_merge_command(CLI::App& app) {
  auto folders = std::make_shared<std::vector<std::string>>();
  auto out = std::make_shared<std::string>();
  CLI::App& command = *app.add_subcommand("merge", "puts results of overtake evaluate together and reports on all");
  command.add_option("folders", *folders, "results of overtake evaluate")->required();
  command.add_option("--out", *out, "folder for the whole")->required();
  auto force = std::make_shared<bool>(false);
  add_force_option(command, *force);
  command.callback([folders, out, force] {
    io::OutputGuard guard(*force);
    for (const std::string& folder : *folders) guard.add_input_tree(folder + "/runs");
    for (const std::string& folder : *folders)
      for (const char* name : {"scaling.json", "recordings.json", "tuning.csv"}) guard.add_input(folder + "/" + name);
    guard.add_folder(*out);
    check_report(guard, *out);
    evaluation::merge_runs(*folders, *out);
    evaluation::write_report(*out, true);
    guard.commit();
  });
  return command;
}

}  // namespace overtake::cli
