// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// The bootstrap for figures of many methods on the same groups (overtaking events): every method sees the same draws,
// so that the interval of a difference does not contain what both have in common.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

namespace overtake::metrics {

struct Estimate {
  double value, low, high;  // NaN: unknown
};

// A figure that is a ratio of sums over all trials: its part in one group.
struct RatioPart {
  double sum = 0, count = 0;
};

// Draws groups again with replacement (Efron 1979). Seeded, so the same in every run.
class GroupDraws {
 public:
  explicit GroupDraws(std::size_t groups, int32_t draws = 1000);
  // Element 0: the ratio over all groups; after it, the ratio in each draw. NaN where nothing counts.
  std::vector<double> ratios(const std::vector<RatioPart>& parts) const;  // one part for each group

 private:
  std::size_t groups_, draws_;
  std::vector<uint16_t> times_;  // by draw, then by group: how often it was drawn
};

// a - b, element by element: as ratios() gives them.
std::vector<double> subtract(const std::vector<double>& a, const std::vector<double>& b);
// The value, and the 2.5th to 97.5th percentile of the draws; low and high are NaN with fewer than two groups.
Estimate estimate_of(const std::vector<double>& ratios);

}  // namespace overtake::metrics
