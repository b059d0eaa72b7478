// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// The main function of a benchmark with options of its own.
#pragma once

#include <CLI/CLI.hpp>

namespace overtake::bench {

// Reads --preset, --isa, --json and the options that `add` adds, then runs. Returns the exit code.
template <class Options>
int run_program(int argc, char** argv, const char* about, void (*add)(CLI::App& app, Options& options),
                int (*run)(const Options& options)) {
  Options options;
  CLI::App app(about);
  app.add_option("--preset", options.preset, "paper or best (default)");
  app.add_option("--isa", options.isa, "default: the best");
  add(app, options);
  app.add_flag("--json", options.json);
  CLI11_PARSE(app, argc, argv);
  return run(options);
}

}  // namespace overtake::bench
