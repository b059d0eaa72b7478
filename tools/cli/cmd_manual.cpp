// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// overtake manual: prints a manual page or a shell's completion. The build makes the installed files with it.
#include <cstdio>

#include "tools/cli/command.h"
#include "tools/cli/command_options.h"
#include "tools/cli/program_help.h"

namespace overtake::cli {
namespace {

struct ManualOptions {
  std::string command, completion;
};

void add_manual_options(CLI::App& command, ManualOptions& options) {
  command.add_option("command", options.command, "whose page (default: that of the program)");
  command.add_option("--completion", options.completion, "instead: the completion of a shell")
      ->check(CLI::IsMember({"bash", "zsh"}));
}

int print_manual(const ManualOptions& options) {
  const ProgramHelp program = describe_program();
  const std::string text = options.completion == "bash"  ? bash_completion(program)
                           : options.completion == "zsh" ? zsh_completion(program)
                                                         : manual_page(program, options.command);
  std::fputs(text.c_str(), stdout);
  return 0;
}

}  // namespace

Command manual_command() {
  return make_command("manual", "prints a manual page in roff, or a shell's completion", kHidden, add_manual_options,
                      print_manual);
}

}  // namespace overtake::cli
