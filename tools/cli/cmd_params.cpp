// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// overtake params: every parameter with unit, default of a preset, limits, meaning.
#include <cstdio>

#include "tools/cli/command.h"
#include "tools/cli/command_options.h"
#include "tools/cli/report_json.h"

namespace overtake::cli {
namespace {

struct ParamsOptions {
  std::string preset = Config().preset;
  bool json = false;
};

void add_params_options(CLI::App& command, ParamsOptions& options) {
  command.add_option("--preset", options.preset, "whose defaults")->capture_default_str();
  add_json_option(command, options.json);
}

int print_params(const ParamsOptions& options) {
  std::fputs((options.json ? params_json(options.preset) : list_params(options.preset)).c_str(), stdout);
  return 0;
}

}  // namespace

Command params_command() {
  return make_command("params", "lists the parameters", kListed, add_params_options, print_params);
}

}  // namespace overtake::cli
