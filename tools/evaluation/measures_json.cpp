// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
#include "tools/evaluation/measures_json.h"

#include <filesystem>
#include <nlohmann/json.hpp>
#include <tuple>

#include "tools/evaluation/paper_claims.h"
#include "tools/io/error.h"
#include "tools/io/text.h"

namespace overtake::evaluation {
namespace {

using Json = nlohmann::json;

Json brief(const std::vector<double>& values) {
  const metrics::Summary s = metrics::summarize(values);
  return {{"count", s.count}, {"mean", s.mean},     {"deviation", s.deviation},
          {"p5", s.p5},       {"median", s.median}, {"p95", s.p95}};
}
Json brief(const GroundFigures& g) { return {{"tpr", brief(g.tpr)}, {"ppv", brief(g.ppv)}, {"f1", brief(g.f1)}}; }

Json json_of_claim(const Claim& c) {
  Json numbers = Json::object();
  for (const Number& n : c.numbers) numbers[n.name] = n.value;
  Json j = {{"name", c.name}, {"claim", c.text}, {"numbers", numbers}};
  j["verdict"] = c.known ? (c.holds ? "holds" : "does not hold") : "not measured";
  return j;
}

Json json_of_cost(const Cost& c) {
  return {{"oracle", c.oracle},
          {"against", c.against},
          {"gospa_square_saved_m2", c.gospa_m2},
          {"of_it_localisation_m2", c.located_m2},
          {"of_it_missed_m2", c.missed_m2},
          {"of_it_false_m2", c.false_m2},
          {"hota_20s_gained", c.hota},
          {"detected_gained", c.detected},
          {"false_confirmed_tracks_per_hour_saved", c.false_per_hour},
          {"track_heading_error_saved_deg", c.heading_deg}};
}

}  // namespace

void add_measures(const Figures& f, Json& entry) {
  if (!f.auto_label.tpr.empty()) entry["auto_label_against_truth"] = brief(f.auto_label);
  if (!f.ground_auto.tpr.empty()) entry["ground_by_auto_label"] = brief(f.ground_auto);
  if (!f.grid_auto.tpr.empty()) entry["ground_grid_2_5d_by_auto_label"] = brief(f.grid_auto);
  entry["clustering"]["mixed_by_size"] = brief(f.mixed_by_size);
  const auto at = [](const std::map<double, std::vector<double>>& of, double radius) {
    const auto found = of.find(radius);
    return brief(found == of.end() ? std::vector<double>() : found->second);
  };
  if (!f.euclid_boxed.empty()) {
    entry["euclidean"] = Json::array();
    for (const auto& [radius, boxed] : f.euclid_boxed)
      entry["euclidean"].push_back({{"radius_m", radius},
                                    {"clusters_per_car", at(f.euclid_clusters, radius)},
                                    {"clusters_in_box_per_car", brief(boxed)},
                                    {"mixed_with_other", at(f.euclid_mixed, radius)},
                                    {"mixed_cars", at(f.euclid_mixed_cars, radius)},
                                    {"mixed_by_size", at(f.euclid_mixed_by_size, radius)}});
  }
  entry["over_seams"] = {{"cars", f.seams.trials}, {"in_one_cluster", f.seams.hits}};
  entry["lateral_error_in_left_turns_m"] = brief(f.across_in_left_turns);
  entry["lateral_error_elsewhere_m"] = brief(f.across_elsewhere);
  const TrackFigures& t = f.tracks;
  Json& tracking = entry["tracking"];
  tracking["hota_20s"] = {{"hota", t.hota_window.hota},
                          {"det_a", t.hota_window.detection},
                          {"ass_a", t.hota_window.association},
                          {"loc_a", t.hota_window.localisation}};
  tracking["hota_zero_m"] = kGateM;
  tracking["false_positives_at_a_car"] = t.doubles;
  for (const auto& [name, share] : {std::pair("nees_in_95_bounds", &t.nees_inside),
                                    {"nis_in_95_bounds", &t.nis_inside},
                                    {"nis_own_covariance_in_95_bounds", &t.nis_own_inside}})
    tracking[name] = {{"hits", share->hits}, {"trials", share->trials}, {"value", share->value}};
  tracking["nis_own_covariance"] = {{"count", t.nis_own.count}, {"mean", t.nis_own.mean}, {"median", t.nis_own.median}};
  tracking["gospa_square_m2"] = {
      {"localisation", t.gospa_located_m2}, {"missed", t.gospa_missed_m2}, {"false", t.gospa_false_m2}};
}

Json judgements_json(const std::vector<Figures>& all) {
  Json out = Json::array();
  for (const Figures& f : all) {
    if (f.variant.find_first_of(":@") != std::string::npos) continue;
    Json j = {{"preset", f.variant}, {"scenario", f.scenario}};
    for (const Claim& c : check_claims(f, all)) j["claims"].push_back(json_of_claim(c));
    for (const Cost& c : find_costs(f, all)) j["costs"].push_back(json_of_cost(c));
    for (const Claim& c : check_controls(f, all)) j["controls"].push_back(json_of_claim(c));
    out.push_back(std::move(j));
  }
  return out;
}

nlohmann::json times_json(const Figures& f) {
  const auto sum = [&](const char* stage) {
    const auto at = f.times_ms.find(stage);
    double total = 0;
    if (at != f.times_ms.end())
      for (const double v : at->second) total += v;
    return total;
  };
  const auto frame = f.times_ms.find("frame");
  if (frame == f.times_ms.end()) return nullptr;
  const metrics::Summary s = metrics::summarize(frame->second);
  return {{"frame_ms", brief(frame->second)},
          {"frames_per_second", 1000 / s.mean},
          {"segmentation_share", sum("segment") / sum("frame")}};  // with one worker: the sensors one after the other
}

void add_measured(const std::string& out, nlohmann::json& metrics, nlohmann::json& times) {
  for (const auto& [file, to, key] :
       {std::tuple("recordings.json", &metrics, "recordings"), std::tuple("scaling.json", &times, "scaling")}) {
    const std::string path = out + "/" + file;
    if (!std::filesystem::exists(path)) continue;
    try {
      (*to)[key] = Json::parse(io::read_whole_file(path));
    } catch (const Json::exception& error) {
      throw io::Error(path, 0, error.what());
    }
  }
}

}  // namespace overtake::evaluation
