// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// Claims, costs and scenarios as tables.
#include "tools/evaluation/report_html.h"

#include <algorithm>
#include <cmath>
#include <cstdio>

#include "tools/console.h"
#include "tools/evaluation/claims.h"
#include "tools/evaluation/first_seen.h"
#include "tools/evaluation/svg.h"

namespace overtake::evaluation {

namespace {

// "detected 3 m" and so on: names of numbers are words joined by underscores.
std::string numbers_text(const std::vector<Number>& numbers) {
  std::string out;
  for (const Number& n : numbers) {
    char value[32];
    std::snprintf(value, sizeof value, "%.3g", n.value);
    std::string name = n.name;
    std::replace(name.begin(), name.end(), '_', ' ');
    out += (out.empty() ? "" : "; ") + name + " " + (std::isfinite(n.value) ? value : "-");
  }
  return out;
}

std::string claims_html(const char* first, const std::vector<Claim>& claims) {
  std::string html = "<div class=\"wide\"><table class=\"words\"><tr><th>" + std::string(first) +
                     "</th><th>here</th><th>figures (simulated)</th></tr>\n";
  for (const Claim& c : claims)
    html += "<tr><td>" + escape_xml(c.text) + "</td>" +
            (!c.known  ? "<td>not measured</td>"
             : c.holds ? "<td class=\"yes\">holds</td>"
                       : "<td class=\"no\">does not hold</td>") +
            "<td>" + escape_xml(numbers_text(c.numbers)) + "</td></tr>\n";
  return html + "</table></div>\n";
}

// The preset and its variants side by side.
std::string variant_table(const std::vector<Figures>& all, const Figures& f) {
  Rows rows = {{"contestant", "detected", "MOTA", "HOTA", "GOSPA m", "x veh |p95| m", "y veh |p95| m",
                "false det./frame", "false tracks/h"}};
  for (const Figures& g : all) {
    if (g.scenario != f.scenario || g.contestant.find('@') != std::string::npos) continue;
    int64_t hits = 0, trials = 0;
    double wrong = 0;
    for (const DistanceBin& b : g.distance)
      hits += b.detected.hits, trials += b.detected.trials, wrong += b.false_detections;
    const auto size = [&](const char* name) {
      std::vector<double> values;
      if (const auto found = g.track_errors.find(name); found != g.track_errors.end())
        for (const double v : found->second) values.push_back(std::fabs(v));
      return cli::fixed(metrics::summarize(values).p95, 2);
    };
    rows.push_back({g.contestant, cli::fixed(100.0 * double(hits) / double(trials), 1) + " %",
                    cli::fixed(g.tracks.mot.mota(), 3), cli::fixed(g.tracks.hota.hota, 3),
                    cli::fixed(g.tracks.gospa_m.mean, 2), size("x_veh_m"), size("y_veh_m"), cli::fixed(wrong, 2),
                    cli::fixed(g.tracks.false_per_hour, 0)});
  }
  return rows.size() < 3 ? "" : table_html(rows);
}

}  // namespace

std::string claims_section(const std::vector<Figures>& all, const Figures& f) {
  return heading("claims", "What the paper says, and what is seen here") +
         paragraph("On scenario " + f.scenario + "; not measured: the runs or the cars for it are missing.") +
         claims_html("claim of the paper", check_claims(f, all));
}

std::string oracle_section(const std::vector<Figures>& all, const Figures& f) {
  const std::vector<Cost> costs = find_costs(f, all);
  const std::vector<Claim> controls = check_controls(f, all);
  const std::string variants = variant_table(all, f);
  std::string html = heading("cost", "What costs most, by oracles");
  if (costs.empty())
    html += paragraph(
        "No oracle was run: give --preset paper,paper:ground,paper:clusters,paper:heading,paper:relay,paper:ego.");
  Rows rows = {{"made perfect", "compared with", "GOSPA^2 saved m^2", "of it: places", "misses", "false tracks",
                "HOTA (20 s) gained", "detected, more", "false tracks/h saved", "heading error saved deg"}};
  for (const Cost& c : costs)
    rows.push_back({c.oracle, c.against, cli::fixed(c.gospa_m2, 3), cli::fixed(c.located_m2, 3),
                    cli::fixed(c.missed_m2, 3), cli::fixed(c.false_m2, 3), cli::fixed(c.hota, 3),
                    cli::fixed(100 * c.detected, 1) + " %", cli::fixed(c.false_per_hour, 0),
                    cli::fixed(c.heading_deg, 2)});
  if (!costs.empty())
    html +=
        paragraph(
            "Each part of the pipeline made perfect by the truth, the largest gain first: what one of them gains is "
            "what that part costs. Gains do not add up. GOSPA (c = 2 m, p = 2) is squared so that its parts do; "
            "negative: it became worse.") +
        table_html(rows);
  if (!variants.empty()) html += variants;
  if (!controls.empty()) html += "<h3 id=\"controls\">Controls</h3>\n" + claims_html("what must be so", controls);
  return html;
}

std::string scenario_section(const std::vector<Figures>& all, const std::vector<Run>& runs) {
  Rows rows = {{"contestant", "scenario", "frames", "cars, never confirmed", "first detection s", "confirmed s", "at m",
                "heading error deg, detections", "tracks", "id switches", "longest gap s",
                "false confirmed tracks (an hour)"}};
  Rows more = {{"contestant", "scenario", "frames with a car", "fragments", "MOTA", "MOTP m", "HOTA", "GOSPA m",
                "NEES (5)", "NIS (2)", "data age ms"}};
  for (const Figures& f : all) {
    if (f.contestant.find_first_of("@:") != std::string::npos) continue;
    const TrackFigures& t = f.tracks;
    const auto heading_error = [](const std::map<std::string, std::vector<double>>& errors) {
      std::vector<double> turn;
      if (const auto found = errors.find("heading_rad"); found != errors.end())
        for (const double v : found->second) turn.push_back(std::fabs(v) * kDegrees);
      const metrics::Summary s = metrics::summarize(turn);
      return cli::fixed(s.median, 1) + " (" + cli::fixed(s.p95, 1) + ")";
    };
    const FirstSeen first = first_seen(runs, f.contestant, f.scenario);
    rows.push_back({f.contestant, f.scenario, std::to_string(f.frames),
                    std::to_string(t.cars_seen) + ", " + std::to_string(t.never_confirmed),
                    cli::fixed(first.detected_s.median, 2), cli::fixed(t.time_to_confirm_s.median, 2),
                    cli::fixed(first.confirmed_m.median, 0), heading_error(f.detection_errors),
                    heading_error(f.track_errors), std::to_string(t.mot.switches), cli::fixed(t.longest_gap_s.most, 2),
                    std::to_string(t.false_tracks) + " (" + cli::fixed(t.false_per_hour, 0) + ")"});
    more.push_back({f.contestant, f.scenario, std::to_string(t.mot.objects), std::to_string(t.mot.fragments),
                    cli::fixed(t.mot.mota(), 3), cli::fixed(t.mot.motp_m(), 2), cli::fixed(t.hota.hota, 3),
                    cli::fixed(t.gospa_m.mean, 2), cli::fixed(t.nees.mean, 2), cli::fixed(t.nis.mean, 2),
                    cli::fixed(1000 * t.data_age_s.mean, 0)});
  }
  return heading("scenarios", "All scenarios") +
         paragraph(
             "Cars count from -100 to +150 m, also where no beam can meet them. Times (medians over cars) run from a "
             "car's first moment within that reach, at m: how far ahead it was when its track was confirmed. Heading "
             "errors: median of the absolute error (95th percentile) of those at a car. Longest gap: without a "
             "confirmed track, of any car once confirmed.") +
         table_html(rows) +
         paragraph("CLEAR MOT and HOTA with the gate of " + cli::fixed(kGateM, 1) +
                   " m, GOSPA with c = 2 m, p = 2. Consistent would be NEES 5 and NIS 2. Data age: publish time minus "
                   "the track's last measurement.") +
         table_html(more);
}

}  // namespace overtake::evaluation
