// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
#include "tools/evaluation/report_pages.h"

#include <cmath>

#include "tools/client/console.h"
#include "tools/evaluation/report_html.h"
#include "tools/io/angles.h"
#include "tools/io/words.h"
#include "tools/view/svg.h"

namespace overtake::evaluation {
namespace {

// Every figure and table of the paper with its place in this report.
std::string index_section() {
  struct Entry {
    const char *paper, *id, *here;
  };
  static constexpr Entry kEntries[] = {
      {"1 Photograph of the race", "race", "from above"},
      {"2 Ways to detect and track vehicles", "ways", "what is taken here and what it is compared with"},
      {"3 Block scheme", "blocks", "the pipeline with its times"},
      {"4 Steps of the segmentation", "strip", "one scan on its way"},
      {"5 Clouds by intensity, segmented and merged", "clouds", "a car over a seam"},
      {"6 Both rectangles on a car entering a spin", "fits", "three moments"},
      {"7 Sensors and fields of view", "sensors", "from above, with the blind strips"},
      {"8 Computation times", "times", "violins and a table"},
      {"9 Ground removal: TPR, PPV, F1", "ground", "violins, and by range on cars"},
      {"10 Clustering: clusters per car, mixed clusters", "clustering", "against th_seg and the Euclidean radius"},
      {"11 Probability of detection, false positives", "detection", "against longitudinal distance, with counts"},
      {"12 Errors of detections and tracks", "errors", "violins and a table"},
      {"Table of parameters", "parameters", "the preset's values beside the paper's"},
      {"Claims in words", "claims", "each with its figures"},
  };
  std::string html = heading("index", "The paper's figures, and where they are answered") +
                     "<div class=\"wide\"><table class=\"words\"><tr><th>paper</th><th>here</th></tr>\n";
  for (const Entry& e : kEntries)
    html += "<tr><td>" + cli::escape_xml(e.paper) + "</td><td><a href=\"#" + e.id + "\">" + cli::escape_xml(e.here) +
            "</a></td></tr>\n";
  return html +
         "</table></div>\n<p>Beyond the paper: <a href=\"#cost\">oracles and what each part costs</a>, "
         "<a href=\"#scenarios\">all scenarios</a>, <a href=\"#logs\">logs</a>.</p>\n";
}

// The paper's overview of the field: problem, the solution here, other solutions in this report.
std::string ways_section() {
  const Rows rows = {
      {"problem", "taken here (as in the paper)", "compared with in this report"},
      {"detection and tracking", "tracking by detection", "-"},
      {"detection", "by segmentation, no learning", "-"},
      {"ground removal", "angles between lines of the range image", "2.5-D binary grid (Himmelsbach 2009)"},
      {"clustering", "range image, angle beta (Bogoslavskyi & Stachniss)", "Euclidean clustering (PCL's rule)"},
      {"pose", "rectangle: variance criterion (Zhang 2017) and heading of the map",
       "each of the two; the true heading"},
      {"filter", "EKF, constant speed and turn rate", "consistency: NEES, NIS"},
      {"association", "global nearest neighbour (Munkres)", "id switches, HOTA"},
      {"life cycle", "M of N", "false tracks, time to confirm"}};
  std::string table = table_html(rows);
  table.replace(table.find("<table>"), 7, "<table class=\"words\">");
  return heading("ways", "Ways to detect and track vehicles") + table;
}

std::string log_section(const std::vector<Run>& runs) {
  Rows rows = {{"log", "is", "variants", "scenario", "seed", "ego", "frames", "note"}};
  std::map<std::string, std::pair<const Run*, int64_t>> of_log;
  for (const Run& run : runs) {
    auto& [first, count] = of_log[run.log];
    if (!first || run.variant.find('@') == std::string::npos) first = &run;
    ++count;
  }
  for (const auto& [log, of_this_log] : of_log) {
    const auto& entry = of_this_log;  // a lambda cannot capture a structured binding in clang 14
    const auto about = [&](const char* key) {
      const auto found = entry.first->about.find(key);
      return found == entry.first->about.end() ? std::string("-") : found->second;
    };
    const std::string damage = about("damage");
    rows.push_back({log, is_simulated(*entry.first) ? "simulated" : "recorded", std::to_string(entry.second),
                    about("scenario"), about("seed"), about("ego"), about("frames"),
                    damage == "-" || damage.empty() ? "" : "cut off: " + damage});
  }
  return heading("logs", "Logs") + table_html(rows);
}

// The origin of all data.
std::string origin_line(Origin origin) {
  const std::string by_simulator =
                        "Race, sensors, localisation errors and truth come from the simulator (tools/sim/README.md).",
                    by_record =
                        "Scans and poses are recorded; where the cars truly were is taken from their odometry. What "
                        "each point lies on is not known: ground is judged by the automatic labels alone, clusters by "
                        "the paper's rule, and what needs more is not measured.";
  const std::string words =
      origin == Origin::kSimulated ? by_simulator + " No number here is one of a real car."
      : origin == Origin::kRecorded
          ? by_record
          : "Some logs are simulated, others recorded (see the logs). Simulated: " + by_simulator +
                " Recorded: " + by_record;
  return "<p><span class=\"" + std::string(origin == Origin::kRecorded ? "recorded" : "simulated") + "\">" +
         words_of(origin) + "</span> " + cli::escape_xml(words) + "</p>\n";
}

// The headline numbers of the main scenario.
std::string headline_table(const Figures& f) {
  int64_t hits = 0, trials = 0, confirmed = 0;
  double false_detections = 0;
  for (const DistanceBin& b : f.distance) {
    hits += b.detected.hits, trials += b.detected.trials, confirmed += b.confirmed.hits;
    false_detections += b.false_detections;
  }
  const auto percent = [&](int64_t n) { return cli::fixed(100.0 * double(n) / double(trials), 1) + " %"; };
  const auto deviation = [](const std::map<std::string, std::vector<double>>& errors, const char* name, double scale) {
    const auto found = errors.find(name);
    if (found == errors.end()) return std::string("-");
    const metrics::Summary s = metrics::summarize(found->second);
    return cli::fixed(s.mean * scale, 2) + " +- " + cli::fixed(s.deviation * scale, 2);
  };
  const auto three = [](const GroundFigures& g) {
    if (metrics::summarize(g.f1).count == 0) return std::string("not measured");
    return cli::fixed(metrics::summarize(g.tpr).mean, 3) + ", " + cli::fixed(metrics::summarize(g.ppv).mean, 3) + ", " +
           cli::fixed(metrics::summarize(g.f1).mean, 3);
  };
  const TrackFigures& t = f.tracks;
  const auto frame = f.times_ms.find("frame");
  return table_html(
      {{words_of(f.origin), f.scenario},
       {"ground removal by truth: TPR, PPV, F1", three(f.ground)},
       {"the same by automatic labels (some frames)", three(f.ground_auto)},
       {"clusters per car; mixed with other, a frame; by truth",
        mean_and_deviation(f.clusters_per_car, 2) + "; " + mean_and_deviation(f.mixed_other, 3)},
       {"clusters in a car's box; longer than a car, a frame; by the paper's rule",
        mean_and_deviation(f.boxed_per_car, 2) + "; " + mean_and_deviation(f.mixed_by_size, 3)},
       {"frames with a car (-100 to +150 m): detected; with a confirmed track",
        percent(hits) + "; " + percent(confirmed)},
       {"false detections a frame; false confirmed tracks an hour",
        cli::fixed(false_detections, 2) + "; " + cli::fixed(t.false_per_hour, 0)},
       {"tracks: x, y in the vehicle frame m",
        deviation(f.track_errors, "x_veh_m", 1) + "; " + deviation(f.track_errors, "y_veh_m", 1)},
       {"tracks: speed m/s; course deg",
        deviation(f.track_errors, "speed_mps", 1) + "; " + deviation(f.track_errors, "course_rad", io::deg(1))},
       {"MOTA; HOTA of the whole race, of 20 s; GOSPA m; id switches",
        cli::fixed(t.mot.mota(), 3) + "; " + cli::fixed(t.hota.hota, 3) + ", " + cli::fixed(t.hota_window.hota, 3) +
            "; " + cli::fixed(t.gospa_m.mean, 2) + "; " + std::to_string(t.mot.switches)},
       {"median time of a frame on one core",
        cli::fixed(frame == f.times_ms.end() ? NAN : metrics::summarize(frame->second).median, 2) + " ms"}});
}

}  // namespace

const Figures* main_figures(const std::vector<Figures>& all) {
  const Figures* main = nullptr;
  for (const Figures& f : all)
    if (f.variant.find_first_of("@:") == std::string::npos && (!main || f.frames > main->frames)) main = &f;
  return main;
}

std::string format_report(const std::vector<Figures>& all, const std::vector<Run>& runs,
                          const std::vector<Quality>& quality, const std::vector<TrackQuality>& tracks,
                          const Differences& differences, const std::map<std::string, NamedPicture>& pictures,
                          const std::string& out) {
  const Figures* main = main_figures(all);
  std::string html = page_begin("Overtake evaluation") + origin_line(origin_of(runs));
  if (!main)
    return html + "<p>No run of a preset as it is.</p>\n" + difference_section(differences) + log_section(runs) +
           page_end();
  html += paragraph("Figures: variant " + main->variant + " on scenario " + main->scenario + ", " +
                    io::counted(main->runs, "log") + ", " + io::counted(main->frames, "frame") + ", " +
                    cli::fixed(main->seconds, 0) + " s.");
  html += headline_table(*main) + quality_section(quality, runs) + difference_section(differences) +
          track_section(tracks, main_scenario(quality)) + index_section() + claims_section(all, *main) +
          oracle_section(all, *main) + scenario_section(all, runs) + picture_section(pictures, *main, runs) +
          time_section(*main) + scaling_section(out) + ground_section(*main) + clustering_section(all, *main) +
          detection_section(*main) + error_section(*main) + recordings_section(out) + ways_section() +
          parameter_section() + log_section(runs);
  return html + page_end();
}

}  // namespace overtake::evaluation
