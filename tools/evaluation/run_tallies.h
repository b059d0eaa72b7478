// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// Figures of each variant on each scenario, and of each variant on all of them.
#pragma once

#include <map>
#include <string>
#include <utility>
#include <vector>

#include "tools/evaluation/figures.h"

namespace overtake::evaluation {

// Tally: add(run) reads a run, finish() returns figures with the members `variant` and `scenario`. The figures of a
// variant with several scenarios end with those of the scenario "all".
template <class Tally>
auto tally_runs(const std::vector<Run>& runs) {
  std::map<std::string, std::map<std::string, Tally>> tallies;
  std::map<std::string, Tally> whole;
  for (const Run& run : runs) {
    tallies[run.variant][scenario_of(run)].add(run);
    whole[run.variant].add(run);
  }
  std::vector<decltype(std::declval<const Tally&>().finish())> out;
  const auto put = [&](const Tally& tally, const std::string& variant, const std::string& scenario) {
    out.push_back(tally.finish());
    out.back().variant = variant, out.back().scenario = scenario;
  };
  for (const auto& [variant, scenarios] : tallies) {
    for (const auto& [scenario, tally] : scenarios) put(tally, variant, scenario);
    if (scenarios.size() > 1) put(whole[variant], variant, "all");
  }
  return out;
}

}  // namespace overtake::evaluation
