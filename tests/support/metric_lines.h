// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// Objects and tracks on a line, in the input format of the metrics: {{id, x}, ...}.
#pragma once

#include <cstdint>
#include <utility>
#include <vector>

#include "tools/evaluation/metrics/clear_mot.h"

namespace overtake::test {

using Line = std::vector<std::pair<uint64_t, double>>;

inline std::vector<overtake::metrics::MotPlace> places(const Line& line) {
  std::vector<overtake::metrics::MotPlace> out;
  for (const auto& [id, x] : line) out.push_back({id, x, 0.0});
  return out;
}

}  // namespace overtake::test
