// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// The paper's result figures.
#include "tools/evaluation/report_html.h"
#include "tools/evaluation/report_pages.h"

#include <algorithm>
#include <cmath>
#include <tuple>

#include "tools/client/console.h"
#include "tools/evaluation/baselines/grid_ground.h"
#include "tools/evaluation/svg_plot.h"
#include "tools/io/angles.h"
#include "tools/io/text.h"

namespace overtake::evaluation {

namespace {

constexpr baselines::GridGroundParams kGrid;
constexpr int32_t kFewPoints = 100;  // a share of fewer has no meaning

// Names the frames of results that are measured on some frames only.
std::string some_frames(const Figures& f) {
  if (f.every == std::set<std::string>{"1"}) return "every frame";
  return "one frame in " + (f.every.empty() ? "some" : io::join({f.every.begin(), f.every.end()}, " or ")) +
         " (--every)";
}

}  // namespace

std::string ground_section(const Figures& f) {
  std::string html =
      heading("ground", "Ground removal") +
      paragraph(
          (f.surface_known
               ? std::string("A scan of one sensor a value; positive is non-ground by the simulator's truth; smoke, "
                             "blooming and the own car count as ground. Points without a label (second returns, dust) "
                             "are left out for both. ")
               : std::string("By truth not measured: no log says what each point lies on. A scan of one sensor a "
                             "value. ")) +
          "The grid (Himmelsbach 2009: cells of " + cli::fixed(kGrid.cell_m, 2) +
          " m, non-ground where the points of "
          "a cell differ by more than " +
          cli::fixed(kGrid.height_m, 1) +
          " m in height; tuned on the tune seeds) is "
          "run on all sensors' points at once; a value a scan, " +
          some_frames(f) +
          ". Shape: 5th to 95th percentile; "
          "thick line: quartiles; circle: median; red: mean.");
  const auto plot = [&](const char* title, const std::vector<double>& ours, const std::vector<double>& grid) {
    return violin_plot({title, "", "share, a value a scan", 0, 0, 0, 0, 310, 320},
                       {{"proposed", kBlue, ours}, {"2.5-D grid", kOrange, grid}});
  };
  if (f.surface_known)
    html += plot("TPR", f.ground.tpr, f.grid.tpr) + plot("PPV", f.ground.ppv, f.grid.ppv) +
            plot("F1", f.ground.f1, f.grid.f1);
  if (!f.ground_auto.tpr.empty()) {
    html += paragraph(
        std::string(f.surface_known ? "The same against" : "Against") +
        " the paper's automatic labels (normals of fitted planes, threshold, nearest neighbours), " + some_frames(f) +
        "." +
        (f.auto_label.tpr.empty()
             ? std::string()
             : " The labels themselves against the truth: TPR " + mean_and_deviation(f.auto_label.tpr, 3) + ", PPV " +
                   mean_and_deviation(f.auto_label.ppv, 3) + ", F1 " + mean_and_deviation(f.auto_label.f1, 3) + "."));
    html += plot("TPR, automatic labels", f.ground_auto.tpr, f.grid_auto.tpr) +
            plot("PPV, automatic labels", f.ground_auto.ppv, f.grid_auto.ppv) +
            plot("F1, automatic labels", f.ground_auto.f1, f.grid_auto.f1);
  }
  Series share{"found to be non-ground", kBlue, {}, {}, {}, {}, true, false};
  for (const auto& [range, points] : f.car_points) {
    if (range >= 150 || points.first < kFewPoints) continue;
    share.x.push_back(range + 5), share.y.push_back(points.second / points.first);
  }
  if (!share.x.empty())
    html += line_plot(
                {"TPR on the points of cars alone", "range [m]", "share", 0, 150, 0, 1.0, 640, 280, false, false, true},
                {share}) +
            paragraph("Bins of 10 m; those with fewer than " + std::to_string(kFewPoints) + " points are left out.");
  return html;
}

namespace {

Series curve(const char* color) { return {"", color, {}, {}, {}, {}, true, true}; }

void add_to(Series& s, double x, const std::vector<double>& values) {
  const metrics::Summary of = metrics::summarize(values);
  if (of.count == 0) return;
  s.x.push_back(x), s.y.push_back(of.mean);
  s.low.push_back(std::max(0.0, of.mean - of.deviation)), s.high.push_back(of.mean + of.deviation);
}

using ByFrame = std::vector<double> Figures::*;
using ByRadius = std::map<double, std::vector<double>> Figures::*;

// Both methods on one scale, each against its own parameter. "": nothing was measured.
std::string clustering_plots(const std::vector<Figures>& all, const Figures& f, const std::string& title,
                             const char* y_label, ByFrame ours_of, ByRadius theirs_of) {
  Series ours = curve(kBlue), theirs = curve(kOrange);
  const std::string prefix = f.variant + "@cluster.threshold_deg=";
  std::map<double, const Figures*> sweep;
  for (const Figures& g : all)
    if (g.scenario == f.scenario && g.variant.rfind(prefix, 0) == 0)
      sweep[std::stod(g.variant.substr(prefix.size()))] = &g;
  for (const auto& [angle, g] : sweep) add_to(ours, angle, g->*ours_of);
  for (const auto& [radius, values] : f.*theirs_of) add_to(theirs, radius, values);
  double high = 0;
  for (const Series* s : {&ours, &theirs})
    for (const double v : s->high) high = std::max(high, v);
  if (high == 0) high = 1;  // no mixed cluster at all: a flat line is right
  std::string plots;
  for (const auto& [s, of, x_label] :
       {std::tuple(&ours, ": proposed", "th_seg [deg]"), std::tuple(&theirs, ": Euclidean", "clustering radius [m]")})
    if (!s->x.empty())
      plots += line_plot({title + of, x_label, y_label, 0, 1.05 * s->x.back(), 0, 1.08 * high, 484, 290}, {*s});
  return plots;
}

// The scenario with the most opponents at once; null: none has two cars with known points.
const Figures* crowded(const std::vector<Figures>& all, const std::string& variant) {
  const Figures* most = nullptr;
  for (const Figures& g : all)
    if (g.variant == variant && g.most_cars > 1 && g.surface_known && (!most || g.most_cars > most->most_cars))
      most = &g;
  return most;
}

// Clusters with points of two cars. If no method made any, a sentence replaces the empty plots.
std::string two_cars(const std::vector<Figures>& all, const Figures& many) {
  const std::string where = "in scenario " + many.scenario + " (" + std::to_string(many.most_cars) +
                            " opponents at once, " + cli::fixed(many.closest_cars_m, 1) +
                            " m or more between their middles)";
  const auto any = [](const std::vector<double>& counts) {
    return std::any_of(counts.begin(), counts.end(), [](double c) { return c > 0; });
  };
  const bool is_seen =
      std::any_of(all.begin(), all.end(),
                  [&](const Figures& g) {
                    return g.scenario == many.scenario && g.variant.rfind(many.variant, 0) == 0 && any(g.mixed_cars);
                  }) ||
      std::any_of(many.euclid_mixed_cars.begin(), many.euclid_mixed_cars.end(),
                  [&](const auto& of_radius) { return any(of_radius.second); });
  if (!is_seen)
    return paragraph("Two cars in one cluster, by truth, " + where +
                     ": none, by either method, at no th_seg and no "
                     "radius tried.");
  return paragraph("Two cars in one cluster, by truth, " + where + ":") +
         clustering_plots(all, many, "(e) Two cars in one", "clusters a frame", &Figures::mixed_cars,
                          &Figures::euclid_mixed_cars);
}

}  // namespace

std::string clustering_section(const std::vector<Figures>& all, const Figures& f) {
  std::string html =
      heading("clustering", "Clustering") +
      paragraph(
          "Bars are one standard deviation either way, down to 0 at most. Euclidean clustering (own "
          "implementation of PCL's rule) on the points the pipeline found to be non-ground. All curves: " +
          some_frames(f) + ".");
  if (f.surface_known)
    html += paragraph("By truth: cars with " + std::to_string(kMinCarPoints) +
                      " points or more; a mixed cluster holds points of a car and of a wall, fence or any other "
                      "obstacle; a value a frame with a car.") +
            clustering_plots(all, f, "(a) Clusters per car", "clusters", &Figures::clusters_per_car,
                             &Figures::euclid_clusters) +
            clustering_plots(all, f, "(b) Mixed with other", "clusters a frame", &Figures::mixed_other,
                             &Figures::euclid_mixed);
  else
    html += paragraph("By truth not measured: no log says what each point lies on. Cars up to " +
                      cli::fixed(kNearCarM, 0) + " m away count.");
  html += paragraph(
              "By the paper's rule: clusters wholly inside the car's box made 1 m larger on each side; a mixed "
              "one has a point at the car and is longer than a car with 10 % slack.") +
          clustering_plots(all, f, "(c) Clusters in a car's box", "clusters", &Figures::boxed_per_car,
                           &Figures::euclid_boxed) +
          clustering_plots(all, f, "(d) Longer than a car", "clusters a frame", &Figures::mixed_by_size,
                           &Figures::euclid_mixed_by_size);
  const Figures* many = crowded(all, f.variant);
  html += many ? two_cars(all, *many) : paragraph("Two cars in one cluster: no log with two opponents at once.");
  const std::string prefix = f.variant + "@cluster.threshold_deg=";
  if (std::none_of(all.begin(), all.end(), [&](const Figures& g) { return g.variant.rfind(prefix, 0) == 0; }))
    html += paragraph("No sweep of th_seg was run: give --sweep cluster.threshold_deg=1:10:1.5.");
  html += paragraph("All frames, preset as it is:");
  Rows rows = {{"scenario", "clusters per car, by truth", "mixed with other", "two cars in one",
                "clusters in a car's box", "longer than a car"}};
  for (const Figures* g : {&f, many == &f ? nullptr : many})
    if (g)
      rows.push_back({g->scenario, mean_and_deviation(g->clusters_per_car, 2), mean_and_deviation(g->mixed_other, 3),
                      g->most_cars > 1 ? mean_and_deviation(g->mixed_cars, 3) : "one car at a time",
                      mean_and_deviation(g->boxed_per_car, 2), mean_and_deviation(g->mixed_by_size, 3)});
  return html + table_html(rows);
}

std::string detection_plot(const Figures& f) {
  Series detected{"detected", kGreen, {}, {}, {}, {}, true, false},
      confirmed{"confirmed track", kPurple, {}, {}, {}, {}, true, false};
  for (const DistanceBin& b : f.distance) {
    detected.x.push_back(b.middle_m), detected.y.push_back(b.detected.value);
    detected.low.push_back(b.detected.low), detected.high.push_back(b.detected.high);
    confirmed.x.push_back(b.middle_m), confirmed.y.push_back(b.confirmed.value);
    confirmed.low.push_back(b.confirmed.low), confirmed.high.push_back(b.confirmed.high);
  }
  return line_plot({"Probability of detection and of a confirmed track (" + words_of(f.origin) + ")",
                    "longitudinal distance [m]", "share", kNearestM, kFarthestM, 0, 1, 860, 320, false, true},
                   {detected, confirmed});
}

std::string detection_section(const Figures& f) {
  Series false_detected{"false detections", kGreen, {}, {}, {}, {}, true, false},
      false_confirmed{"false confirmed tracks", kPurple, {}, {}, {}, {}, true, false};
  std::vector<std::vector<std::string>> rows = {{"distance m", "frames", "events", "detected", "95 %", "confirmed",
                                                 "95 %", "false det./frame", "false tracks/frame"}};
  const auto percent = [](double v) { return cli::fixed(100 * v, 0); };
  for (const DistanceBin& b : f.distance) {
    false_detected.x.push_back(b.middle_m), false_detected.y.push_back(b.false_detections);
    false_confirmed.x.push_back(b.middle_m), false_confirmed.y.push_back(b.false_confirmed);
    rows.push_back({cli::fixed(b.middle_m - kBinM / 2, 0) + " to " + cli::fixed(b.middle_m + kBinM / 2, 0),
                    std::to_string(b.detected.trials), std::to_string(b.events), percent(b.detected.value) + " %",
                    percent(b.detected.low) + ".." + percent(b.detected.high), percent(b.confirmed.value) + " %",
                    percent(b.confirmed.low) + ".." + percent(b.confirmed.high), cli::fixed(b.false_detections, 3),
                    cli::fixed(b.false_confirmed, 3)});
  }
  return heading("detection", "Detection") +
         paragraph(
             "Against the longitudinal distance of the car, ahead positive, bins of 10 m. A detection or a confirmed "
             "track counts within " +
             cli::fixed(kGateM, 1) +
             " m of the car's true centre; everything else is false. Bands: 95 % by drawing the overtaking events "
             "again with replacement (Wilson's interval where there is one event).") +
         detection_plot(f) +
         line_plot({"False positives per frame", "longitudinal distance [m]", "per frame and 10 m", kNearestM,
                    kFarthestM, 0, 0, 860, 280, false, false, true},
                   {false_detected, false_confirmed}) +
         "<details><summary>counts</summary>" + table_html(rows) + "</details>\n";
}

std::string error_section(const Figures& f) {
  struct Shown {
    const char *column, *title;
    double scale;
  };
  static constexpr Shown kKinds[] = {{"x_map_m", "x, map [m]", 1},
                                     {"y_map_m", "y, map [m]", 1},
                                     {"x_veh_m", "x, vehicle [m]", 1},
                                     {"y_veh_m", "y, vehicle [m]", 1},
                                     {"heading_rad", "heading [deg]", io::deg(1)},
                                     {"course_rad", "course [deg]", io::deg(1)},
                                     {"speed_mps", "speed [m/s]", 1},
                                     {"yaw_rate_rps", "yaw rate [deg/s]", io::deg(1)}};
  std::string html =
      heading("errors", "Pose and tracking") +
      paragraph(
          "Estimate minus truth of those within " + cli::fixed(kGateM, 1) +
          " m of a car: raw detections at their own stamp, confirmed tracks at publish time, the end of the sweep "
          "(one period behind the frame's first stamp). Vehicle frame: the map error turned into the true ego's axes. "
          "Shown from the 5th to the 95th percentile; thick line: quartiles, circle: median, red: mean.");
  std::vector<std::vector<std::string>> rows = {
      {"error", "of", "count", "mean (bias)", "deviation", "p5", "p25", "median", "p75", "p95"}};
  for (const Shown& kind : kKinds) {
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
    if (!violins.empty()) html += violin_plot({kind.title, "", "error", 0, 0, 0, 0, 238, 300}, violins);
  }
  return html + table_html(rows);
}

std::string time_section(const Figures& f) {
  static constexpr const char* kStages[] = {"load",   "project", "gaps",  "angle",    "smooth",  "ground",
                                            "repair", "link",    "label", "clusters", "segment", "merge",
                                            "gate",   "pose",    "track", "frame"};
  const auto of = [&](const char* stage) {
    const auto found = f.times_ms.find(stage);
    return metrics::summarize(found == f.times_ms.end() ? std::vector<double>() : found->second);
  };
  const metrics::Summary frame = of("frame"), segment = of("segment");
  Rows rows = {{"stage", "of", "count", "mean ms", "p5", "median", "p95", "max", "median / frame"}};
  for (const char* stage : kStages) {
    const metrics::Summary s = of(stage);
    if (s.count == 0) continue;
    const bool of_scan = s.count > frame.count;
    rows.push_back({stage, of_scan ? "a scan" : "a frame", std::to_string(s.count), cli::fixed(s.mean, 3),
                    cli::fixed(s.p5, 3), cli::fixed(s.median, 3), cli::fixed(s.p95, 3), cli::fixed(s.most, 3),
                    cli::fixed(100 * s.median / frame.median, 0) + " %"});
  }
  std::string plots;
  for (const char* stage : {"segment", "merge", "gate", "pose", "track", "frame"})
    if (const auto found = f.times_ms.find(stage); found != f.times_ms.end())
      plots += violin_plot({stage, "", "time [ms]", 0, 0, 0, 0, 156, 280},
                           {{of(stage).count > frame.count ? "a scan" : "a frame", kBlue, found->second}});
  const double scans = frame.count > 0 ? double(segment.count) / double(frame.count) : NAN;
  return heading("times", "Times") +
         paragraph(
             "On " + io::join({f.cpus.begin(), f.cpus.end()}, ", ") +
             ", one worker, while other work ran beside it: medians say more than means, and each module has a "
             "scale of its own. A median frame (" +
             cli::fixed(scans, 0) + " scans one after the other) takes " + cli::fixed(frame.median, 2) + " ms (mean " +
             cli::fixed(frame.mean, 2) + "), of which segmentation is " +
             cli::fixed(100 * scans * segment.median / frame.median, 0) + " %; " + cli::fixed(1000 / frame.median, 0) +
             " frames a second could be done where the sensors give 20. The paper: 26 ms on a 2.0 GHz Xeon, three "
             "sensors side by side, 38 Hz.") +
         plots + table_html(rows);
}

}  // namespace overtake::evaluation
