// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// Scans in pieces: a part of a scan's points, random cuts.
#pragma once

#include <algorithm>
#include <cstdint>
#include <random>
#include <vector>

#include "tools/client/pieces.h"

namespace overtake::test {

using cli::piece_of;

struct Range {
  int32_t first, last;
};

// Cuts [0, count) at random places: into single points, packets, lines, or a few large parts.
template <class Random>
std::vector<Range> cut_randomly(int32_t count, Random& random) {
  static constexpr int32_t kMost[] = {1, 3, 17, 100, 900, 10000};
  const int32_t most = count > 2000 ? kMost[2 + random() % 4] : kMost[random() % 6];
  std::vector<Range> ranges;
  for (int32_t first = 0; first < count;) {
    const int32_t last = std::min(count, first + 1 + int32_t(random() % uint32_t(most)));
    ranges.push_back({first, last});
    first = last;
  }
  return ranges;
}

}  // namespace overtake::test
