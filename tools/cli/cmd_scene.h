// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <CLI/App.hpp>

namespace overtake::cli {

// `overtake scene`: writes the simulated overtake of tools/scene/scene.h as a folder that `overtake run` takes.
// It runs while the arguments are parsed. Throws io::Error.
CLI::App& add_scene_command(CLI::App& app);

}  // namespace overtake::cli
