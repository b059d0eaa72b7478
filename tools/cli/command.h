// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// A command of `overtake`: the file cmd_NAME.cpp, which defines NAME_command(), and a line in commands.def.
#pragma once

#include <functional>
#include <memory>

namespace CLI {
class App;
}

namespace overtake::cli {

struct Command {
  const char* name;
  const char* help;   // what it does, in one line
  const char* group;  // heading under which `overtake --help` lists it; kHidden: works, but nothing names it
  std::function<void(CLI::App& command)> add_options;
  // Called once, after the command line is parsed. Returns the exit code. Throws io::Error; CLI::ParseError where the
  // options do not fit each other.
  std::function<int()> run;
};
inline constexpr const char* kListed = "Subcommands";
inline constexpr const char* kHidden = "";

// The options of a command are a struct: add_options says how the command line fills it, run reads it.
template <class Options>
Command make_command(const char* name, const char* help, const char* group,
                     void (*add_options)(CLI::App& command, Options& options), int (*run)(const Options& options)) {
  const auto options = std::make_shared<Options>();
  return {name, help, group, [=](CLI::App& command) { add_options(command, *options); }, [=] { return run(*options); }};
}

inline constexpr int kInterrupted = 130;
// The recording ends in damage (results up to there are whole), the ego vehicle is outside of the map in most frames,
// or doctor found something wrong.
inline constexpr int kDamaged = 3;

}  // namespace overtake::cli
