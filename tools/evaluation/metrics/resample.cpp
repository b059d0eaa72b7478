// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
#include "tools/evaluation/metrics/resample.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "tools/evaluation/metrics/random.h"
#include "tools/evaluation/metrics/summary.h"

namespace overtake::metrics {

GroupDraws::GroupDraws(std::size_t groups, int32_t draws)
    : groups_(groups), draws_(groups < 2 ? 0 : std::size_t(draws)), times_(groups_ * draws_) {
  uint64_t state = 1;
  for (std::size_t d = 0; d < draws_; ++d)
    for (std::size_t k = 0; k < groups_; ++k) ++times_[d * groups_ + std::size_t(next_random(state) % groups_)];
}

std::vector<double> GroupDraws::ratios(const std::vector<RatioPart>& parts) const {
  const auto ratio = [&](auto&& times) {
    RatioPart all;
    for (std::size_t g = 0; g < groups_; ++g)
      all.sum += times(g) * parts[g].sum, all.count += times(g) * parts[g].count;
    return all.count > 0 ? all.sum / all.count : std::numeric_limits<double>::quiet_NaN();
  };
  std::vector<double> out = {ratio([](std::size_t) { return 1.0; })};
  for (std::size_t d = 0; d < draws_; ++d)
    out.push_back(ratio([&](std::size_t g) { return double(times_[d * groups_ + g]); }));
  return out;
}

std::vector<double> subtract(const std::vector<double>& a, const std::vector<double>& b) {
  std::vector<double> out(std::min(a.size(), b.size()));
  for (std::size_t i = 0; i < out.size(); ++i) out[i] = a[i] - b[i];
  return out;
}

Estimate estimate_of(const std::vector<double>& ratios) {
  constexpr double kNone = std::numeric_limits<double>::quiet_NaN();
  Estimate out = {ratios.empty() ? kNone : ratios[0], kNone, kNone};
  std::vector<double> drawn;
  for (std::size_t i = 1; i < ratios.size(); ++i)
    if (std::isfinite(ratios[i])) drawn.push_back(ratios[i]);
  std::sort(drawn.begin(), drawn.end());
  if (!drawn.empty() && std::isfinite(out.value))
    out.low = percentile(drawn, 0.025), out.high = percentile(drawn, 0.975);
  return out;
}

}  // namespace overtake::metrics
