// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// Compares the paper's statements about its method with the figures, and finds a preset's largest costs, by oracles.
#pragma once

#include <string>
#include <vector>

#include "tools/evaluation/figures.h"

namespace overtake::evaluation {

struct Number {
  std::string name;
  double value = 0;
  std::string none = "-";  // the meaning of a missing value
  bool is_needed = true;   // without it there is no verdict
};

struct Claim {
  std::string name, text;
  std::vector<Number> numbers;
  bool known = false, holds = false;  // known: all needed numbers exist
};
// Claims for a preset's figures; uses its variants and sweeps in `all` on the same scenario.
std::vector<Claim> check_claims(const Figures& preset, const std::vector<Figures>& all);

// Negative controls: changes that must make the results worse do so, by the expected amount. Unknown: no case.
std::vector<Claim> check_controls(const Figures& preset, const std::vector<Figures>& all);

struct Cost {
  std::string oracle;   // the part that was made perfect
  std::string against;  // the variant that it is compared with
  // Improvement by the oracle: mean square of GOSPA (and its parts), and others. Negative: worse.
  double gospa_m2 = 0, located_m2 = 0, missed_m2 = 0, false_m2 = 0;
  double hota = 0, detected = 0, false_per_hour = 0, heading_deg = 0;  // heading: mean absolute error of tracks
};
// By size of gospa_m2, the largest first.
std::vector<Cost> find_costs(const Figures& preset, const std::vector<Figures>& all);

// The modes of a distribution: maxima of its histogram (bins of 0.5, smoothed over 1.5) that reach a tenth of the
// highest maximum. Between two neighbours there must be a valley below 0.8 of the lower one.
std::vector<double> modes_of(const std::vector<double>& values, double from, double to);

// The variant of that name on that scenario; null: none.
const Figures* find_figures(const std::vector<Figures>& all, const std::string& variant, const std::string& scenario);

}  // namespace overtake::evaluation
