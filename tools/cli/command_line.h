// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

namespace overtake::cli {

// Parses the command line, runs the command and returns the exit code. Prints one sentence to standard error if the
// command line is wrong. Passes on the command's exceptions.
int run_command_line(int argc, const char* const* argv);

}  // namespace overtake::cli
