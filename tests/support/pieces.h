// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// Scans in pieces: a part of a scan's points, random cuts.
#pragma once

#include <algorithm>
#include <cstdint>
#include <random>
#include <vector>

#include "pipeline/overtake.h"

namespace overtake::test {

// Points [first, last) of a scan, with their index.
inline ovt_points piece_of(const ovt_points& scan, int32_t first, int32_t last) {
  ovt_points piece = scan;
  piece.first = first;
  piece.count = last - first;
  for (ovt_column* column : {&piece.x, &piece.y, &piece.z, &piece.layer, &piece.intensity, &piece.time}) {
    if (column->type == OVT_NONE) continue;
    const std::size_t skipped = std::min(std::size_t(first) * column->stride, column->size_bytes);
    column->data = static_cast<const char*>(column->data) + skipped;
    column->size_bytes -= skipped;
  }
  return piece;
}

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
