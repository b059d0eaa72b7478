// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// overtake merge: combines results of overtake evaluate.
#include <sstream>

#include "tools/cli/command.h"
#include "tools/cli/command_options.h"
#include "tools/evaluation/report.h"
#include "tools/evaluation/run_logs.h"
#include "tools/io/output.h"
#include "tools/io/text.h"

namespace overtake::cli {
namespace {

struct MergeOptions {
  std::vector<std::string> folders;
  std::string list, out;
  bool force = false;
};

void add_merge_options(CLI::App& command, MergeOptions& options) {
  command.add_option("folders", options.folders, "results of overtake evaluate");
  command.add_option("--list", options.list, "file with more of them, one a line: for more than a command line holds");
  command.add_option("--out", options.out, "folder for the combined results")->required();
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
  if (options.folders.empty()) throw CLI::RequiredError("folders or --list");
  for (const std::string& folder : options.folders) guard.add_input_tree(folder + "/runs");
  for (const std::string& folder : options.folders)
    for (const char* name : {"scaling.json", "recordings.json", "tuning.csv"}) guard.add_input(folder + "/" + name);
  guard.add_folder(options.out);
  evaluation::check_report(guard, options.out);
  evaluation::merge_runs(options.folders, options.out);
  evaluation::write_report(options.out, true);
  guard.commit();
  return 0;
}

}  // namespace

Command merge_command() {
  return make_command("merge", "combines results of overtake evaluate and reports on all", kListed, add_merge_options,
                      merge);
}

}  // namespace overtake::cli
