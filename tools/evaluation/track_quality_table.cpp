// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// The figures of tracks as tables of text, one column for each preset and one for the goal.
#include <algorithm>
#include <cstdio>
#include <functional>

#include "tools/client/console.h"
#include "tools/evaluation/track_quality.h"
#include "tools/evaluation/variant.h"
#include "tools/io/angles.h"
#include "tools/io/text.h"

namespace overtake::evaluation {
namespace {

using Columns = std::vector<TrackQuality>;
using Cell = std::function<std::string(const TrackQuality&)>;

Rows header_of(const Columns& columns) {
  Rows rows(1, {columns.empty() ? "" : "scenario: " + columns[0].scenario});
  for (const TrackQuality& q : columns) rows[0].push_back(q.variant);
  rows[0].push_back("goal");
  return rows;
}

// Adds a row unless no column has a value.
void add_figure(Rows& rows, const std::string& label, const Columns& columns, const std::string& goal,
                const Cell& cell) {
  std::vector<std::string> row = {label};
  for (const TrackQuality& q : columns) row.push_back(cell(q));
  const bool known = std::any_of(row.begin() + 1, row.end(), [](const std::string& text) { return text != "-"; });
  row.push_back(goal);
  if (known) rows.push_back(std::move(row));
}

// "rms (deviation, bias, 95 % of the size)": a goal stands for the rms, because a bias is as bad as a deviation.
std::string rms_text(const Spread& s, double scale, int32_t digits) {
  if (s.error.count == 0) return "-";
  return cli::fixed(scale * s.rms, digits) + " (" + cli::fixed(scale * s.error.deviation, digits) + ", " +
         cli::fixed(scale * s.error.mean, digits) + ", " + cli::fixed(scale * s.size_p95, digits) + ")";
}

// "95 % of the size (bias, deviation)"
std::string size_text(const Spread& s) {
  if (s.error.count == 0) return "-";
  return cli::fixed(s.size_p95, 2) + " (" + cli::fixed(s.error.mean, 2) + ", " + cli::fixed(s.error.deviation, 2) + ")";
}

std::string kept_text(const metrics::Group& g) {
  if (g.trials == 0) return "-";
  return cli::fixed(100.0 * double(g.hits) / double(g.trials), 1) + " % (" + std::to_string(g.hits) + " of " +
         std::to_string(g.trials) + ")";
}

std::string found_text(const FoundAfter& f) {
  if (f.presences == 0) return "-";
  if (f.never == f.presences) return "never (" + std::to_string(f.presences) + ")";
  return cli::fixed(f.median_s, 2) + ", " + cli::fixed(f.p99_s, 2) + " (" + std::to_string(f.presences) +
         ", never: " + std::to_string(f.never) +
         (f.already_found > 0 ? ", had one: " + std::to_string(f.already_found) : "") + ")";
}

std::string approach_text(const ConfirmedAt& a) {
  if (a.approaches == 0) return "-";
  if (a.never == a.approaches) return "never (" + std::to_string(a.approaches) + ")";
  return cli::fixed(a.median_m, 0) + ", " + cli::fixed(a.least_m, 0) + " (" + std::to_string(a.approaches) +
         ", never: " + std::to_string(a.never) + ")";
}

std::string number_text(double value) {
  std::string text;
  io::append_number(text, value);
  return text;
}

}  // namespace

Rows track_rows(const Columns& columns) {
  Rows rows = header_of(columns);
  static constexpr const char *kAlongGoals[] = {"0.08", "0.15", "0.30"}, *kAcrossGoals[] = {"0.06", "0.12", "0.25"};
  for (const bool is_along : {true, false})
    for (std::size_t k = 0; k + 1 < kRangesM.size(); ++k)
      add_figure(rows,
                 std::string("position ") + (is_along ? "along" : "across") + " m, " + cli::fixed(kRangesM[k], 0) +
                     " to " + cli::fixed(kRangesM[k + 1], 0) + " m: rms (deviation, bias, 95 %)",
                 columns, is_along ? kAlongGoals[k] : kAcrossGoals[k],
                 [&](const TrackQuality& q) { return rms_text(is_along ? q.along_m[k] : q.across_m[k], 1, 2); });
  add_figure(rows, "speed m/s: rms (deviation, bias, 95 %)", columns, "-",
             [](const TrackQuality& q) { return rms_text(q.speed_mps, 1, 2); });
  add_figure(rows, "speed m/s, cruising (at most " + number_text(kCruiseMps2) + " m/s2)", columns, "0.3",
             [](const TrackQuality& q) { return rms_text(q.speed_cruising_mps, 1, 2); });
  add_figure(rows, "speed m/s, braking (more than " + number_text(kHardMps2) + " m/s2)", columns, "0.8",
             [](const TrackQuality& q) { return rms_text(q.speed_braking_mps, 1, 2); });
  add_figure(rows, "course of a moving car deg: rms (deviation, bias, 95 %)", columns, "0.4",
             [](const TrackQuality& q) { return rms_text(q.course_rad, io::deg(1), 2); });
  add_figure(rows, "heading of a spinning car deg: rms (deviation, bias, 95 %)", columns, "6",
             [](const TrackQuality& q) { return rms_text(q.spin_heading_rad, io::deg(1), 1); });
  add_figure(rows, "axis of a spinning car deg (heading modulo 180 deg)", columns, "-",
             [](const TrackQuality& q) { return rms_text(q.spin_axis_rad, io::deg(1), 1); });
  add_figure(rows, "whole overtakes with one id", columns, "-",
             [](const TrackQuality& q) { return kept_text(q.overtakes); });
  add_figure(rows, "id the same after " + number_text(kGapS) + " s and longer without a confirmed track", columns, "-",
             [](const TrackQuality& q) { return kept_text(q.losses); });
  add_figure(rows, "id kept while undetectable for " + number_text(kGapS) + " s and longer", columns, "99 %",
             [](const TrackQuality& q) { return kept_text(q.gaps); });
  add_figure(rows, "confirmed after first detectable s: median, 99 % (cars)", columns, "0.15, 0.35",
             [](const TrackQuality& q) { return found_text(q.confirmed); });
  add_figure(rows, "from ahead, confirmed at m: median, least (cars)", columns, "110 or more",
             [](const TrackQuality& q) { return approach_text(q.from_ahead); });
  add_figure(rows, "from behind, confirmed at m: median, least (cars)", columns, "-",
             [](const TrackQuality& q) { return approach_text(q.from_behind); });
  add_figure(rows, "existence: expected calibration error, Brier score", columns, "-", [](const TrackQuality& q) {
    return q.existence.count() == 0
               ? "-"
               : cli::fixed(q.existence.expected_error(), 3) + ", " + cli::fixed(q.existence.brier(), 4);
  });
  add_figure(rows, "delay at 0.1 false tracks an hour s: median, 99 % (cars)", columns, "-",
             [](const TrackQuality& q) -> std::string {
               if (q.thresholds.empty()) return "-";
               const Threshold* const least = q.least_threshold();
               return least ? found_text(least->delay) : "more false tracks at every existence";
             });
  add_figure(rows, "existence of that delay; hours of logs", columns, "-", [](const TrackQuality& q) -> std::string {
    const Threshold* const least = q.least_threshold();
    return least ? number_text(least->existence) + "; " + cli::fixed(q.hours, 3) : "-";
  });
  return rows;
}

Rows path_rows(const Columns& columns) {
  static constexpr const char* kWords[kManoeuvres] = {"all", "cruising", "braking or accelerating", "lane change"};
  static constexpr const char* kGoals[kHorizons][2] = {{"-", "-"}, {"0.6", "0.3"}, {"1.5", "0.6"}, {"-", "-"}};
  Rows rows = header_of(columns);
  for (std::size_t m = 0; m < kManoeuvres; ++m)
    for (std::size_t h = 0; h < kHorizons; ++h) {
      const std::string label = std::string(kWords[m]) + ", " + number_text(kHorizonsS[h]) + " s";
      const bool has_goal = m == std::size_t(Manoeuvre::kCruising);
      add_figure(rows, label + ": along m, 95 % (bias, deviation)", columns, has_goal ? kGoals[h][0] : "-",
                 [&](const TrackQuality& q) { return size_text(q.paths[h][m].along_m); });
      add_figure(rows, label + ": across m, 95 % (bias, deviation)", columns, has_goal ? kGoals[h][1] : "-",
                 [&](const TrackQuality& q) { return size_text(q.paths[h][m].across_m); });
      add_figure(rows, label + ": inside the 70 %, 95 % ellipse (paths)", columns, "0.70, 0.95",
                 [&](const TrackQuality& q) {
                   const PathFigures& p = q.paths[h][m];
                   if (p.in_70.trials == 0) return std::string("-");
                   return cli::fixed(p.in_70.value, 2) + ", " + cli::fixed(p.in_95.value, 2) + " (" +
                          std::to_string(p.in_70.trials) + ")";
                 });
    }
  return rows;
}

Rows calibration_rows(const Columns& columns) {
  Rows rows = header_of(columns);
  for (std::size_t b = 0; b < 10; ++b)
    add_figure(rows, "existence " + cli::fixed(double(b) / 10, 1) + " to " + cli::fixed(double(b + 1) / 10, 1), columns,
               "the mean", [&](const TrackQuality& q) -> std::string {
                 const auto& bin = q.existence.bins()[b];
                 if (bin.count == 0) return "-";
                 return cli::fixed(bin.share(), 3) + " (mean " + cli::fixed(bin.probability / double(bin.count), 3) +
                        ", " + std::to_string(bin.count) + " tracks)";
               });
  return rows;
}

Rows threshold_rows(const Columns& columns) {
  Rows rows = header_of(columns);
  std::size_t most = 0;
  double existence = 0;
  for (const TrackQuality& q : columns) most = std::max(most, q.thresholds.size());
  for (std::size_t k = 0; k < most; ++k) {
    for (const TrackQuality& q : columns)
      if (k < q.thresholds.size()) existence = q.thresholds[k].existence;
    add_figure(rows, "confirmed at existence " + number_text(existence), columns, "-",
               [&](const TrackQuality& q) -> std::string {
                 if (k >= q.thresholds.size()) return "-";
                 const Threshold& t = q.thresholds[k];
                 return cli::fixed(t.false_per_hour, 1) + " (" + std::to_string(t.false_tracks) + "); " +
                        found_text(t.delay);
               });
  }
  return rows;
}

Columns track_quality_of(const Columns& all, const std::string& scenario) {
  Columns out;
  for (const TrackQuality& q : all)
    if (q.scenario == scenario && !is_of_sweep(q.variant)) out.push_back(q);
  return out;
}

void print_track_quality(const Columns& all, const std::string& scenario) {
  const Columns columns = track_quality_of(all, scenario);
  for (const Rows& rows : {track_rows(columns), path_rows(columns)}) {
    if (rows.size() < 2) continue;
    cli::TextTable table(rows[0]);
    for (std::size_t r = 1; r < rows.size(); ++r) table.add(rows[r]);
    std::printf("\n%s", table.format().c_str());
  }
}

}  // namespace overtake::evaluation
