// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
#include "tools/evaluation/report.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <fstream>
#include <nlohmann/json.hpp>
#include <set>

#include "tools/client/console.h"
#include "tools/evaluation/differences.h"
#include "tools/evaluation/figures.h"
#include "tools/evaluation/kept_runs.h"
#include "tools/evaluation/measures_json.h"
#include "tools/evaluation/quality.h"
#include "tools/evaluation/report_html.h"
#include "tools/evaluation/report_pages.h"
#include "tools/evaluation/track_quality.h"
#include "tools/io/json_text.h"
#include "tools/io/text.h"

namespace overtake::evaluation {
namespace {

using Json = nlohmann::json;  // NaN is written as null

Json json_of(const metrics::Summary& s) {
  return {{"count", s.count}, {"mean", s.mean}, {"deviation", s.deviation},
          {"p5", s.p5},       {"p25", s.p25},   {"median", s.median},
          {"p75", s.p75},     {"p95", s.p95},   {"min", s.least},
          {"max", s.most}};
}
Json json_of(const metrics::Share& s) {
  return {{"hits", s.hits}, {"trials", s.trials}, {"value", s.value}, {"low", s.low}, {"high", s.high}};
}

Json json_of(const GroundFigures& g) {
  return {{"tpr", json_of(metrics::summarize(g.tpr))},
          {"ppv", json_of(metrics::summarize(g.ppv))},
          {"f1", json_of(metrics::summarize(g.f1))}};
}

Json json_of(const Figures& f) {
  Json j = {{"contestant", f.variant}, {"scenario", f.scenario}, {"runs", f.runs},
            {"frames", f.frames},      {"seconds", f.seconds},   {"gate_m", kGateM}};
  j["ground"] = json_of(f.ground);
  if (!f.grid.tpr.empty()) j["ground_grid_2_5d"] = json_of(f.grid);
  for (const auto& [range, points] : f.car_points)
    j["car_points_found"].push_back(
        {{"range_m", range}, {"points", points.first}, {"share", points.second / points.first}});
  j["clustering"] = {{"clusters_per_car", json_of(metrics::summarize(f.clusters_per_car))},
                     {"with_cluster", json_of(metrics::binomial_share(f.with_cluster.hits, f.with_cluster.trials))},
                     {"clusters_in_box_per_car", json_of(metrics::summarize(f.boxed_per_car))},
                     {"mixed_with_other", json_of(metrics::summarize(f.mixed_other))},
                     {"mixed_cars", json_of(metrics::summarize(f.mixed_cars))}};
  for (const DistanceBin& b : f.distance)
    j["distance"].push_back({{"middle_m", b.middle_m},
                             {"events", b.events},
                             {"detected", json_of(b.detected)},
                             {"confirmed", json_of(b.confirmed)},
                             {"false_detections_per_frame", b.false_detections},
                             {"false_confirmed_per_frame", b.false_confirmed}});
  for (const auto& [name, values] : f.detection_errors)
    j["detection_errors"][name] = json_of(metrics::summarize(values));
  for (const auto& [name, values] : f.track_errors) j["track_errors"][name] = json_of(metrics::summarize(values));
  const TrackFigures& t = f.tracks;
  j["tracking"] = {{"mota", t.mot.mota()},
                   {"motp_m", t.mot.motp_m()},
                   {"objects", t.mot.objects},
                   {"misses", t.mot.misses},
                   {"false_positives", t.mot.false_positives},
                   {"switches", t.mot.switches},
                   {"fragments", t.mot.fragments},
                   {"hota", t.hota.hota},
                   {"det_a", t.hota.detection},
                   {"ass_a", t.hota.association},
                   {"loc_a", t.hota.localisation},
                   {"gospa_m", json_of(t.gospa_m)},
                   {"time_to_confirm_s", json_of(t.time_to_confirm_s)},
                   {"longest_gap_s", json_of(t.longest_gap_s)},
                   {"data_age_s", json_of(t.data_age_s)},
                   {"nees", json_of(t.nees)},
                   {"nees_left_out", t.nees.left_out},
                   {"nees_consistent", {t.nees_low, t.nees_high}},
                   {"nis", json_of(t.nis)},
                   {"nis_consistent", {t.nis_low, t.nis_high}},
                   {"cars_seen", t.cars_seen},
                   {"never_confirmed", t.never_confirmed},
                   {"false_confirmed_tracks", t.false_tracks},
                   {"false_confirmed_tracks_per_hour", t.false_per_hour},
                   {"confirmed_seconds_at_no_car", t.false_s},
                   {"confirmed_seconds_at_no_car_per_hour", t.false_s_per_hour}};
  add_measures(f, j);
  return j;
}

void write_csvs(const std::string& out, const std::vector<Figures>& all) {
  std::string distance =
      "contestant,scenario,middle_m,frames,events,detected,detected_low,detected_high,confirmed,confirmed_low,"
      "confirmed_high,false_detections_per_frame,false_confirmed_per_frame\n";
  std::string errors = "contestant,scenario,of,error,count,mean,deviation,p5,p25,median,p75,p95\n";
  const auto put = [](std::string& text, const std::vector<double>& values) {
    for (const double v : values) text += ',', io::append_number(text, v);
    text += '\n';
  };
  for (const Figures& f : all) {
    for (const DistanceBin& b : f.distance) {
      distance += f.variant + "," + f.scenario;
      put(distance,
          {b.middle_m, double(b.detected.trials), double(b.events), b.detected.value, b.detected.low, b.detected.high,
           b.confirmed.value, b.confirmed.low, b.confirmed.high, b.false_detections, b.false_confirmed});
    }
    for (const bool is_track : {false, true})
      for (const auto& [name, values] : is_track ? f.track_errors : f.detection_errors) {
        const metrics::Summary s = metrics::summarize(values);
        errors += f.variant + "," + f.scenario + (is_track ? ",tracks," : ",detections,") + name;
        put(errors, {double(s.count), s.mean, s.deviation, s.p5, s.p25, s.median, s.p75, s.p95});
      }
  }
  io::write_whole_file(out + "/detection_by_distance.csv", distance);
  io::write_whole_file(out + "/errors.csv", errors);
}

}  // namespace

std::string cpu_name() {
  std::ifstream info("/proc/cpuinfo");
  for (std::string line; std::getline(info, line);)
    if (line.rfind("model name", 0) == 0) return line.substr(line.find(':') + 2);
  return "unknown CPU";
}

void check_report(io::OutputGuard& guard, const std::string& out) {
  for (const char* name : {"metrics.json", "times.json", "report.html", "errors.csv", "detection_by_distance.csv"})
    guard.check(out + "/" + name);
}

void write_report(const std::string& out, bool print) {
  const std::vector<Run> runs = read_runs(out);
  const std::vector<Figures> all = make_figures(runs);
  Json metrics, times;
  const Origin origin = origin_of(runs);
  metrics["simulated"] = origin == Origin::kMixed ? Json("some") : Json(origin == Origin::kSimulated);
  metrics["figures"] = Json::array();
  metrics["judgements"] = judgements_json(all);
  for (const Run& run : runs)
    metrics["runs"].push_back({{"contestant", run.variant}, {"log", run.log}, {"about", portable(run.about)}});
  std::set<std::string> cpus;  // of the runs: the reporting machine may be another one
  for (const Figures& f : all) cpus.insert(f.cpus.begin(), f.cpus.end());
  times["cpu"] = io::join({cpus.begin(), cpus.end()}, ", ");
  const std::vector<Quality> quality = find_quality(runs);
  metrics["quality"] = Json::array();
  for (const Quality& q : quality) {
    metrics["quality"].push_back(json_of(q));
    metrics["quality"].back()["contestant"] = q.variant, metrics["quality"].back()["scenario"] = q.scenario;
  }
  const std::vector<TrackQuality> tracks = find_track_quality(runs);
  metrics["track_quality"] = Json::array();
  for (const TrackQuality& q : tracks) {
    metrics["track_quality"].push_back(json_of(q));
    metrics["track_quality"].back()["contestant"] = q.variant, metrics["track_quality"].back()["scenario"] = q.scenario;
  }
  const Differences differences = find_differences(runs);
  if (differences.contestants.size() > 1) metrics["differences"] = json_of(differences);
  for (const Figures& f : all) {
    metrics["figures"].push_back(json_of(f));
    for (const auto& [stage, values] : f.times_ms)
      times["times_ms"][f.variant][f.scenario][stage] = json_of(metrics::summarize(values));
  }
  for (const Figures& f : all) times["summary"][f.variant][f.scenario] = times_json(f);
  add_measured(out, metrics, times);
  io::write_whole_file(out + "/metrics.json", io::dump_json(metrics, 1) + "\n");
  io::write_whole_file(out + "/times.json",
                       io::dump_json(times, 1) + "\n");  // a separate file: times differ in every run
  write_csvs(out, all);
  std::vector<std::string> folders;
  for (const Run& run : runs) folders.push_back(run.folder);
  auto pictures = best_pictures(folders);
  io::write_whole_file(out + "/report.html", format_report(all, runs, quality, tracks, differences, pictures, out));
  if (const Figures* main = main_figures(all)) pictures["detection"].svg = detection_plot(*main);
  cli::make_folder(out + "/pictures");
  for (const auto& [name, picture] : pictures) io::write_whole_file(out + "/pictures/" + name + ".svg", picture.svg);
  if (!print) return;
  cli::TextTable table({"variant", "scenario", "frames", "TPR", "F1", "clusters/car", "MOTA", "HOTA", "GOSPA m",
                        "confirm s", "false/h", "at no car s/h", "switches"});
  for (const Figures& f : all) {
    if (f.variant.find('@') != std::string::npos) continue;
    const TrackFigures& t = f.tracks;
    table.add({f.variant, f.scenario, std::to_string(f.frames), cli::fixed(metrics::summarize(f.ground.tpr).mean, 3),
               cli::fixed(metrics::summarize(f.ground.f1).mean, 3),
               cli::fixed(metrics::summarize(f.clusters_per_car).mean, 2), cli::fixed(t.mot.mota(), 3),
               cli::fixed(t.hota.hota, 3), cli::fixed(t.gospa_m.mean, 2), cli::fixed(t.time_to_confirm_s.median, 2),
               cli::fixed(t.false_per_hour, 0), cli::fixed(t.false_s_per_hour, 1), std::to_string(t.mot.switches)});
  }
  std::printf("%s", table.format().c_str());
  print_quality(quality);
  print_track_quality(tracks, main_scenario(quality));
  print_differences(differences);
  std::printf("\n%s Written to %s: report.html metrics.json times.json detection_by_distance.csv errors.csv runs/\n",
              origin == Origin::kSimulated  ? "All of it simulated."
              : origin == Origin::kRecorded ? "All of it recorded."
                                            : "Some of it simulated, some recorded: each run's about.json says which.",
              out.c_str());
}

}  // namespace overtake::evaluation
