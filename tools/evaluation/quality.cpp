// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
#include "tools/evaluation/quality.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <nlohmann/json.hpp>
#include <set>

#include "tools/evaluation/evaluator.h"
#include "tools/evaluation/figures_parts.h"
#include "tools/evaluation/numbers.h"
#include "tools/evaluation/run_tallies.h"
#include "tools/io/angles.h"
#include "tools/sim/material.h"

namespace overtake::evaluation {
namespace {

constexpr double kIn95 = 5.991464547107979;  // chi-square, 2 degrees of freedom
constexpr int32_t kLeastPoints[2] = {3, 5};
constexpr double kLapPieceM = 200, kNever = std::numeric_limits<double>::infinity();

double share_of(int64_t hits, int64_t trials) { return trials > 0 ? double(hits) / double(trials) : kNan; }

// "lo to hi" of the piece that holds the value; `ends` in rising order.
std::string piece_of(double value, const std::vector<int32_t>& ends, const char* unit) {
  int32_t from = 0;
  for (const int32_t end : ends) {
    if (value < end) return std::to_string(from) + " to " + std::to_string(end) + unit;
    from = end;
  }
  return "from " + std::to_string(from) + unit;
}

// The first frame after the ego has driven the length of the map; infinite where there is none.
double first_frame_of_second_lap(const Run& run) {
  const auto lap = run.about.find("lap_m");
  if (lap == run.about.end()) return kNever;
  const Table& ego = run.tables.at("ego");
  const auto frame = column_of(ego, "frame"), time = column_of(ego, "time_s"), speed = column_of(ego, "speed_mps");
  double left_m = std::stod(lap->second);
  for (std::size_t i = 1; i < frame.size(); ++i) {
    left_m -= speed[i - 1] * (time[i] - time[i - 1]);
    if (left_m <= 0) return frame[i];
  }
  return kNever;
}

// Sums over the runs of one variant.
class Tally {
 public:
  void add(const Run& run);
  Quality finish() const;

 private:
  void add_cars(const Run& run);
  void add_clusters(const Run& run);
  void add_false(const Run& run);

