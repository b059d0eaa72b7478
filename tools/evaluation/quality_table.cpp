// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// The quality figures as tables of text, one column for each preset.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <functional>
#include <set>

#include "tools/client/console.h"
#include "tools/evaluation/evaluator.h"
#include "tools/evaluation/quality.h"
#include "tools/evaluation/variant.h"

namespace overtake::evaluation {
namespace {

// Adds a row unless all of its cells are "-".
void add_row(Rows& rows, const std::string& label, const std::vector<Quality>& columns,
             const std::function<std::string(const Quality&)>& cell) {
  std::vector<std::string> row = {label};
  for (const Quality& q : columns) row.push_back(cell(q));
  if (std::any_of(row.begin() + 1, row.end(), [](const std::string& text) { return text != "-"; }))
    rows.push_back(std::move(row));
}

// The rows of false detections by one property; "0.000" where a variant has none.
void add_parts(Rows& rows, const std::vector<Quality>& columns, std::map<std::string, double> Quality::*part,
               const char* before) {
  std::map<std::string, double> most;
  for (const Quality& q : columns)
    for (const auto& [name, value] : q.*part) most[name] = std::max(most[name], value);
  std::vector<std::string> names;
  for (const auto& [name, value] : most) names.push_back(name);
  std::stable_sort(names.begin(), names.end(), [&](const auto& a, const auto& b) { return most[a] > most[b]; });
  for (const std::string& name : names)
    add_row(rows, before + name, columns, [&](const Quality& q) {
      const auto found = (q.*part).find(name);
      return cli::fixed(found == (q.*part).end() ? 0.0 : found->second, 3);
    });
}

std::string median_and_p95(const metrics::Summary& s) {
  return s.count == 0 ? "-" : cli::fixed(s.median, 3) + " / " + cli::fixed(s.p95, 2);
}

}  // namespace

Rows quality_rows(const std::vector<Quality>& columns) {
  Rows rows(1, {columns.empty() ? "" : "scenario: " + columns[0].scenario});
  for (const Quality& q : columns) rows[0].push_back(q.variant);
  const auto number = [&](const std::string& label, int32_t digits, double Quality::*value) {
    add_row(rows, label, columns, [&](const Quality& q) { return cli::fixed(q.*value, digits); });
  };
  add_row(rows, "frames", columns, [](const Quality& q) { return std::to_string(q.frames); });
  const char* const names[2] = {"3", "5"};
  for (std::size_t k = 0; k < 2; ++k)
    add_row(rows, std::string("detected of ") + names[k] + " points and more (-100 to +150 m)", columns,
            [&](const Quality& q) { return cli::fixed(q.near.detected_share(k), 3); });
  add_row(rows, "  95 % interval by event, 3 points", columns, [](const Quality& q) {
    return q.detected.trials == 0 ? "-" : cli::fixed(q.detected.low, 3) + " .. " + cli::fixed(q.detected.high, 3);
  });
  add_row(rows, "  bound: share with 3 points", columns,
          [](const Quality& q) { return cli::fixed(q.near.bound(0), 3); });
  const auto has_laps = [](const Quality& q) { return q.later_laps.seen[0] > 0; };
  add_row(rows, "  in the first lap", columns,
          [&](const Quality& q) { return has_laps(q) ? cli::fixed(q.first_lap.detected_share(0), 3) : "-"; });
  add_row(rows, "  in later laps", columns,
          [&](const Quality& q) { return has_laps(q) ? cli::fixed(q.later_laps.detected_share(0), 3) : "-"; });
  std::size_t bins = 0;
  for (const Quality& q : columns) bins = std::max(bins, q.by_distance.size());
  for (std::size_t b = 0; b < bins; ++b) {
    const double from = kNearestM + double(b) * kQualityBinM;
    add_row(
        rows,
        "  " + cli::fixed(from, 0) + " to " + cli::fixed(std::min(from + kQualityBinM, kFarthestM), 0) + " m (bound)",
        columns, [&](const Quality& q) {
          if (b >= q.by_distance.size() || q.by_distance[b].all == 0) return std::string("-");
          return cli::fixed(q.by_distance[b].detected_share(0), 3) + " (" + cli::fixed(q.by_distance[b].bound(0), 2) +
                 ")";
        });
  }
  number("false detections a frame (-100 to +150 m)", 3, &Quality::false_detections);
  number("  at any distance", 3, &Quality::false_anywhere);
  add_parts(rows, columns, &Quality::by_surface, "    on ");
  add_parts(rows, columns, &Quality::by_range, "    at ");
  add_parts(rows, columns, &Quality::by_bank, "    banking ");
  number("  in frames without a car", 3, &Quality::false_without_car);
  number("debris of 3 points and more found as debris", 3, &Quality::debris_found);
  number("clusters a car", 3, &Quality::clusters_per_car);
  number("  cars without a cluster", 4, &Quality::without_cluster);
  number("mixed clusters a car-frame", 4, &Quality::mixed_per_car);
  number("ground TPR", 3, &Quality::tpr);
  add_row(rows, "ground PPV (5 %)", columns, [](const Quality& q) {
    return std::isnan(q.ppv) ? "-" : cli::fixed(q.ppv, 3) + " (" + cli::fixed(q.ppv_p5, 2) + ")";
  });
  number("ground F1", 3, &Quality::f1);
  add_row(rows, "centre along the car: median / 95 % m", columns,
          [](const Quality& q) { return median_and_p95(q.along_m); });
  add_row(rows, "centre across the car: median / 95 % m", columns,
          [](const Quality& q) { return median_and_p95(q.across_m); });
  add_row(rows, "ego heading, rms deg: published / corrected", columns, [](const Quality& q) {
    return std::isnan(q.heading_rms_deg[0])
               ? "-"
               : cli::fixed(q.heading_rms_deg[0], 3) + " / " + cli::fixed(q.heading_rms_deg[1], 3);
  });
  add_row(rows, "share in the published 95 % ellipse", columns,
          [](const Quality& q) { return cli::fixed(q.in_ellipse.value, 3); });
  return rows;
}

std::vector<Quality> quality_of(const std::vector<Quality>& all, const std::string& scenario) {
  std::vector<Quality> out;
  for (const Quality& q : all)
    if (q.scenario == scenario && !is_of_sweep(q.variant)) out.push_back(q);
  return out;
}

Rows scenario_rows(const std::vector<Quality>& all) {
  std::set<std::string> variants, scenarios;
  std::map<std::pair<std::string, std::string>, const Quality*> at;
  for (const Quality& q : all) {
    if (is_of_sweep(q.variant)) continue;
    variants.insert(q.variant), at[{q.variant, q.scenario}] = &q;
    if (q.scenario != "all") scenarios.insert(q.scenario);
  }
  Rows rows(1, {"scenario"});
  for (const std::string& variant : variants) rows[0].push_back(variant + ": of 3 points; false a frame");
  for (const std::string& scenario : scenarios) {
    rows.push_back({scenario});
    for (const std::string& variant : variants) {
      const auto found = at.find({variant, scenario});
      rows.back().push_back(found == at.end() ? "-"
                                              : cli::fixed(found->second->near.detected_share(0), 3) + "; " +
                                                    cli::fixed(found->second->false_detections, 3));
    }
  }
  return rows;
}

std::string main_scenario(const std::vector<Quality>& all) {
  for (const Quality& q : all)
    if (q.scenario == "all") return "all";
  return all.empty() ? "" : all[0].scenario;
}

void print_quality(const std::vector<Quality>& all) {
  const auto print = [](const Rows& rows) {
    cli::TextTable table(rows[0]);
    for (std::size_t r = 1; r < rows.size(); ++r) table.add(rows[r]);
    std::printf("\n%s", table.format().c_str());
  };
  const std::string scenario = main_scenario(all);
  const std::vector<Quality> columns = quality_of(all, scenario);
  if (columns.empty()) return;
  if (scenario == "all") print(scenario_rows(all));
  print(quality_rows(columns));
}

}  // namespace overtake::evaluation
