// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// Tables of claims, costs and scenarios.
#include "tools/evaluation/report_html.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstring>
#include <map>
#include <set>

#include "tools/client/console.h"
#include "tools/evaluation/first_seen.h"
#include "tools/evaluation/paper_claims.h"
#include "tools/io/angles.h"
#include "tools/view/svg.h"

namespace overtake::evaluation {

namespace {

// Names of numbers are words joined by underscores, with the unit last: 3 of "found_m" becomes "found: 3 m".
std::string numbers_text(const std::vector<Number>& numbers) {
  std::string out;
  for (const Number& n : numbers) {
    static const std::map<std::string, std::string> kNames = {
        {"grid_2_5d", "2.5-D grid"}, {"farthest_car", "farthest a car was"},
        {"p5", "5th percentile"},    {"p95", "95th percentile"},
        {"hump_1", "1st hump"},      {"hump_2", "2nd hump"},
        {"hump_3", "3rd hump"},      {"hump_4", "4th hump"}};
    std::string name = n.name, unit;
    for (const char* end : {"_m", "_deg"})
      if (const std::size_t length = std::strlen(end);
          name.size() > length && name.compare(name.size() - length, length, end) == 0) {
        unit = " " + name.substr(name.size() - length + 1);
        name.resize(name.size() - length);
      }
    if (const auto known = kNames.find(name); known != kNames.end()) name = known->second;
    std::replace(name.begin(), name.end(), '_', ' ');
    char value[32];
    std::snprintf(value, sizeof value, std::fabs(n.value) < 1000 ? "%.3g" : "%.0f", n.value);
    out += (out.empty() ? "" : "; ") + name + ": " + (std::isfinite(n.value) ? value + unit : n.none);
  }
  return out;
}

std::string verdict_cell(const Claim& c) {
  return !c.known  ? "<td class=\"unknown\">not measured</td>"
         : c.holds ? "<td class=\"yes\">holds</td>"
                   : "<td class=\"no\">does not hold</td>";
}

std::string claims_html(const char* first, const std::vector<Claim>& claims, Origin origin) {
  std::string html = "<div class=\"wide\"><table class=\"words\"><tr><th>" + std::string(first) +
                     "</th><th>here</th><th>figures (" + words_of(origin) + ")</th></tr>\n";
  for (const Claim& c : claims)
    html += "<tr><td>" + cli::escape_xml(c.text) + "</td>" + verdict_cell(c) + "<td>" +
            cli::escape_xml(numbers_text(c.numbers)) + "</td></tr>\n";
  return html + "</table></div>\n";
}

// Controls of every preset and scenario, so that each failure is visible. "": no control was run.
std::string controls_html(const std::vector<Figures>& all) {
  std::vector<std::pair<std::string, std::string>> controls;  // sentence, rows
  for (const Figures& f : all) {
    if (f.variant.find_first_of("@:") != std::string::npos) continue;
    for (const Claim& c : check_controls(f, all)) {
      auto at = std::find_if(controls.begin(), controls.end(), [&](const auto& k) { return k.first == c.text; });
      if (at == controls.end()) at = controls.insert(at, {c.text, ""});
      at->second += "<tr><td>" + cli::escape_xml(f.variant + ", " + f.scenario) + "</td>" + verdict_cell(c) + "<td>" +
                    cli::escape_xml(numbers_text(c.numbers)) + "</td></tr>\n";
    }
  }
  if (controls.empty()) return "";
  std::string html = "<h3 id=\"controls\">Controls</h3>\n" +
                     paragraph(
                         "What must be so if the numbers are to be believed, in every scenario. Not measured: "
                         "there is no car, or none that moves.");
  for (const auto& [text, rows] : controls)
    html += paragraph("Must be: " + text + ".") +
            "<div class=\"wide\"><table class=\"words\"><tr><th>variant, scenario</th><th>here</th><th>figures</th>"
            "</tr>\n" +
            rows + "</table></div>\n";
  return html;
}

// Explains values in the table of scenarios that look wrong at first.
std::string heading_notes(const std::vector<Figures>& all) {
  const auto has = [&](const char* scenario) {
    return std::any_of(all.begin(), all.end(), [&](const Figures& f) { return f.scenario == scenario; });
  };
  std::string notes;
  if (has("spin") || has("spin_near"))
    notes += "A spin ends with the car backwards, while psi_REF points forward along the track: errors near 180 deg. ";
  if (has("stopped_car"))
    notes += "The stopped car stands at 72 deg across the track, and where psi_REF is taken the error is as large.";
  return notes.empty() ? "" : paragraph(notes);
}

// The preset and its variants side by side.
std::string variant_table(const std::vector<Figures>& all, const Figures& f) {
  Rows rows = {{"variant", "detected", "MOTA", "HOTA (race)", "GOSPA m", "x veh |p95| m", "y veh |p95| m",
                "false det./frame", "false tracks/h"}};
  for (const Figures& g : all) {
    if (g.scenario != f.scenario || g.variant.find('@') != std::string::npos) continue;
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
    rows.push_back({g.variant, cli::fixed(100.0 * double(hits) / double(trials), 1) + " %",
                    cli::fixed(g.tracks.mot.mota(), 3), cli::fixed(g.tracks.hota.hota, 3),
                    cli::fixed(g.tracks.gospa_m.mean, 2), size("x_veh_m"), size("y_veh_m"), cli::fixed(wrong, 2),
                    cli::fixed(g.tracks.false_per_hour, 0)});
  }
  return rows.size() < 3 ? "" : table_html(rows);
}

// The tables of one scenario that have rows.
std::string track_tables(const std::vector<TrackQuality>& columns) {
  std::string html;
  for (const auto& [name, rows] :
       {std::pair("Tracks", track_rows(columns)),
        {"Predicted paths", path_rows(columns)},
        {"Probability of existence: share of the tracks that are at a car", calibration_rows(columns)},
        {"False tracks an hour (false tracks); delay s: median, 99 % (cars)", threshold_rows(columns)}})
    if (rows.size() > 1) html += "<h3>" + cli::escape_xml(name) + "</h3>\n" + table_html(rows);
  return html;
}

}  // namespace

std::string track_section(const std::vector<TrackQuality>& all, const std::string& main) {
  std::string html =
      heading("tracks", "Tracks and predicted paths") +
      paragraph(
          "Confirmed tracks at a car: errors by range and by what the car does, identity, confirmation, predicted "
          "paths against the truth at their time, the published probability of existence; tools/evaluation/README.md "
          "defines each figure and each limit.") +
      track_tables(track_quality_of(all, main));
  std::set<std::string> others;
  for (const TrackQuality& q : all)
    if (q.scenario != main) others.insert(q.scenario);
  for (const std::string& scenario : others)
    html += "<details><summary>" + cli::escape_xml(scenario) + "</summary>" +
            track_tables(track_quality_of(all, scenario)) + "</details>\n";
  return html;
}

std::string quality_section(const std::vector<Quality>& all, const std::vector<Run>& runs) {
  const std::string main = main_scenario(all);
  std::string html =
      heading("quality", "Quality of the presets") +
      paragraph(
          "The share of car-frames that are detected where the car has 3 points or more, false detections, "
          "clusters, ground and centre errors; tools/evaluation/README.md defines each figure.");
  if (main == "all") html += table_html(scenario_rows(all));
  html += table_html(quality_rows(quality_of(all, main)));
  std::set<std::string> others;
  for (const Quality& q : all)
    if (q.scenario != main) others.insert(q.scenario);
  for (const std::string& scenario : others)
    html += "<details><summary>" + cli::escape_xml(scenario) + "</summary>" +
            table_html(quality_rows(quality_of(all, scenario))) + "</details>\n";
  std::map<std::string, std::string> configs;
  for (const Run& run : runs)
    if (const auto found = run.about.find("config"); found != run.about.end() && !found->second.empty())
      configs[run.variant] = found->second;
  Rows rows = {{"configuration", "changes"}};
  for (const auto& [name, changes] : configs) rows.push_back({name, changes});
  return rows.size() > 1 ? html + table_html(rows) : html;
}

std::string claims_section(const std::vector<Figures>& all, const Figures& f) {
  return heading("claims", "What the paper says, and what is seen here") +
         paragraph("On scenario " + f.scenario +
                   "; not measured: the runs, the cars at that distance or the truth of points for it are missing.") +
         claims_html("claim of the paper", check_claims(f, all), f.origin);
}

std::string oracle_section(const std::vector<Figures>& all, const Figures& f) {
  const std::vector<Cost> costs = find_costs(f, all);
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
  return html + controls_html(all);
}

std::string scenario_section(const std::vector<Figures>& all, const std::vector<Run>& runs) {
  Rows rows = {{"variant", "scenario", "frames", "cars, never confirmed", "first detection s", "confirmed s", "at m",
                "heading error deg, detections", "tracks", "id switches", "longest gap s",
                "false confirmed tracks (an hour)", "confirmed at no car, s an hour"}};
  Rows more = {{"variant", "scenario", "frames with a car", "fragments", "MOTA", "MOTP m", "HOTA (race)", "GOSPA m",
                "NEES (5)", "NIS (2)", "data age ms", "NEES in 95 %", "NIS in 95 %", "NIS, own covariance", "in 95 %"}};
  for (const Figures& f : all) {
    if (f.variant.find_first_of("@:") != std::string::npos) continue;
    const TrackFigures& t = f.tracks;
    const auto heading_error = [](const std::map<std::string, std::vector<double>>& errors) {
      std::vector<double> turn;
      if (const auto found = errors.find("heading_rad"); found != errors.end())
        for (const double v : found->second) turn.push_back(io::deg(std::fabs(v)));
      const metrics::Summary s = metrics::summarize(turn);
      return cli::fixed(s.median, 1) + " (" + cli::fixed(s.p95, 1) + ")";
    };
    const FirstSeen first = first_seen(runs, f.variant, f.scenario);
    rows.push_back({f.variant, f.scenario, std::to_string(f.frames),
                    std::to_string(t.cars_seen) + ", " + std::to_string(t.never_confirmed),
                    cli::fixed(first.detected_s.median, 2), cli::fixed(t.time_to_confirm_s.median, 2),
                    cli::fixed(first.confirmed_m.median, 0), heading_error(f.detection_errors),
                    heading_error(f.track_errors), std::to_string(t.mot.switches), cli::fixed(t.longest_gap_s.most, 2),
                    std::to_string(t.false_tracks) + " (" + cli::fixed(t.false_per_hour, 0) + ")",
                    cli::fixed(t.false_s_per_hour, 1)});
    more.push_back({f.variant, f.scenario, std::to_string(t.mot.objects), std::to_string(t.mot.fragments),
                    cli::fixed(t.mot.mota(), 3), cli::fixed(t.mot.motp_m(), 2), cli::fixed(t.hota.hota, 3),
                    cli::fixed(t.gospa_m.mean, 2), cli::fixed(t.nees.mean, 2), cli::fixed(t.nis.mean, 2),
                    cli::fixed(1000 * t.data_age_s.mean, 0), cli::fixed(t.nees_inside.value, 3),
                    cli::fixed(t.nis_inside.value, 3), cli::fixed(t.nis_own.mean, 2),
                    cli::fixed(t.nis_own_inside.value, 3)});
  }
  return heading("scenarios", "All scenarios") +
         paragraph(
             "Cars count from -100 to +150 m, also where no beam can meet them. Times (medians over cars) run from a "
             "car's first moment within that reach, at m: how far ahead it was when its track was confirmed. Heading "
             "errors: median of the absolute error (95th percentile) of those at a car. Longest gap: without a "
             "confirmed track, of any car once confirmed.") +
         table_html(rows) + heading_notes(all) +
         paragraph(
             "CLEAR MOT and HOTA with the gate of " + cli::fixed(kGateM, 1) +
             " m, GOSPA with c = 2 m, p = 2. Consistent would be NEES 5 and NIS 2, and 0.95 of their values "
             "between the quantiles 0.025 and 0.975 of chi-square. NIS uses tracker.r_x and r_y; own covariance: that "
             "of the detection, where the method publishes it. Data age: publish time minus the track's last "
             "measurement.") +
         table_html(more);
}

}  // namespace overtake::evaluation
