// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

namespace overtake::cli {

// `overtake ...`: parses, runs the command, returns the exit code. A wrong command line is one sentence on standard
// error. Throws what the command throws.
int run_command_line(int argc, const char* const* argv);

}  // namespace overtake::cli
