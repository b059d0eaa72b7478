// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
#include "tools/evaluation/track_quality.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <nlohmann/json.hpp>
#include <set>

#include "tools/evaluation/figures_parts.h"
#include "tools/evaluation/numbers.h"
#include "tools/evaluation/run_tallies.h"
#include "tools/io/angles.h"

namespace overtake::evaluation {
namespace {

constexpr double kIn70OfPath = 2.407945608651872, kIn95OfPath = 5.991464547107979;  // chi-square, 2 degrees of freedom
constexpr double kThresholds[] = {0.5,   0.6,   0.7,   0.8,    0.9,    0.95,   0.98,   0.99,
                                  0.995, 0.998, 0.999, 0.9995, 0.9998, 0.9999, 0.99999};

struct PathSamples {
  std::vector<double> along, across, square;
  std::vector<double> inner;  // the square in units of a steady car's variances; where there are none, `square`
};

// Which of kCruising, kSpeedChange and kLaneChange the change of speed and offset over a horizon belongs to.
std::array<bool, kManoeuvres> manoeuvres_of(double speed_mps, double offset_m, double horizon_s) {
  const double speed = std::fabs(speed_mps) / horizon_s, offset = std::fabs(offset_m) / horizon_s;  // NaN: none
  return {true, speed <= kCruiseMps2 && offset <= kCruiseOffsetMps, speed > kHardMps2, offset > kLaneChangeMps};
}

bool is_spinning(double speed_mps, double yaw_rate_rps, double slip_rad) {
  return std::fabs(yaw_rate_rps) > kSpinYawRateRps || (speed_mps > kMovingMps && std::fabs(slip_rad) > kSpinSlipRad);
}

// Sums over the runs of one variant.
class TrackTally {
 public:
  void add(const Run& run);
  TrackQuality finish() const;

 private:
  void add_paths(const Run& run);
  void add_existence(const Run& run);
  void add_errors_at_cars(const Run& run);
  void add_cars(const Run& run);

