// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// A command of `overtake`. To add one, write cmd_NAME.cpp, which defines NAME_command(), and a line in commands.def.
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
  const char* group;  // heading in `overtake --help`; kHidden: works, but help does not list it
  std::function<void(CLI::App& command)> add_options;
  // Called once, after parsing the command line. Returns the exit code. Throws io::Error; CLI::ParseError if options
  // contradict each other.
  std::function<int()> run;
};
inline constexpr const char* kListed = "Subcommands";
inline constexpr const char* kHidden = "";

// A command's options are a struct: add_options binds it to the command line, run reads it.
template <class Options>
Command make_command(const char* name, const char* help, const char* group,
                     void (*add_options)(CLI::App& command, Options& options), int (*run)(const Options& options)) {
  const auto options = std::make_shared<Options>();
  return {name, help, group, [=](CLI::App& command) { add_options(command, *options); }, [=] { return run(*options); }};
}

inline constexpr int kInterrupted = 130;
// The recording is damaged (the results before the damage are complete), its map or ego poses do not fit it (the ego
// vehicle is outside of the map in most frames, or less than half of the frames have a pose), or doctor found a fault.
inline constexpr int kDamaged = 3;

}  // namespace overtake::cli
