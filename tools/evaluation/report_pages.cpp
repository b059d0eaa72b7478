// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
#include "tools/evaluation/report_pages.h"

#include <algorithm>
#include <cmath>

#include "tools/console.h"
#include "tools/evaluation/svg_plot.h"

namespace overtake::evaluation {
namespace {

constexpr const char* kBlue = "#1f77b4";
constexpr const char* kOrange = "#ff7f0e";
constexpr const char* kGreen = "#2ca02c";
constexpr const char* kPurple = "#7b3fa0";
constexpr double kDegrees = 180 / M_PI;

std::string table_html(const std::vector<std::vector<std::string>>& rows) {
  std::string html = "<table>\n";
  for (std::size_t r = 0; r < rows.size(); ++r) {
    html += "<tr>";
    for (const std::string& cell : rows[r])
      html += (r == 0 ? "<th>" : "<td>") + escape_xml(cell) + (r == 0 ? "</th>" : "</td>");
    html += "</tr>\n";
  }
  return html + "</table>\n";
}

std::string paragraph(const std::string& text) { return "<p>" + escape_xml(text) + "</p>\n"; }

std::string mean_and_deviation(const std::vector<double>& values, int32_t digits) {
  const metrics::Summary s = metrics::summarize(values);
  return cli::fixed(s.mean, digits) + " +- " + cli::fixed(s.deviation, digits);
}

std::string ground_section(const Figures& f) {
  std::string html = "<h2>Ground removal</h2>\n" +
                     paragraph(
                         "A scan of one sensor a value; positive is non-ground by the simulator's truth; smoke and "
                         "blooming count as ground. Points without a label (second returns, dust) are left out for "
                         "both. The grid (Himmelsbach 2009, 0.5 m cells, 0.2 m, not tuned) has one value a frame of "
                         "all sensors.");
  const auto plot = [&](const char* title, const std::vector<double>& ours, const std::vector<double>& grid) {
    return violin_plot({title, "", "", 0, 0, 0, 0, 300, 320},
                       {{"proposed", kBlue, ours}, {"2.5-D grid", kOrange, grid}});
  };
  html += plot("TPR", f.ground.tpr, f.grid.tpr) + plot("PPV", f.ground.ppv, f.grid.ppv) +
          plot("F1", f.ground.f1, f.grid.f1);
  Series share{"found to be non-ground", kBlue, {}, {}, {}, {}, true, false};
  for (const auto& [range, points] : f.car_points) {
    if (range >= 150) continue;
    share.x.push_back(range + 5), share.y.push_back(points.second / points.first);
  }
  html += line_plot({"TPR on the points of cars", "range [m]", "share", 0, 150, 0, 1.0, 640, 280}, {share});
  return html;
}

std::string clustering_section(const std::vector<Figures>& all, const Figures& f) {
  std::string html =
      "<h2>Clustering</h2>\n" +
      paragraph("Cars with " + std::to_string(kMinCarPoints) +
                " points or more; bars are one standard deviation. Mixed: a cluster that holds points of a "
                "car and of a wall, fence or any other obstacle, by truth, per frame with a car. Euclidean "
                "clustering (own implementation of PCL's rule) on the points the pipeline found to be "
                "non-ground. Both curves on some frames only (--every).");
  Series clusters{"proposed", kBlue, {}, {}, {}, {}, true, true}, mixed = clusters;
  const std::string prefix = f.contestant + "@cluster.threshold_deg=";
  std::vector<const Figures*> sweep;
  for (const Figures& g : all)
    if (g.scenario == f.scenario && g.contestant.rfind(prefix, 0) == 0) sweep.push_back(&g);
  const auto angle = [&](const Figures* g) { return std::stod(g->contestant.substr(prefix.size())); };
  std::sort(sweep.begin(), sweep.end(), [&](auto a, auto b) { return angle(a) < angle(b); });
  const auto add = [](Series& s, double x, const std::vector<double>& values) {
    const metrics::Summary of = metrics::summarize(values);
    s.x.push_back(x), s.y.push_back(of.mean);
    s.low.push_back(of.mean - of.deviation), s.high.push_back(of.mean + of.deviation);
  };
  for (const Figures* g : sweep) add(clusters, angle(g), g->clusters_per_car), add(mixed, angle(g), g->mixed_other);
  if (!sweep.empty()) {
    html += line_plot({"Clusters per car", "th_seg [deg]", "clusters", 0, 0, 0, 0, 480, 280}, {clusters});
    html += line_plot({"Mixed clusters per frame", "th_seg [deg]", "mixed", 0, 0, 0, 0, 480, 280}, {mixed});
  }
  Series euclid{"Euclidean", kOrange, {}, {}, {}, {}, true, true}, euclid_mixed = euclid;
  for (const auto& [radius, values] : f.euclid_clusters) add(euclid, radius, values);
  for (const auto& [radius, values] : f.euclid_mixed) add(euclid_mixed, radius, values);
  html += line_plot({"Clusters per car", "radius [m]", "clusters", 0, 0, 0, 0, 480, 280}, {euclid});
  html += line_plot({"Mixed clusters per frame", "radius [m]", "mixed", 0, 0, 0, 0, 480, 280}, {euclid_mixed});
  html +=
      paragraph("All frames, preset as it is: clusters per car " + mean_and_deviation(f.clusters_per_car, 2) +
                "; wholly inside the car's box made 1 m larger (the paper's rule) " +
                mean_and_deviation(f.boxed_per_car, 2) + "; mixed with other " + mean_and_deviation(f.mixed_other, 3) +
                "; two cars in one " + mean_and_deviation(f.mixed_cars, 3) + ".");
  return html;
}

std::string detection_section(const Figures& f) {
  Series detected{"detected", kGreen, {}, {}, {}, {}, true, false},
      confirmed{"confirmed track", kPurple, {}, {}, {}, {}, true, false};
  Series false_detected{"false detections", kGreen, {}, {}, {}, {}, true, false},
      false_confirmed{"false confirmed tracks", kPurple, {}, {}, {}, {}, true, false};
  std::vector<std::vector<std::string>> rows = {{"distance m", "frames", "events", "detected", "95 %", "confirmed",
                                                 "95 %", "false det./frame", "false tracks/frame"}};
  const auto percent = [](double v) { return cli::fixed(100 * v, 0); };
  for (const DistanceBin& b : f.distance) {
    detected.x.push_back(b.middle_m), detected.y.push_back(b.detected.value);
    detected.low.push_back(b.detected.low), detected.high.push_back(b.detected.high);
    confirmed.x.push_back(b.middle_m), confirmed.y.push_back(b.confirmed.value);
    confirmed.low.push_back(b.confirmed.low), confirmed.high.push_back(b.confirmed.high);
    false_detected.x.push_back(b.middle_m), false_detected.y.push_back(b.false_detections);
    false_confirmed.x.push_back(b.middle_m), false_confirmed.y.push_back(b.false_confirmed);
    rows.push_back({cli::fixed(b.middle_m - kBinM / 2, 0) + " to " + cli::fixed(b.middle_m + kBinM / 2, 0),
                    std::to_string(b.detected.trials), std::to_string(b.events), percent(b.detected.value) + " %",
                    percent(b.detected.low) + ".." + percent(b.detected.high), percent(b.confirmed.value) + " %",
                    percent(b.confirmed.low) + ".." + percent(b.confirmed.high), cli::fixed(b.false_detections, 3),
                    cli::fixed(b.false_confirmed, 3)});
  }
  return "<h2>Detection</h2>\n" +
         paragraph(
             "Against the longitudinal distance of the car, ahead positive, bins of 10 m. A detection or a confirmed "
             "track counts within " +
             cli::fixed(kGateM, 1) +
             " m of the car's true centre; everything else is false. Bands: 95 % by drawing the overtaking events "
             "again with replacement (Wilson's interval where there is one event).") +
         line_plot({"Probability of detection and of a confirmed track", "longitudinal distance [m]", "share",
                    kNearestM, kFarthestM, 0, 1, 860, 320},
                   {detected, confirmed}) +
         line_plot({"False positives per frame", "longitudinal distance [m]", "per frame and 10 m", kNearestM,
                    kFarthestM, 0, 0, 860, 280},
                   {false_detected, false_confirmed}) +
         "<details><summary>counts</summary>" + table_html(rows) + "</details>\n";
}

std::string error_section(const Figures& f) {
  struct Kind {
    const char *column, *title;
    double scale;
  };
  static constexpr Kind kKinds[] = {{"x_map_m", "x, map [m]", 1},
                                    {"y_map_m", "y, map [m]", 1},
                                    {"x_veh_m", "x, vehicle [m]", 1},
                                    {"y_veh_m", "y, vehicle [m]", 1},
                                    {"heading_rad", "heading [deg]", kDegrees},
                                    {"course_rad", "course [deg]", kDegrees},
                                    {"speed_mps", "speed [m/s]", 1},
                                    {"yaw_rate_rps", "yaw rate [deg/s]", kDegrees}};
  std::string html =
      "<h2>Pose and tracking</h2>\n" +
      paragraph(
          "Estimate minus truth of those within " + cli::fixed(kGateM, 1) +
          " m of a car: raw detections at their own stamp, confirmed tracks at publish time, the end of the sweep "
          "(one period behind the frame's first stamp). Vehicle frame: the map error turned into the true ego's axes. "
          "Shown from the 5th to the 95th percentile; thick line: quartiles, circle: median, red: mean.");
  std::vector<std::vector<std::string>> rows = {
      {"error", "of", "count", "mean (bias)", "deviation", "p5", "p25", "median", "p75", "p95"}};
  for (const Kind& kind : kKinds) {
    std::vector<Violin> violins;
    for (const bool track : {false, true}) {
      const auto& errors = track ? f.track_errors : f.detection_errors;
      const auto found = errors.find(kind.column);
      if (found == errors.end()) continue;
      Violin v{track ? "tracks" : "detections", track ? kPurple : kGreen, found->second};
      for (double& value : v.values) value *= kind.scale;
      const metrics::Summary s = metrics::summarize(v.values);
      rows.push_back({kind.title, v.name, std::to_string(s.count), cli::fixed(s.mean, 3), cli::fixed(s.deviation, 3),
                      cli::fixed(s.p5, 3), cli::fixed(s.p25, 3), cli::fixed(s.median, 3), cli::fixed(s.p75, 3),
                      cli::fixed(s.p95, 3)});
      violins.push_back(std::move(v));
    }
    if (!violins.empty()) html += violin_plot({kind.title, "", "", 0, 0, 0, 0, 236, 300}, violins);
  }
  return html + table_html(rows);
}

std::string time_section(const Figures& f) {
  std::vector<Violin> violins;
  std::vector<std::vector<std::string>> rows = {{"stage", "count", "mean ms", "p5", "median", "p95", "max"}};
  for (const auto& [stage, values] : f.times_ms) {
    const metrics::Summary s = metrics::summarize(values);
    rows.push_back({stage, std::to_string(s.count), cli::fixed(s.mean, 3), cli::fixed(s.p5, 3), cli::fixed(s.median, 3),
                    cli::fixed(s.p95, 3), cli::fixed(s.most, 3)});
  }
  for (const char* stage : {"segment", "merge", "gate", "pose", "track", "frame"})
    if (const auto found = f.times_ms.find(stage); found != f.times_ms.end())
      violins.push_back({stage, kBlue, found->second});
  const auto frame = f.times_ms.find("frame");
  const double mean = frame == f.times_ms.end() ? NAN : metrics::summarize(frame->second).mean;
  return "<h2>Times</h2>\n" +
         paragraph("On " + cpu_name() +
                   ", one worker, beside whatever else the machine did; a value a scan (segment) or a "
                   "frame. Mean frame: " +
                   cli::fixed(mean, 2) + " ms, " + cli::fixed(1000 / mean, 0) + " frames a second could be done.") +
         violin_plot({"Computation time", "", "ms", 0, 0, 0, 0, 700, 320}, violins) + table_html(rows);
}

std::string scenario_table(const std::vector<Figures>& all) {
  std::vector<std::vector<std::string>> rows = {{"contestant", "scenario", "frames", "car frames", "MOTA", "MOTP m",
                                                 "HOTA", "GOSPA m", "switches", "fragments", "cars, never confirmed",
                                                 "confirm s (median)", "longest gap s (max)", "false confirmed/h",
                                                 "heading |p95| deg", "NEES (5)", "NIS (2)", "data age ms"}};
  for (const Figures& f : all) {
    if (f.contestant.find('@') != std::string::npos) continue;
    const TrackFigures& t = f.tracks;
    std::vector<double> turn;
    if (const auto found = f.track_errors.find("heading_rad"); found != f.track_errors.end())
      for (const double v : found->second) turn.push_back(std::fabs(v) * kDegrees);
    rows.push_back({f.contestant, f.scenario, std::to_string(f.frames), std::to_string(t.mot.objects),
                    cli::fixed(t.mot.mota(), 3), cli::fixed(t.mot.motp_m(), 2), cli::fixed(t.hota.hota, 3),
                    cli::fixed(t.gospa_m.mean, 2), std::to_string(t.mot.switches), std::to_string(t.mot.fragments),
                    std::to_string(t.cars_seen) + ", " + std::to_string(t.never_confirmed),
                    cli::fixed(t.time_to_confirm_s.median, 2), cli::fixed(t.longest_gap_s.most, 2),
                    cli::fixed(t.false_per_hour, 0), cli::fixed(metrics::summarize(turn).p95, 1),
                    cli::fixed(t.nees.mean, 2), cli::fixed(t.nis.mean, 2), cli::fixed(1000 * t.data_age_s.mean, 0)});
  }
  return "<h2>Tracking, all scenarios</h2>\n" +
         paragraph(
             "Cars count from -100 to +150 m, also where no beam can meet them. CLEAR MOT and HOTA with the gate of " +
             cli::fixed(kGateM, 1) +
             " m, GOSPA with c = 2 m, p = 2. Consistent would be NEES 5 and NIS 2. Data age: "
             "publish time minus the track's last measurement.") +
         table_html(rows);
}

// Claims of the paper as sentences with the figures that speak for or against them.
std::string claims_section(const Figures& f) {
  std::vector<std::vector<std::string>> rows = {{"claim of the paper", "here", "figures (simulated)"}};
  const auto judge = [&](const char* claim, bool known, bool holds, const std::string& figures) {
    rows.push_back({claim, !known ? "not measured" : holds ? "holds" : "does not hold", figures});
  };
  const auto tpr = metrics::summarize(f.ground.tpr), grid_tpr = metrics::summarize(f.grid.tpr),
             ppv = metrics::summarize(f.ground.ppv), grid_ppv = metrics::summarize(f.grid.ppv),
             f1 = metrics::summarize(f.ground.f1), grid_f1 = metrics::summarize(f.grid.f1);
  const auto pair = [](const metrics::Summary& a, const metrics::Summary& b) {
    return cli::fixed(a.mean, 3) + " +- " + cli::fixed(a.deviation, 3) + " against " + cli::fixed(b.mean, 3) + " +- " +
           cli::fixed(b.deviation, 3);
  };
  const bool grid = grid_tpr.count > 0;
  judge("ground removal: TPR higher and steadier than the grid's", grid,
        tpr.mean > grid_tpr.mean && tpr.deviation < grid_tpr.deviation, pair(tpr, grid_tpr));
  judge("F1 higher and steadier", grid, f1.mean > grid_f1.mean && f1.deviation < grid_f1.deviation, pair(f1, grid_f1));
  judge("PPV lower", grid, ppv.mean < grid_ppv.mean, pair(ppv, grid_ppv));
  const auto share = [&](double low, double high, bool confirmed) {
    metrics::Group sum;
    for (const DistanceBin& b : f.distance)
      if (b.middle_m > low && b.middle_m < high) {
        const metrics::Share& s = confirmed ? b.confirmed : b.detected;
        sum.hits += s.hits, sum.trials += s.trials;
      }
    return metrics::binomial_share(sum.hits, sum.trials);
  };
  const auto text = [](const metrics::Share& s) {
    return cli::fixed(100 * s.value, 0) + " % of " + std::to_string(s.trials);
  };
  const auto blind = share(-40, -20, false), before = share(-60, -40, false), after = share(-20, 0, false),
             blind_track = share(-40, -20, true);
  judge("detection dips 20 to 40 m behind", blind.trials && before.trials && after.trials,
        blind.value < before.value && blind.value < after.value,
        text(blind) + "; -60 to -40 m " + text(before) + ", -20 to 0 m " + text(after));
  judge("there a confirmed track is likelier than a detection", blind.trials > 0, blind_track.value > blind.value,
        text(blind_track) + " against " + text(blind));
  const auto ahead = share(80, 90, false), behind = share(-90, -80, false), half = share(70, 90, false);
  judge("seen to 90 m ahead", ahead.trials > 0, ahead.value > 0, "80 to 90 m: " + text(ahead));
  judge("seen to 85 m behind", behind.trials > 0, behind.value > 0, "-90 to -80 m: " + text(behind));
  judge("half of the scans at 80 m", half.trials > 0, half.value > 0.3 && half.value < 0.7,
        "70 to 90 m: " + text(half) + " (0.3 to 0.7 counts as half)");
  double detections = 0, tracks = 0, rear = 0;
  for (const DistanceBin& b : f.distance) {
    detections += b.false_detections, tracks += b.false_confirmed;
    if (b.middle_m > -90 && b.middle_m < -70) rear += b.false_detections;
  }
  judge("confirmed false tracks far rarer than false detections", true, tracks < detections / 3,
        cli::fixed(tracks, 2) + " against " + cli::fixed(detections, 2) + " per frame (a third counts as far)");
  judge("false detections lie mostly 70 to 90 m behind", detections > 0, rear > detections / 2,
        cli::fixed(100 * rear / detections, 0) + " % of them");
  const auto bias = [](const std::map<std::string, std::vector<double>>& errors, const char* name) {
    const auto found = errors.find(name);
    return found == errors.end() ? NAN : metrics::summarize(found->second).mean;
  };
  const double raw = bias(f.detection_errors, "y_veh_m"), tracked = bias(f.track_errors, "y_veh_m"),
               raw_x = bias(f.detection_errors, "x_veh_m"), tracked_x = bias(f.track_errors, "x_veh_m");
  judge("lateral error leans to the right (left turns only)", std::isfinite(raw), raw < 0,
        "mean " + cli::fixed(raw, 3) + " m");
  judge("tracks are less biased than detections, vehicle frame", std::isfinite(tracked),
        std::hypot(tracked, tracked_x) < std::hypot(raw, raw_x),
        "x " + cli::fixed(tracked_x, 3) + " against " + cli::fixed(raw_x, 3) + " m, y " + cli::fixed(tracked, 3) +
            " against " + cli::fixed(raw, 3) + " m");
  return "<h2>What the paper says</h2>\n" + table_html(rows);
}

std::string oracle_section(const std::vector<Figures>& all, const Figures& f) {
  std::vector<std::vector<std::string>> rows = {{"input", "detected", "MOTA", "HOTA", "GOSPA m", "x veh |p95|",
                                                 "y veh |p95|", "false det./frame", "false tracks/h"}};
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
  if (rows.size() < 3) return "";
  return "<h2>Oracles and controls</h2>\n" +
         paragraph(
             "ground: no ground point in the clouds; cars: only points of cars; ego: the true ego pose. What one of "
             "them gains is what that part costs. shuffled: rows of each scan in random order, may change nothing but "
             "the last digits; "
             "late_truth: truth of one period later, must hurt.") +
         table_html(rows);
}

}  // namespace

std::string format_report(const std::vector<Figures>& all, const std::vector<Run>& runs) {
  const Figures* main = nullptr;
  for (const Figures& f : all)
    if (f.contestant.find_first_of("@:") == std::string::npos && (!main || f.frames > main->frames)) main = &f;
  std::string html =
      "<!DOCTYPE html>\n<html lang=\"en\"><head><meta charset=\"utf-8\"><title>Overtake evaluation</title>\n<style>"
      "body{font-family:sans-serif;max-width:1000px;margin:2em auto;padding:0 1em}table{border-collapse:collapse;"
      "font-size:12px;margin:1em 0}td,th{border:1px solid #ccc;padding:2px 6px;text-align:right}td:first-child,"
      "th:first-child{text-align:left}svg{margin:4px}</style></head><body>\n<h1>Overtake evaluation</h1>\n";
  html +=
      paragraph("Everything here is simulated: race, sensors, localisation errors and truth (tools/sim/README.md).");
  std::vector<std::vector<std::string>> rows = {{"log", "contestants", "scenario", "seed", "ego", "frames", "note"}};
  std::map<std::string, std::pair<const Run*, int64_t>> of_log;
  for (const Run& run : runs) {
    auto& [first, count] = of_log[run.log];
    if (!first || run.contestant.find('@') == std::string::npos) first = &run;
    ++count;
  }
  for (const auto& [log, of_this_log] : of_log) {
    const auto& entry = of_this_log;  // a lambda captures no structured binding in clang 14
    const auto about = [&](const char* key) {
      const auto found = entry.first->about.find(key);
      return found == entry.first->about.end() ? std::string("-") : found->second;
    };
    const std::string damage = about("damage");
    rows.push_back({log, std::to_string(entry.second), about("scenario"), about("seed"), about("ego"), about("frames"),
                    damage == "-" || damage.empty() ? "" : "cut off: " + damage});
  }
  html += table_html(rows);
  if (!main) return html + "<p>No run of a preset as it is.</p></body></html>\n";
  html += paragraph("Figures: contestant " + main->contestant + " on scenario " + main->scenario + ", " +
                    std::to_string(main->runs) + " log(s), " + std::to_string(main->frames) + " frames, " +
                    cli::fixed(main->seconds, 0) + " s.");
  html += claims_section(*main) + ground_section(*main) + clustering_section(all, *main) + detection_section(*main) +
          error_section(*main) + time_section(*main) + oracle_section(all, *main) + scenario_table(all);
  return html + "</body></html>\n";
}

}  // namespace overtake::evaluation
