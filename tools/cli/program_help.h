// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// The command line as data: commands, arguments, options and their texts, as `--help` prints them. Manual pages and
// completions of shells are made from it, so that they cannot differ from the help.
#pragma once

#include <string>
#include <vector>

namespace overtake::cli {

struct OptionHelp {
  std::string names;               // "--rig", "-h,--help", or that of an argument: "input"
  std::string value, text;         // "INT:INT in [0 - 256]", "" for a flag; what it does
  std::string default_text;        // "" if none is shown
  std::vector<std::string> words;  // values that are known, for completion: "av21", or "tracker.q_x=" before a value
  bool takes_files = false;        // its value may be a file or folder
  bool required = false, several = false;
};

struct CommandHelp {
  std::string name, text, footer;
  std::vector<OptionHelp> arguments, options;
};

struct ExitCode {
  int code;
  const char* meaning;
};

struct ProgramHelp {
  std::string version, text;
  std::vector<OptionHelp> options;
  std::vector<CommandHelp> commands;  // those that --help lists
  std::vector<ExitCode> exit_codes;
};

ProgramHelp describe_program();

// A manual page in roff: of a command, or of the program if `command` is empty. Throws io::Error: no such command.
std::string manual_page(const ProgramHelp& program, const std::string& command);
std::string bash_completion(const ProgramHelp& program);
std::string zsh_completion(const ProgramHelp& program);

}  // namespace overtake::cli
