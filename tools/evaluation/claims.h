// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// What the paper says of its method in words, held against the figures; and what costs a preset most, by the oracles.
#pragma once

#include <string>
#include <vector>

#include "tools/evaluation/figures.h"

namespace overtake::evaluation {

struct Number {
  std::string name;
  double value = 0;
  std::string none = "-";  // what it means that there is no value
  bool is_needed = true;   // without it nothing can be said
};

struct Claim {
  std::string name, text;
  std::vector<Number> numbers;
  bool known = false, holds = false;  // known: all that is needed is there
};
// Of a preset's figures, by the variants and sweeps of it among `all` on the same scenario.
std::vector<Claim> check_claims(const Figures& preset, const std::vector<Figures>& all);

// Negative controls: what must not work does not, and by as much as it must not. One that is not known had no case.
std::vector<Claim> check_controls(const Figures& preset, const std::vector<Figures>& all);

struct Cost {
  std::string oracle;   // what was made perfect
  std::string against;  // the contestant it is compared with
  // How much better the oracle is: mean square of GOSPA (and its parts), and others. Negative: worse.
  double gospa_m2 = 0, located_m2 = 0, missed_m2 = 0, false_m2 = 0;
  double hota = 0, detected = 0, false_per_hour = 0, heading_deg = 0;  // heading: mean absolute error of tracks
};
// By size of gospa_m2, the largest first.
std::vector<Cost> find_costs(const Figures& preset, const std::vector<Figures>& all);

// The modes of a distribution: the maxima of its histogram (bins of 0.5, smoothed over 1.5) that reach a tenth of the
// highest and have a valley below 0.8 of the lower of two neighbours between them.
std::vector<double> modes_of(const std::vector<double>& values, double from, double to);

// The contestant of that name on that scenario; null: none.
const Figures* find_figures(const std::vector<Figures>& all, const std::string& contestant,
                            const std::string& scenario);

}  // namespace overtake::evaluation
