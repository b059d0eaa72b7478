// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
#include "tools/evaluation/metrics/summary.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "tools/evaluation/metrics/random.h"

namespace overtake::metrics {
namespace {

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

// Inverse of the normal distribution by bisection of erfc: slow and exact.
double normal_quantile(double p) {
  double low = -40, high = 40;
  for (int i = 0; i < 200; ++i) {
    const double mid = 0.5 * (low + high);
    (0.5 * std::erfc(-mid / std::sqrt(2.0)) < p ? low : high) = mid;
  }
  return 0.5 * (low + high);
}

}  // namespace

double percentile(const std::vector<double>& sorted, double p) {
  if (sorted.empty()) return kNan;
  const double rank = std::clamp(p, 0.0, 1.0) * double(sorted.size() - 1);
  const std::size_t below = std::size_t(rank), above = std::min(below + 1, sorted.size() - 1);
  return sorted[below] + (rank - double(below)) * (sorted[above] - sorted[below]);
}

Summary summarize(std::vector<double> values) {
  Summary s;
  const auto bad = std::remove_if(values.begin(), values.end(), [](double v) { return !std::isfinite(v); });
  s.left_out = values.end() - bad;
  values.erase(bad, values.end());
  std::sort(values.begin(), values.end());
  s.count = int64_t(values.size());
  double sum = 0, squares = 0;
  for (const double v : values) sum += v;
  s.mean = values.empty() ? kNan : sum / double(values.size());
  for (const double v : values) squares += (v - s.mean) * (v - s.mean);
  s.deviation = values.empty() ? kNan : values.size() == 1 ? 0 : std::sqrt(squares / double(values.size() - 1));
  s.p5 = percentile(values, 0.05), s.p25 = percentile(values, 0.25), s.median = percentile(values, 0.5);
  s.p75 = percentile(values, 0.75), s.p95 = percentile(values, 0.95);
  s.least = percentile(values, 0), s.most = percentile(values, 1);
  return s;
}

Share binomial_share(int64_t hits, int64_t trials) {
  Share s{hits, trials, kNan, 0, 1};
  if (trials <= 0) return s;
  constexpr double kZ = 1.959963984540054;
  const double n = double(trials), p = double(hits) / n, z2 = kZ * kZ;
  const double middle = (p + z2 / (2 * n)) / (1 + z2 / n);
  const double half = kZ / (1 + z2 / n) * std::sqrt(p * (1 - p) / n + z2 / (4 * n * n));
  s.value = p;
  s.low = hits == 0 ? 0 : std::max(0.0, middle - half);
  s.high = hits == trials ? 1 : std::min(1.0, middle + half);
  return s;
}

Share grouped_share(const std::vector<Group>& groups, int32_t draws) {
  std::vector<Group> used;
  Group all;
  for (const Group& g : groups)
    if (g.trials > 0) used.push_back(g), all.hits += g.hits, all.trials += g.trials;
  Share s = binomial_share(all.hits, all.trials);
  if (used.size() < 2) return s;
  std::vector<double> shares;
  uint64_t state = 1;
  for (int32_t d = 0; d < draws; ++d) {
    Group sum;
    for (std::size_t k = 0; k < used.size(); ++k) {
      const Group& g = used[std::size_t(next_random(state) % used.size())];
      sum.hits += g.hits, sum.trials += g.trials;
    }
    shares.push_back(double(sum.hits) / double(sum.trials));
  }
  std::sort(shares.begin(), shares.end());
  s.low = percentile(shares, 0.025), s.high = percentile(shares, 0.975);
  return s;
}

double chi_square_quantile(double p, double degrees) {
  const double a = 2.0 / (9.0 * degrees);
  const double root = 1 - a + normal_quantile(p) * std::sqrt(a);
  return degrees * root * root * root;
}

}  // namespace overtake::metrics
