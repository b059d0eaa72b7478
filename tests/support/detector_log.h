// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <string>
#include <vector>

#include "tests/support/detector_bench.h"

namespace overtake::test {

// The lines that a detector logs, of a bench whose def has no other user.
struct Log {
  std::vector<std::string> lines;
  bool holds(const std::string& text) const {
    return std::any_of(lines.begin(), lines.end(),
                       [&](const std::string& line) { return line.find(text) != std::string::npos; });
  }
};
inline void keep_log(DetectorBench& bench, Log& log) {
  bench.def.user = &log;
  bench.def.log = [](ovt_log_level, const char* text, void* user) { static_cast<Log*>(user)->lines.push_back(text); };
}

}  // namespace overtake::test
