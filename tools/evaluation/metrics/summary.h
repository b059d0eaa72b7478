// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// Statistics of a distribution and of a share of trials.
#pragma once

#include <cstdint>
#include <vector>

namespace overtake::metrics {

// Percentiles interpolate linearly between order statistics (rank p (n - 1)). All NaN without a value; values that are
// not finite are left out and counted.
struct Summary {
  int64_t count = 0, left_out = 0;
  double mean = 0, deviation = 0;  // deviation: of the sample (n - 1), 0 for a single value
  double p5 = 0, p25 = 0, median = 0, p75 = 0, p95 = 0, least = 0, most = 0;
};
Summary summarize(std::vector<double> values);
// p in 0..1 of sorted values; NaN without values.
double percentile(const std::vector<double>& sorted, double p);

// A share and its 95 % confidence interval.
struct Share {
  int64_t hits = 0, trials = 0;
  double value = 0, low = 0, high = 1;  // NaN, 0, 1 without trials
};
// Wilson's score interval (1927) with z = 1.96, valid for independent trials.
Share binomial_share(int64_t hits, int64_t trials);

// Hits and trials of one group (an overtaking event), whose trials depend on each other.
struct Group {
  int64_t hits = 0, trials = 0;
};
// Draws the groups again with replacement `draws` times (Efron 1979); 2.5th to 97.5th percentile of the pooled share.
// Seeded, so the same in every run. With a single group it uses Wilson's interval.
Share grouped_share(const std::vector<Group>& groups, int32_t draws = 1000);

// Chi-square quantile by Wilson & Hilferty (1931), within 0.5 % for 2 degrees of freedom and more (tails of 0.025).
double chi_square_quantile(double p, double degrees);

}  // namespace overtake::metrics
