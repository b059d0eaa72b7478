// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// overtake merge: combines results of overtake evaluate.
#include <sstream>

#include "tools/cli/command.h"
#include "tools/cli/command_options.h"
#include "tools/evaluation/report.h"
#include "tools/evaluation/run_logs.h"
#include "tools/io/error.h"
#include "tools/io/output.h"
#include "tools/io/text.h"

namespace overtake::cli {
namespace {

struct MergeOptions {
  std::vector<std::string> folders;
  std::string list, out;
  bool force = false, only_runs = false, only_report = false;
};

void add_merge_options(CLI::App& command, MergeOptions& options) {
  command.add_option("folders", options.folders, "results of overtake evaluate");
  command.add_option("--list", options.list, "file with more of them, one a line: for more than a command line holds");
  command.add_option("--out", options.out, "folder for the combined results")->required();
  command.add_flag("--only-runs", options.only_runs, "combines, without a report");
  command.add_flag("--only-report", options.only_report, "reports on the runs that are in --out");
  add_force_option(command, options.force);
}

int merge(const MergeOptions& given) {
  MergeOptions options = given;
  io::OutputGuard guard(options.force);
  if (!options.list.empty()) {
    guard.add_input(options.list);
    std::istringstream lines(io::read_whole_file(options.list));
    for (std::string line; std::getline(lines, line);)
      if (!line.empty()) options.folders.push_back(line);
  }
  if (options.only_report && (options.only_runs || !options.folders.empty()))
    throw io::Error("--only-report", 0, "reports on the runs in --out: give neither folders nor --only-runs");
  if (options.folders.empty() && !options.only_report) throw CLI::RequiredError("folders or --list");
  for (const std::string& folder : options.folders) guard.add_input_tree(folder + "/runs");
  for (const std::string& folder : options.folders)
    for (const char* name : {"scaling.json", "recordings.json", "tuning.csv"}) guard.add_input(folder + "/" + name);
  guard.add_folder(options.out);
  evaluation::check_report(guard, options.out);
  if (!options.only_report) evaluation::merge_runs(options.folders, options.out);
  if (!options.only_runs) evaluation::write_report(options.out, true);
  guard.commit();
  return 0;
}

}  // namespace

Command merge_command() {
  return make_command("merge", "combines results of overtake evaluate and reports on all", kListed, add_merge_options,
                      merge);
}

}  // namespace overtake::cli
