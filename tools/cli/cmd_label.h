// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// overtake label: ground and obstacles of a recording's points without a human, by the paper's automatic labelling.
#pragma once

#include <CLI/App.hpp>

namespace overtake::cli {

CLI::App& add_label_command(CLI::App& app);

}  // namespace overtake::cli
