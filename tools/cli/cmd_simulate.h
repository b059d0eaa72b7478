// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <CLI/App.hpp>

namespace overtake::cli {

// `overtake simulate`: drives a scenario of tools/sim and writes what its sensors, localisation and truth say.
// It runs while the arguments are parsed. Throws io::Error.
CLI::App& add_simulate_command(CLI::App& app);

}  // namespace overtake::cli
