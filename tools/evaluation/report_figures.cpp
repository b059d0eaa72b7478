// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// The paper's result figures.
#include "tools/evaluation/report_html.h"
#include "tools/evaluation/report_pages.h"

#include <algorithm>
#include <cmath>

#include "tools/console.h"
#include "tools/evaluation/svg_plot.h"
#include "tools/io/text.h"

namespace overtake::evaluation {

std::string ground_section(const Figures& f) {
  std::string html =
      heading("ground", "Ground removal") +
      paragraph(
          "A scan of one sensor a value; positive is non-ground by the simulator's truth; smoke and "
          "blooming count as ground. Points without a label (second returns, dust) are left out for "
          "both. The grid (Himmelsbach 2009, tuned on the tune seed, see README) is run on all sensors' points at "
          "once; a value a scan of some frames (--every). Shape: 5th to 95th percentile; thick line: quartiles; "
          "circle: median; red: mean.");
  const auto plot = [&](const char* title, const std::vector<double>& ours, const std::vector<double>& grid) {
    return violin_plot({title, "", "share, a value a scan", 0, 0, 0, 0, 310, 320},
                       {{"proposed", kBlue, ours}, {"2.5-D grid", kOrange, grid}});
  };
  html += plot("TPR", f.ground.tpr, f.grid.tpr) + plot("PPV", f.ground.ppv, f.grid.ppv) +
          plot("F1", f.ground.f1, f.grid.f1);
  if (!f.ground_auto.tpr.empty()) {
    html += paragraph(
        "The same against the paper's automatic labels (normals of fitted planes, threshold, nearest neighbours), "
        "some frames (--every). The labels themselves against the truth: TPR " +
        mean_and_deviation(f.auto_label.tpr, 3) + ", PPV " + mean_and_deviation(f.auto_label.ppv, 3) + ", F1 " +
        mean_and_deviation(f.auto_label.f1, 3) + ".");
    html += plot("TPR, automatic labels", f.ground_auto.tpr, f.grid_auto.tpr) +
            plot("PPV, automatic labels", f.ground_auto.ppv, f.grid_auto.ppv) +
            plot("F1, automatic labels", f.ground_auto.f1, f.grid_auto.f1);
  }
  Series share{"found to be non-ground", kBlue, {}, {}, {}, {}, true, false};
  for (const auto& [range, points] : f.car_points) {
    if (range >= 150) continue;
    share.x.push_back(range + 5), share.y.push_back(points.second / points.first);
  }
  html += line_plot({"TPR on the points of cars alone", "range [m]", "share", 0, 150, 0, 1.0, 640, 280}, {share});
  return html;
}

std::string clustering_section(const std::vector<Figures>& all, const Figures& f) {
  std::string html =
      heading("clustering", "Clustering") +
      paragraph("Cars with " + std::to_string(kMinCarPoints) +
                " points or more; bars are one standard deviation either way, down to 0 at most. Mixed: a cluster that "
                "holds points of a "
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
    s.low.push_back(std::max(0.0, of.mean - of.deviation)), s.high.push_back(of.mean + of.deviation);
  };
  for (const Figures* g : sweep) add(clusters, angle(g), g->clusters_per_car), add(mixed, angle(g), g->mixed_other);
  Series euclid{"Euclidean", kOrange, {}, {}, {}, {}, true, true}, euclid_mixed = euclid;
  for (const auto& [radius, values] : f.euclid_clusters) add(euclid, radius, values);
  for (const auto& [radius, values] : f.euclid_mixed) add(euclid_mixed, radius, values);
  const auto reach = [](const Series& of) {  // of x, from 0 on
    return std::pair(0.0, of.x.empty() ? 1.0 : 1.05 * *std::max_element(of.x.begin(), of.x.end()));
  };
  // Both methods on one scale, each against its own parameter.
  const auto pair = [&](const std::string& title, const std::string& y_label, const Series& ours,
                        const Series& theirs) {
    double low = 0, high = 0;
    for (const Series* s : {&ours, &theirs})
      for (std::size_t i = 0; i < s->y.size(); ++i) {
        if (std::isfinite(s->low[i])) low = std::min(low, s->low[i]);
        if (std::isfinite(s->high[i])) high = std::max(high, s->high[i]);
      }
    high += 0.08 * (high - low);
    std::string plots;
    if (!ours.x.empty())
      plots += line_plot(
          {title + ": proposed", "th_seg [deg]", y_label, reach(ours).first, reach(ours).second, low, high, 484, 290},
          {ours});
    return plots + line_plot({title + ": Euclidean", "clustering radius [m]", y_label, reach(theirs).first,
                              reach(theirs).second, low, high, 484, 290},
                             {theirs});
  };
  html += pair("(a) Clusters per car", "clusters", clusters, euclid);
  html += pair("(b) Mixed clusters", "clusters a frame", mixed, euclid_mixed);
  if (sweep.empty()) html += paragraph("No sweep of th_seg was run: give --sweep cluster.threshold_deg=1:10:1.5.");
  html += paragraph(
      "All frames, preset as it is: clusters per car " + mean_and_deviation(f.clusters_per_car, 2) +
      "; wholly inside the car's box made 1 m larger (the paper's rule) " + mean_and_deviation(f.boxed_per_car, 2) +
      "; mixed with other " + mean_and_deviation(f.mixed_other, 3) + ", by the paper's rule (larger than a car) " +
      mean_and_deviation(f.mixed_by_size, 3) + "; two cars in one " + mean_and_deviation(f.mixed_cars, 3) + ".");
  return html;
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
  return line_plot({"Probability of detection and of a confirmed track (simulated)", "longitudinal distance [m]",
                    "share", kNearestM, kFarthestM, 0, 1, 860, 320, false, true},
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
                    kFarthestM, 0, 0, 860, 280},
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
                                     {"heading_rad", "heading [deg]", kDegrees},
                                     {"course_rad", "course [deg]", kDegrees},
                                     {"speed_mps", "speed [m/s]", 1},
                                     {"yaw_rate_rps", "yaw rate [deg/s]", kDegrees}};
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
