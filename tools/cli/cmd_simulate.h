// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <string>

namespace overtake::cli {

struct SimulateOptions {
  std::string scenario, out, ego, pattern, pictures;
  double seconds = 0, picture_at = -1, progress_s = -1;
  uint64_t seed = 1;
  int32_t workers = 0;
  bool quiet = false, force = false;
};

// Runs `overtake simulate` and returns the exit code. Throws io::Error; CLI::ParseError if no option names an output.
int simulate(const SimulateOptions& options);

}  // namespace overtake::cli