  Quality sum_;
  std::vector<metrics::Group> events_;
  std::vector<double> tpr_, ppv_, f1_, along_, across_;
  std::array<double, 2> heading_squares_ = {}, heading_count_ = {};
  int64_t inside_ = 0, with_ellipse_ = 0, runs_ = 0;
  double clusters_ = 0, with_cluster_ = 0, mixed_ = 0, near_false_ = 0, anywhere_ = 0, without_car_ = 0;
};

void Tally::add(const Run& run) {
  ++runs_;
  sum_.by_distance.resize(std::size_t(std::ceil((kFarthestM - kNearestM) / kQualityBinM)));
  sum_.frames += int64_t(run.tables.at("clusters").rows());
  add_cars(run);
  add_clusters(run);
  add_false(run);
  const Table& scans = run.tables.at("scans");
  const auto tp = column_of(scans, "tp"), fp = column_of(scans, "fp"), fn = column_of(scans, "fn");
  for (std::size_t i = 0; i < tp.size(); ++i) {
    if (tp[i] + fn[i] > 0) tpr_.push_back(tp[i] / (tp[i] + fn[i]));
    if (tp[i] + fp[i] > 0) ppv_.push_back(tp[i] / (tp[i] + fp[i]));
    if (tp[i] + fp[i] + fn[i] > 0) f1_.push_back(2 * tp[i] / (2 * tp[i] + fp[i] + fn[i]));
  }
  const Table& debris = run.tables.at("debris");
  const auto debris_points = column_of(debris, "points"), debris_detections = column_of(debris, "detections");
  for (std::size_t i = 0; i < debris_points.size(); ++i)
    if (debris_points[i] >= kLeastPoints[0]) ++sum_.debris_frames, sum_.debris_found += debris_detections[i] > 0;
  const Table& headings = run.tables.at("ego_heading");
  const char* const columns[2] = {"published_rad", "corrected_rad"};
  for (std::size_t k = 0; k < 2; ++k)
    for (const double v : column_of(headings, columns[k])) heading_squares_[k] += v * v, ++heading_count_[k];
  const Table& centres = run.tables.at("centres");
  for (const double v : column_of(centres, "along_m")) along_.push_back(std::fabs(v));
  for (const double v : column_of(centres, "across_m")) across_.push_back(std::fabs(v));
  for (const double v : column_of(centres, "square"))
    if (std::isfinite(v)) ++with_ellipse_, inside_ += v <= kIn95;
}

void Tally::add_cars(const Run& run) {
  const Table& cars = run.tables.at("cars");
  const auto frame = column_of(cars, "frame"), ahead = column_of(cars, "ahead_m"), points = column_of(cars, "points"),
             detections = column_of(cars, "detections");
  const double second_lap = first_frame_of_second_lap(run);
  for (const auto& [number, rows, events] : rows_by_car(cars)) {
    std::map<int32_t, metrics::Group> groups;
    for (std::size_t k = 0; k < rows.size(); ++k) {
      const std::size_t r = rows[k];
      if (!(ahead[r] >= kNearestM && ahead[r] < kFarthestM)) continue;
      CarFrames& bin = sum_.by_distance[std::size_t((ahead[r] - kNearestM) / kQualityBinM)];
      CarFrames& lap = frame[r] < second_lap ? sum_.first_lap : sum_.later_laps;
      for (CarFrames* to : {&sum_.near, &bin, &lap}) {
        ++to->all;
        for (std::size_t j = 0; j < 2; ++j)
          if (points[r] >= kLeastPoints[j]) ++to->seen[j], to->detected[j] += detections[r] > 0;
      }
      if (points[r] >= kLeastPoints[0]) ++groups[events[k]].trials, groups[events[k]].hits += detections[r] > 0;
    }
    for (const auto& [event, group] : groups) events_.push_back(group);
  }
}

void Tally::add_clusters(const Run& run) {
  const Table &cars = run.tables.at("cars"), &clusters = run.tables.at("clusters");
  const auto frame = column_of(cars, "frame"), points = column_of(cars, "points"), of = column_of(cars, "clusters");
  std::set<double> frames;
  for (std::size_t i = 0; i < frame.size(); ++i)
    if (points[i] >= kMinCarPoints)
      ++sum_.cars_judged, with_cluster_ += of[i] > 0, clusters_ += of[i], frames.insert(frame[i]);
  const auto at = column_of(clusters, "frame"), other = column_of(clusters, "mixed_other"),
             two = column_of(clusters, "mixed_cars");
  for (std::size_t i = 0; i < at.size(); ++i)
    if (frames.count(at[i])) mixed_ += other[i] + two[i];
}

void Tally::add_false(const Run& run) {
  const Table &cars = run.tables.at("cars"), &clusters = run.tables.at("clusters"),
              &of = run.tables.at("false_detections");
  std::set<double> with_car;
  const auto frame = column_of(cars, "frame"), car_ahead = column_of(cars, "ahead_m");
  for (std::size_t i = 0; i < frame.size(); ++i)
    if (bin_of(car_ahead[i]) >= 0) with_car.insert(frame[i]);
  for (const double f : column_of(clusters, "frame")) sum_.frames_without_car += with_car.count(f) == 0;
  const auto at = column_of(of, "frame"), ahead = column_of(of, "ahead_m"), range = column_of(of, "range_m"),
             surface = column_of(of, "surface"), bank = column_of(of, "bank_deg"), lap = column_of(of, "map_s_m");
  for (std::size_t i = 0; i < at.size(); ++i) {
    ++anywhere_;
    near_false_ += bin_of(ahead[i]) >= 0;
    without_car_ += bin_of(ahead[i]) >= 0 && with_car.count(at[i]) == 0;
    ++sum_.by_surface[surface[i] < 0 ? "unknown" : sim::surface_name(uint16_t(surface[i]))];
    ++sum_.by_range[piece_of(range[i], {20, 50, 100, 150}, " m")];
    if (std::isfinite(bank[i])) ++sum_.by_bank[piece_of(std::fabs(bank[i]), {3, 8, 16}, " deg")];
    if (!std::isfinite(lap[i])) continue;
    const int32_t from = int32_t(std::floor(lap[i] / kLapPieceM) * kLapPieceM);
    ++sum_.by_lap[std::to_string(from) + " to " + std::to_string(from + int32_t(kLapPieceM)) + " m"];
  }
}

double mean_value(const std::vector<double>& values) { return metrics::summarize(values).mean; }

Quality Tally::finish() const {
  Quality q = sum_;
  q.detected = metrics::grouped_share(events_);
  const double frames = q.frames > 0 ? double(q.frames) : kNan;
  q.false_detections = near_false_ / frames, q.false_anywhere = anywhere_ / frames;
  for (auto* part : {&q.by_surface, &q.by_range, &q.by_bank, &q.by_lap})
    for (auto& [name, count] : *part) count /= frames;
  q.false_without_car = q.frames_without_car > 0 ? without_car_ / double(q.frames_without_car) : kNan;
  q.debris_found = q.debris_frames > 0 ? q.debris_found / double(q.debris_frames) : kNan;
  q.clusters_per_car = with_cluster_ > 0 ? clusters_ / with_cluster_ : kNan;
  q.without_cluster = q.cars_judged > 0 ? 1 - with_cluster_ / double(q.cars_judged) : kNan;
  q.mixed_per_car = q.cars_judged > 0 ? mixed_ / double(q.cars_judged) : kNan;
  q.tpr = mean_value(tpr_), q.ppv = mean_value(ppv_), q.f1 = mean_value(f1_), q.ppv_p5 = metrics::summarize(ppv_).p5;
  q.along_m = metrics::summarize(along_), q.across_m = metrics::summarize(across_);
  for (std::size_t k = 0; k < 2; ++k)
    q.heading_rms_deg[k] = heading_count_[k] > 0 ? io::deg(std::sqrt(heading_squares_[k] / heading_count_[k])) : kNan;
  q.in_ellipse = metrics::binomial_share(inside_, with_ellipse_);
  return q;
}

}  // namespace

double CarFrames::bound(std::size_t k) const { return share_of(seen[k], all); }
double CarFrames::detected_share(std::size_t k) const { return share_of(detected[k], seen[k]); }

std::vector<Quality> find_quality(const std::vector<Run>& runs) { return tally_runs<Tally>(runs); }

nlohmann::json json_of(const Quality& q) {
  using Json = nlohmann::json;
  const auto cars = [](const CarFrames& c) {
    return Json{{"car_frames", c.all},
                {"with_3_points", c.seen[0]},
                {"with_5_points", c.seen[1]},
                {"bound_3_points", c.bound(0)},
                {"bound_5_points", c.bound(1)},
                {"detected_of_3_points", c.detected_share(0)},
                {"detected_of_5_points", c.detected_share(1)}};
  };
  Json j = cars(q.near);
  j["frames"] = q.frames;
  j["first_lap"] = cars(q.first_lap), j["later_laps"] = cars(q.later_laps);
  j["debris"] = {{"frames_with_3_points", q.debris_frames}, {"found", q.debris_found}};
  j["detected_of_3_points_interval"] = {q.detected.low, q.detected.high};
  j["by_distance"] = Json::array();
  for (std::size_t b = 0; b < q.by_distance.size(); ++b) {
    Json bin = cars(q.by_distance[b]);
    const double from = kNearestM + double(b) * kQualityBinM;
    bin["from_m"] = from, bin["to_m"] = std::min(from + kQualityBinM, kFarthestM);
    j["by_distance"].push_back(bin);
  }
  j["false_detections"] = {{"a_frame", q.false_detections},
                           {"a_frame_anywhere", q.false_anywhere},
                           {"by_surface", q.by_surface},
                           {"by_range", q.by_range},
                           {"by_bank", q.by_bank},
                           {"by_lap", q.by_lap},
                           {"frames_without_car", q.frames_without_car},
                           {"a_frame_without_car", q.false_without_car}};
  j["clusters_per_car"] = q.clusters_per_car, j["cars_without_cluster"] = q.without_cluster;
  j["mixed_per_car"] = q.mixed_per_car;
  j["cars_of_the_clusters"] = q.cars_judged;
  j["ground"] = {{"tpr", q.tpr}, {"ppv", q.ppv}, {"ppv_p5", q.ppv_p5}, {"f1", q.f1}};
  const auto error = [](const metrics::Summary& s) {
    return Json{{"count", s.count}, {"median", s.median}, {"p95", s.p95}};
  };
  j["centre_along_m"] = error(q.along_m), j["centre_across_m"] = error(q.across_m);
  j["ego_heading_rms_deg"] = {{"published", q.heading_rms_deg[0]}, {"corrected", q.heading_rms_deg[1]}};
  j["in_95_ellipse"] = {{"hits", q.in_ellipse.hits}, {"trials", q.in_ellipse.trials}, {"value", q.in_ellipse.value}};
  return j;
}

}  // namespace overtake::evaluation
