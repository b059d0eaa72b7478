// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <vector>

#include "tools/cli/command.h"
#include "tools/cli/program_help.h"

namespace overtake::cli {

inline constexpr ExitCode kExitCodes[] = {
    {0, "done"},
    {1, "an error; the message names the place and the reason"},
    {2, "a wrong command line: an unknown command or option, a missing or impossible value"},
    {3,
     "the recording is damaged (what came before the damage is done), the map or the ego poses do not fit it, or "
     "doctor "
     "found something wrong"},
    {130, "ended by Ctrl-C or SIGTERM (the results so far are kept)"}};

// All commands of commands.def with their options, as CLI11 parses them.
class CommandTree {
 public:
  CommandTree();
  ~CommandTree();
  CommandTree(const CommandTree&) = delete;
  CommandTree& operator=(const CommandTree&) = delete;

  CLI::App& app() { return *app_; }
  const CLI::App& app() const { return *app_; }
  const std::vector<Command>& commands() const { return commands_; }
  std::vector<const CLI::App*> listed() const;  // in --help
  void set_json(bool json) { json_ = json; }    // of --version

 private:
  std::vector<Command> commands_;
  std::unique_ptr<CLI::App> app_;
  bool json_ = false;
};

// Parses the command line, runs the command and returns the exit code. Prints one sentence to standard error if the
// command line is wrong. Passes on the command's exceptions.
int run_command_line(int argc, const char* const* argv);

}  // namespace overtake::cli
