// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// Options that several commands share.
#include <CLI/CLI.hpp>

#include "tools/cli/commands.h"

namespace overtake::cli {

void add_force_option(CLI::App& command, bool& force) {
  command.add_flag("--force", force,
                   "also overwrite files that are no earlier results of Overtake (never what is read); without it "
                   "only results that were not changed since are overwritten");
}

}  // namespace overtake::cli
