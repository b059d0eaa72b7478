// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
#include "tools/cmd_evaluate.h"

#include <CLI/Config.hpp>
#include <CLI/Formatter.hpp>
#include <memory>

#include "tools/commands.h"
#include "tools/console.h"
#include "tools/evaluation/report.h"
#include "tools/evaluation/run_logs.h"
#include "tools/io/text.h"

namespace overtake::cli {

CLI::App& add_evaluate_command(CLI::App& app) {
  auto options = std::make_shared<evaluation::RunOptions>();
  CLI::App& command = *app.add_subcommand("evaluate", "presets on simulated logs, held against their truth");
  command.add_option("logs", options->logs, "MCAP logs of overtake simulate")->required();
  command
      .add_option("--preset", options->presets,
                  "NAME or NAME:VARIANT, several with commas; variants (oracles and controls): ground, cars, ego, "
                  "shuffled, late_truth")
      ->delimiter(',')
      ->required();
  command.add_option("--out", options->out, "folder for the results; runs that are in it are not done again")
      ->required();
  command.add_option("--sweep", options->sweep, "group.name=FROM:TO:STEP: the first preset with each of these values");
  command.add_option("--every", options->every, "frames between two of the sweep and of the baselines")
      ->check(CLI::Range(1, 1000))
      ->capture_default_str();
  command.add_option("--frames", options->most_frames, "end each log after so many")->check(CLI::Range(1, 1000000000));
  command.add_flag("--quiet", options->quiet, "print nothing but errors");
  command.callback([options] {
    if (!evaluation::run_logs(*options)) throw CLI::RuntimeError(kInterrupted);
    evaluation::write_report(options->out, !options->quiet);
  });
  return command;
}

CLI::App& add_merge_command(CLI::App& app) {
  auto folders = std::make_shared<std::vector<std::string>>();
  auto out = std::make_shared<std::string>();
  CLI::App& command = *app.add_subcommand("merge", "puts results of overtake evaluate together and reports on all");
  command.add_option("folders", *folders, "results of overtake evaluate")->required();
  command.add_option("--out", *out, "folder for the whole")->required();
  command.callback([folders, out] {
    evaluation::merge_runs(*folders, *out);
    evaluation::write_report(*out, true);
  });
  return command;
}

}  // namespace overtake::cli
