// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// The commands. Each throws io::Error on bad input and returns the process' exit code.
#pragma once

#include "tools/client/config.h"

namespace CLI {
class App;
}

namespace overtake::cli {

int run_command(const Options& options);
int inspect_command(const Options& options);
int track_command(const Options& options);
int info_command(const Options& options);
int doctor_command(const Options& options);

// --force, of each command that writes files (tools/io/output.h).
void add_force_option(CLI::App& command, bool& force);

inline constexpr int kInterrupted = 130;
// The recording ends in damage (results up to there are whole), the ego vehicle is outside of the map in most frames,
// or doctor found something wrong.
inline constexpr int kDamaged = 3;

}  // namespace overtake::cli
