// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// The commands. Each throws io::Error on bad input and returns the process' exit code.
#pragma once

#include "tools/config.h"

namespace overtake::cli {

int run_command(const Options& options);
int inspect_command(const Options& options);
int track_command(const Options& options);

inline constexpr int kInterrupted = 130;
inline constexpr int kDamaged = 3;             // the recording ended in damage; results up to there are whole

}  // namespace overtake::cli