  TrackQuality sum_;
  std::array<std::array<PathSamples, kManoeuvres>, kHorizons> paths_;
  std::vector<double> speed_, speed_cruising_, speed_braking_, course_, spin_heading_, spin_axis_;
  std::array<std::vector<double>, kRangesM.size() - 1> along_, across_;
  Delays confirmed_;
  std::array<Delays, std::size(kThresholds)> found_;
  std::array<int64_t, std::size(kThresholds)> false_ = {};
  std::array<std::vector<double>, 2> approaches_m_;  // ahead, behind
};

void TrackTally::add(const Run& run) {
  sum_.hours += double(run.tables.at("clusters").rows()) * step_of(run) / 3600;
  add_paths(run);
  add_existence(run);
  add_errors_at_cars(run);
  add_cars(run);
}

void TrackTally::add_paths(const Run& run) {
  const Table& paths = run.tables.at("paths");
  const auto horizon = column_of(paths, "horizon_s"), along = column_of(paths, "along_m"),
             across = column_of(paths, "across_m"), square = column_of(paths, "square"),
             speed = column_of(paths, "speed_change_mps"), offset = column_of(paths, "offset_change_m"),
             steady = column_of(paths, "steady_square");
  for (std::size_t i = 0; i < horizon.size(); ++i) {
    const auto at = std::find(std::begin(kHorizonsS), std::end(kHorizonsS), horizon[i]);
    if (at == std::end(kHorizonsS)) continue;
    const auto does = manoeuvres_of(speed[i], offset[i], horizon[i]);
    for (std::size_t m = 0; m < kManoeuvres; ++m) {
      if (!does[m]) continue;
      PathSamples& to = paths_[std::size_t(at - std::begin(kHorizonsS))][m];
      to.along.push_back(along[i]), to.across.push_back(across[i]), to.square.push_back(square[i]);
      to.inner.push_back(std::isfinite(steady[i]) ? steady[i] : square[i]);
    }
  }
}

// A track that was never at a car, confirmed or not, nor confirmed on a parked vehicle, is false at every threshold
// that it reaches: so their number falls with the threshold.
void TrackTally::add_existence(const Run& run) {
  const Table &existence = run.tables.at("existence"), &parked = run.tables.at("parked_tracks");
  const auto id = column_of(existence, "id"), value = column_of(existence, "existence"),
             car = column_of(existence, "car");
  std::map<double, double> most;
  std::set<double> good;
  for (std::size_t i = 0; i < id.size(); ++i) {
    sum_.existence.add(value[i], car[i] >= 0);
    double& of_track = most[id[i]];
    of_track = std::max(of_track, value[i]);
    if (car[i] >= 0) good.insert(id[i]);
  }
  const auto parked_id = column_of(parked, "id"), parked_confirmed = column_of(parked, "confirmed");
  for (std::size_t i = 0; i < parked_id.size(); ++i)
    if (parked_confirmed[i] > 0) good.insert(parked_id[i]);
  for (const auto& [track, reached] : most)
    for (std::size_t k = 0; k < std::size(kThresholds) && !good.count(track); ++k)
      false_[k] += reached >= kThresholds[k];
}

void TrackTally::add_errors_at_cars(const Run& run) {
  const Table &tracks = run.tables.at("tracks"), &cars = run.tables.at("cars"), &motion = run.tables.at("motion");
  struct Doing {
    double range_m = kNan, speed_mps = kNan, accel_mps2 = kNan, yaw_rate_rps = kNan, slip_rad = kNan;
  };
  std::map<std::pair<double, double>, Doing> doing;  // frame, car
  const auto c_frame = column_of(cars, "frame"), c_car = column_of(cars, "car"), ahead = column_of(cars, "ahead_m"),
             left = column_of(cars, "left_m");
  for (std::size_t i = 0; i < c_frame.size(); ++i)
    doing[{c_frame[i], c_car[i]}].range_m = std::hypot(ahead[i], left[i]);
  const auto m_frame = column_of(motion, "frame"), m_car = column_of(motion, "car"),
             m_speed = column_of(motion, "speed_mps"), accel = column_of(motion, "accel_mps2"),
             yaw_rate = column_of(motion, "yaw_rate_rps"), slip = column_of(motion, "slip_rad");
  for (std::size_t i = 0; i < m_frame.size(); ++i) {
    Doing& d = doing[{m_frame[i], m_car[i]}];
    d.speed_mps = m_speed[i], d.accel_mps2 = accel[i], d.yaw_rate_rps = yaw_rate[i], d.slip_rad = slip[i];
  }
  const auto frame = column_of(tracks, "frame"), car = column_of(tracks, "car"),
             confirmed = column_of(tracks, "confirmed"), along = column_of(tracks, "x_veh_m"),
             across = column_of(tracks, "y_veh_m"), speed = column_of(tracks, "speed_mps"),
             heading = column_of(tracks, "heading_rad"), course = column_of(tracks, "course_rad");
  for (std::size_t i = 0; i < frame.size(); ++i) {
    if (car[i] < 0 || confirmed[i] <= 0) continue;
    const Doing& d = doing[{frame[i], car[i]}];
    for (std::size_t k = 0; k + 1 < kRangesM.size(); ++k)
      if (d.range_m >= kRangesM[k] && d.range_m < kRangesM[k + 1])
        along_[k].push_back(along[i]), across_[k].push_back(across[i]);
    speed_.push_back(speed[i]);
    if (d.speed_mps > kMovingMps) course_.push_back(course[i]);
    if (std::fabs(d.accel_mps2) <= kCruiseMps2) speed_cruising_.push_back(speed[i]);
    if (d.accel_mps2 < -kHardMps2) speed_braking_.push_back(speed[i]);
    if (is_spinning(d.speed_mps, d.yaw_rate_rps, d.slip_rad))
      spin_heading_.push_back(heading[i]), spin_axis_.push_back(std::remainder(heading[i], io::kPi));
  }
}

void TrackTally::add_cars(const Run& run) {
  const bool has_existence = run.tables.at("existence").rows() > 0;
  const double away_s = away_of(run, kAwayS);
  for (const auto& [car, rows] : car_rows(run)) {
    const KeptIds kept = count_kept_ids(rows, away_s);
    sum_.overtakes.hits += kept.overtakes.hits, sum_.overtakes.trials += kept.overtakes.trials;
    sum_.gaps.hits += kept.gaps.hits, sum_.gaps.trials += kept.gaps.trials;
    sum_.losses.hits += kept.losses.hits, sum_.losses.trials += kept.losses.trials;
    const auto append = [&](Delays& to, const std::function<bool(const CarRow&)>& is_found) {
      const Delays more = delays_to(rows, is_found, away_s);
      to.seconds.insert(to.seconds.end(), more.seconds.begin(), more.seconds.end());
      to.already_found += more.already_found;
    };
    append(confirmed_, [](const CarRow& row) { return row.confirmed; });
    for (std::size_t k = 0; k < std::size(kThresholds) && has_existence; ++k)
      append(found_[k], [k](const CarRow& row) { return row.existence >= kThresholds[k]; });
    for (const Approach& a : find_approaches(rows, away_s)) approaches_m_[a.ahead ? 0 : 1].push_back(a.confirmed_m);
  }
}

TrackQuality TrackTally::finish() const {
  TrackQuality q = sum_;
  for (std::size_t h = 0; h < kHorizons; ++h)
    for (std::size_t m = 0; m < kManoeuvres; ++m) {
      const PathSamples& s = paths_[h][m];
      int64_t known = 0, in_70 = 0, in_95 = 0;
      for (std::size_t i = 0; i < s.square.size(); ++i)
        known += std::isfinite(s.square[i]), in_70 += s.inner[i] <= kIn70OfPath, in_95 += s.square[i] <= kIn95OfPath;
      q.paths[h][m] = {spread_of(s.along), spread_of(s.across), metrics::binomial_share(in_70, known),
                       metrics::binomial_share(in_95, known)};
    }
  q.speed_mps = spread_of(speed_), q.speed_cruising_mps = spread_of(speed_cruising_);
  q.speed_braking_mps = spread_of(speed_braking_);
  q.course_rad = spread_of(course_), q.spin_heading_rad = spread_of(spin_heading_);
  q.spin_axis_rad = spread_of(spin_axis_);
  for (std::size_t k = 0; k + 1 < kRangesM.size(); ++k)
    q.along_m[k] = spread_of(along_[k]), q.across_m[k] = spread_of(across_[k]);
  q.confirmed = found_after(confirmed_);
  for (auto [to, from] : {std::pair(&q.from_ahead, &approaches_m_[0]), {&q.from_behind, &approaches_m_[1]}}) {
    const metrics::Summary s = metrics::summarize(*from);
    *to = {int64_t(from->size()), s.left_out, s.median, s.least};
  }
  for (std::size_t k = 0; k < std::size(kThresholds) && q.existence.count() > 0; ++k)
    q.thresholds.push_back(
        {kThresholds[k], false_[k], q.hours > 0 ? double(false_[k]) / q.hours : kNan, found_after(found_[k])});
  return q;
}

nlohmann::json json_of_spread(const Spread& s) {
  return {{"count", s.error.count},
          {"rms", s.rms},
          {"bias", s.error.mean},
          {"deviation", s.error.deviation},
          {"p95_of_size", s.size_p95}};
}
nlohmann::json json_of_found(const FoundAfter& f) {
  return {{"presences", f.presences},
          {"never", f.never},
          {"already_found", f.already_found},
          {"median_s", f.median_s},
          {"p99_s", f.p99_s}};
}
nlohmann::json json_of_group(const metrics::Group& g) {
  return {{"count", g.trials}, {"kept", g.hits}, {"share", g.trials > 0 ? double(g.hits) / double(g.trials) : kNan}};
}

}  // namespace

Spread spread_of(const std::vector<double>& errors) {
  std::vector<double> sizes;
  double squares = 0;
  for (const double e : errors)
    if (std::isfinite(e)) sizes.push_back(std::fabs(e)), squares += e * e;
  std::sort(sizes.begin(), sizes.end());
  return {metrics::summarize(errors), metrics::percentile(sizes, 0.95), std::sqrt(squares / double(sizes.size()))};
}

FoundAfter found_after(const Delays& delays) {
  std::vector<double> found;
  for (const double delay : delays.seconds)
    if (!std::isnan(delay)) found.push_back(delay);
  std::sort(found.begin(), found.end());
  return {int64_t(delays.seconds.size()), int64_t(delays.seconds.size() - found.size()),
          metrics::percentile(found, 0.5), metrics::percentile(found, 0.99), delays.already_found};
}

const Threshold* TrackQuality::least_threshold() const {
  for (const Threshold& t : thresholds)
    if (t.false_per_hour <= kFalseGoalPerHour) return &t;
  return nullptr;
}

std::vector<TrackQuality> find_track_quality(const std::vector<Run>& runs) { return tally_runs<TrackTally>(runs); }

nlohmann::json json_of(const TrackQuality& q) {
  using Json = nlohmann::json;
  static constexpr const char* kNames[kManoeuvres] = {"all", "cruising", "speed_change", "lane_change"};
  Json j = {{"hours", q.hours}, {"paths", Json::array()}};
  for (std::size_t h = 0; h < kHorizons; ++h) {
    Json of_horizon = {{"horizon_s", kHorizonsS[h]}};
    for (std::size_t m = 0; m < kManoeuvres; ++m) {
      const PathFigures& p = q.paths[h][m];
      of_horizon[kNames[m]] = {{"along_m", json_of_spread(p.along_m)},
                               {"across_m", json_of_spread(p.across_m)},
                               {"in_70_ellipse", p.in_70.value},
                               {"in_95_ellipse", p.in_95.value}};
    }
    j["paths"].push_back(of_horizon);
  }
  if (q.existence.count() > 0) {
    Json bins = Json::array();
    for (std::size_t b = 0; b < q.existence.bins().size(); ++b) {
      const auto& bin = q.existence.bins()[b];
      bins.push_back({{"from", double(b) / 10},
                      {"count", bin.count},
                      {"mean_existence", bin.count > 0 ? bin.probability / double(bin.count) : kNan},
                      {"share_at_a_car", bin.share()}});
    }
    j["existence"] = {{"count", q.existence.count()},
                      {"bins", bins},
                      {"expected_calibration_error", q.existence.expected_error()},
                      {"brier", q.existence.brier()}};
  }
  for (const Threshold& t : q.thresholds)
    j["existence"]["thresholds"].push_back({{"existence", t.existence},
                                            {"false_tracks", t.false_tracks},
                                            {"false_tracks_per_hour", t.false_per_hour},
                                            {"delay", json_of_found(t.delay)}});
  if (!q.thresholds.empty()) {
    const Threshold* const least = q.least_threshold();
    j["existence"]["at_0_1_false_an_hour"] =
        least ? Json{{"existence", least->existence}, {"delay", json_of_found(least->delay)}, {"hours", q.hours}}
              : Json();
  }
  j["speed_mps"] = {{"all", json_of_spread(q.speed_mps)},
                    {"cruising", json_of_spread(q.speed_cruising_mps)},
                    {"braking", json_of_spread(q.speed_braking_mps)}};
  for (std::size_t k = 0; k + 1 < kRangesM.size(); ++k)
    j["position"].push_back({{"from_m", kRangesM[k]},
                             {"to_m", kRangesM[k + 1]},
                             {"along_m", json_of_spread(q.along_m[k])},
                             {"across_m", json_of_spread(q.across_m[k])}});
  j["course_rad"] = json_of_spread(q.course_rad), j["spin_heading_rad"] = json_of_spread(q.spin_heading_rad);
  j["spin_axis_rad"] = json_of_spread(q.spin_axis_rad);
  j["overtakes"] = json_of_group(q.overtakes), j["gaps"] = json_of_group(q.gaps), j["losses"] = json_of_group(q.losses);
  j["confirmed_after_detectable"] = json_of_found(q.confirmed);
  for (const auto& [name, at] :
       {std::pair("confirmed_from_ahead", &q.from_ahead), {"confirmed_from_behind", &q.from_behind}})
    j[name] = {
        {"approaches", at->approaches}, {"never", at->never}, {"median_m", at->median_m}, {"least_m", at->least_m}};
  return j;
}

}  // namespace overtake::evaluation
