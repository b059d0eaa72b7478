// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// overtake evaluate: presets on simulated logs against their truth. overtake merge: such results put together.
#pragma once

#include <CLI/App.hpp>

namespace overtake::cli {

CLI::App& add_evaluate_command(CLI::App& app);
CLI::App& add_merge_command(CLI::App& app);

}  // namespace overtake::cli
