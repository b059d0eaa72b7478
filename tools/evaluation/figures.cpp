// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
#include "tools/evaluation/figures.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <set>

#include "pipeline/overtake.h"
#include "tools/evaluation/figures_parts.h"
#include "tools/evaluation/numbers.h"

namespace overtake::evaluation {
std::vector<double> column_of(const Table& table, const std::string& name) {
  const std::size_t c = table.column(name);
  std::vector<double> out;
  for (std::size_t r = 0; r < table.rows(); ++r) out.push_back(table.at(r, c));
  return out;
}

int32_t bin_of(double ahead_m) {
  return ahead_m >= kNearestM && ahead_m < kFarthestM ? int32_t((ahead_m - kNearestM) / kBinM) : -1;
}

double step_of(const Run& run) {
  const auto period = run.about.find("period_s"), compared = run.about.find("compared");  // every N-th frame
  return (period == run.about.end() ? 0.05 : std::stod(period->second)) *
         (compared == run.about.end() ? 1 : std::stod(compared->second));
}

std::vector<CarRows> rows_by_car(const Table& cars) {
  const auto car = column_of(cars, "car"), ahead = column_of(cars, "ahead_m");
  std::map<double, std::vector<std::size_t>> rows_of;
  for (std::size_t i = 0; i < car.size(); ++i) rows_of[car[i]].push_back(i);
  std::vector<CarRows> out;
  for (auto& [number, rows] : rows_of) {
    std::vector<double> way;
    for (const std::size_t r : rows) way.push_back(ahead[r]);
    out.push_back({number, std::move(rows), events_of(way)});
  }
  return out;
}

namespace {

void add_ground(const Table& scans, GroundFigures& out) {
  const auto tp = column_of(scans, "tp"), fp = column_of(scans, "fp"), fn = column_of(scans, "fn");
  for (std::size_t i = 0; i < tp.size(); ++i) {
    out.tpr.push_back(tp[i] + fn[i] > 0 ? tp[i] / (tp[i] + fn[i]) : kNan);
    out.ppv.push_back(tp[i] + fp[i] > 0 ? tp[i] / (tp[i] + fp[i]) : kNan);
    out.f1.push_back(tp[i] + fp[i] + fn[i] > 0 ? 2 * tp[i] / (2 * tp[i] + fp[i] + fn[i]) : kNan);
  }
}

bool knows_surface(const Run& run) { return run.tables.at("scans").rows() > 0; }

void add_clusters(const Run& run, Figures& out) {
  const Table &cars = run.tables.at("cars"), &clusters = run.tables.at("clusters"), &euclid = run.tables.at("euclid");
  const auto frame = column_of(cars, "frame"), points = column_of(cars, "points"), of = column_of(cars, "clusters"),
             boxed = column_of(cars, "boxed"), number = column_of(cars, "car"), ahead = column_of(cars, "ahead_m");
  const bool known = knows_surface(run);  // otherwise near cars count, and nothing is counted by truth
  std::set<std::pair<double, double>> with_car;
  std::set<double> frames;
  for (std::size_t i = 0; i < frame.size(); ++i) {
    if (known ? points[i] < kMinCarPoints : std::fabs(ahead[i]) > kNearCarM) continue;
    with_car.insert({frame[i], number[i]});
    frames.insert(frame[i]);
    if (known) ++out.with_cluster.trials, out.with_cluster.hits += of[i] > 0;
    if (known && of[i] > 0) out.clusters_per_car.push_back(of[i]);
    out.boxed_per_car.push_back(boxed[i]);
  }
  const auto at = column_of(clusters, "frame"), other = column_of(clusters, "mixed_other"),
             two = column_of(clusters, "mixed_cars");
  for (std::size_t i = 0; i < at.size(); ++i)
    if (known && frames.count(at[i])) out.mixed_other.push_back(other[i]), out.mixed_cars.push_back(two[i]);
  const auto radius = column_of(euclid, "radius_m"), car = column_of(euclid, "car"),
             count = column_of(euclid, "clusters"), boxes = column_of(euclid, "boxed"),
             when = column_of(euclid, "frame");
  for (std::size_t i = 0; i < radius.size(); ++i)
    if (with_car.count({when[i], car[i]})) {
      if (known && count[i] > 0) out.euclid_clusters[radius[i]].push_back(count[i]);
      out.euclid_boxed[radius[i]].push_back(boxes[i]);
    }
  const Table &mixed = run.tables.at("euclid_mixed"), &by_size = run.tables.at("boxes");
  const auto m_frame = column_of(mixed, "frame"), m_radius = column_of(mixed, "radius_m");
  for (auto [to, name] : {std::pair(&out.euclid_mixed, "mixed_other"), std::pair(&out.euclid_mixed_cars, "mixed_cars"),
                          std::pair(&out.euclid_mixed_by_size, "mixed_by_size")}) {
    if (!known && to != &out.euclid_mixed_by_size) continue;
    const auto values = column_of(mixed, name);
    for (std::size_t i = 0; i < values.size(); ++i)
      if (frames.count(m_frame[i])) (*to)[m_radius[i]].push_back(values[i]);
  }
  const auto b_frame = column_of(by_size, "frame"), b_mixed = column_of(by_size, "mixed_by_size");
  for (std::size_t i = 0; i < b_frame.size(); ++i)
    if (frames.count(b_frame[i])) out.mixed_by_size.push_back(b_mixed[i]);
}

struct BinCounts {
  std::map<std::pair<std::size_t, int32_t>, std::pair<metrics::Group, metrics::Group>>
      of_event;  // (run and car, event)
  double false_detections = 0, false_confirmed = 0;
};

void add_distance(const Run& run, std::size_t run_number, std::vector<BinCounts>& bins) {
  const Table& cars = run.tables.at("cars");
  const auto ahead = column_of(cars, "ahead_m"), found = column_of(cars, "detections"),
             confirmed = column_of(cars, "confirmed");
  for (const auto& [number, rows, events] : rows_by_car(cars)) {
    for (std::size_t k = 0; k < rows.size(); ++k) {
      const int32_t bin = bin_of(ahead[rows[k]]);
      if (bin < 0) continue;
      auto& [d, c] = bins[std::size_t(bin)].of_event[{run_number * 64 + std::size_t(number), events[k]}];
      ++d.trials, ++c.trials;
      d.hits += found[rows[k]] > 0, c.hits += confirmed[rows[k]] > 0;
    }
  }
  const Table &detections = run.tables.at("detections"), &tracks = run.tables.at("tracks");
  const auto d_car = column_of(detections, "car"), d_ahead = column_of(detections, "ahead_m"),
             t_car = column_of(tracks, "car"), t_ahead = column_of(tracks, "ahead_m"),
             t_confirmed = column_of(tracks, "confirmed");
  for (std::size_t i = 0; i < d_car.size(); ++i)
    if (const int32_t bin = bin_of(d_ahead[i]); bin >= 0 && d_car[i] < 0) ++bins[std::size_t(bin)].false_detections;
  for (std::size_t i = 0; i < t_car.size(); ++i)
    if (const int32_t bin = bin_of(t_ahead[i]); bin >= 0 && t_car[i] < 0 && t_confirmed[i] > 0)
      ++bins[std::size_t(bin)].false_confirmed;
}

void add_errors(const Run& run, Figures& out) {
  const Table &detections = run.tables.at("detections"), &tracks = run.tables.at("tracks");
  const auto d_car = column_of(detections, "car"), t_car = column_of(tracks, "car"),
             confirmed = column_of(tracks, "confirmed");
  for (const char* name : {"x_map_m", "y_map_m", "x_veh_m", "y_veh_m", "heading_rad"}) {
    const auto values = column_of(detections, name);
    for (std::size_t i = 0; i < values.size(); ++i)
      if (d_car[i] >= 0) out.detection_errors[name].push_back(values[i]);
  }
  for (const char* name :
       {"x_map_m", "y_map_m", "x_veh_m", "y_veh_m", "heading_rad", "speed_mps", "course_rad", "yaw_rate_rps"}) {
    const auto values = column_of(tracks, name);
    for (std::size_t i = 0; i < values.size(); ++i)
      if (t_car[i] >= 0 && confirmed[i] > 0) out.track_errors[name].push_back(values[i]);
  }
}

// The number of simultaneous cars and their distances, and the errors at moving cars.
void add_movers(const Run& run, Figures& out) {
  const Table &cars = run.tables.at("cars"), &detections = run.tables.at("detections");
  const auto frame = column_of(cars, "frame"), number = column_of(cars, "car"), ahead = column_of(cars, "ahead_m"),
             x = column_of(cars, "x_m"), y = column_of(cars, "y_m");
  std::map<double, std::vector<std::size_t>> here;  // rows, by frame
  std::map<double, std::size_t> last;               // row, by car
  std::map<std::pair<double, double>, bool> moves;  // frame, car
  for (std::size_t i = 0; i < frame.size(); ++i) {
    if (bin_of(ahead[i]) >= 0) {
      std::vector<std::size_t>& others = here[frame[i]];
      for (const std::size_t k : others)
        out.closest_cars_m = std::fmin(out.closest_cars_m, std::hypot(x[i] - x[k], y[i] - y[k]));
      others.push_back(i);
      out.most_cars = std::max(out.most_cars, int32_t(others.size()));
    }
    if (const auto before = last.find(number[i]); before != last.end()) {
      const std::size_t k = before->second;
      const bool is_fast = std::hypot(x[i] - x[k], y[i] - y[k]) >= kMovesM * (frame[i] - frame[k]);
      moves[{frame[i], number[i]}] = is_fast;
      moves.try_emplace({frame[k], number[k]}, is_fast);  // the first row of a car
    }
    last[number[i]] = i;
  }
  const auto at = column_of(detections, "frame"), car = column_of(detections, "car"),
             along = column_of(detections, "x_veh_m");
  for (std::size_t i = 0; i < at.size(); ++i)
    if (const auto found = moves.find({at[i], car[i]}); found != moves.end() && found->second)
      out.along_moving_m.push_back(std::fabs(along[i]));
}

// Lateral errors in left turns of the ego, and elsewhere.
void add_lean(const Run& run, Figures& out) {
  constexpr double kTurnRps = 0.05;
  const Table &ego = run.tables.at("ego"), &detections = run.tables.at("detections");
  std::map<double, double> yaw_rate;
  const auto frame = column_of(ego, "frame"), rate = column_of(ego, "yaw_rate_rps");
  for (std::size_t i = 0; i < frame.size(); ++i) yaw_rate[frame[i]] = rate[i];
  const auto at = column_of(detections, "frame"), car = column_of(detections, "car"),
             across = column_of(detections, "y_veh_m"), ahead = column_of(detections, "ahead_m");
  for (std::size_t i = 0; i < at.size(); ++i) {
    const auto turn = yaw_rate.find(at[i]);
    if (car[i] < 0 || turn == yaw_rate.end()) continue;
    const bool left = turn->second > kTurnRps;
    (left ? out.across_in_left_turns : out.across_elsewhere).push_back(across[i]);
    if (left) (ahead[i] > 0 ? out.across_left_ahead : out.across_left_behind).push_back(across[i]);
  }
}

void add_times(const Run& run, Figures& out) {
  const Table& times = run.tables.at("times");
  const auto stage = column_of(times, "stage"), ns = column_of(times, "ns");
  for (std::size_t i = 0; i < stage.size(); ++i)
    if (const char* name = ovt_stage_name(int32_t(stage[i]))) out.times_ms[name].push_back(ns[i] * 1e-6);
}

}  // namespace

std::vector<int32_t> events_of(const std::vector<double>& ahead_m) {
  std::vector<std::size_t> passings;
  for (std::size_t i = 1; i < ahead_m.size(); ++i)
    if ((ahead_m[i - 1] < 0) != (ahead_m[i] < 0)) passings.push_back(i);
  std::vector<int32_t> events(ahead_m.size(), 0);
  std::size_t now = 0;
  for (std::size_t i = 0; i < ahead_m.size(); ++i) {
    while (now + 1 < passings.size() && 2 * i > passings[now] + passings[now + 1]) ++now;
    events[i] = int32_t(now);
  }
  return events;
}

bool is_simulated(const Run& run) {
  const auto said = run.about.find("simulated");
  return said == run.about.end() || said->second != "false";
}

std::string scenario_of(const Run& run) {
  const auto scenario = run.about.find("scenario");
  return scenario == run.about.end() ? run.log : scenario->second;
}

Origin origin_of(const std::vector<Run>& runs) {
  const auto simulated = std::count_if(runs.begin(), runs.end(), is_simulated);
  if (simulated == std::ptrdiff_t(runs.size())) return Origin::kSimulated;
  return simulated == 0 ? Origin::kRecorded : Origin::kMixed;
}

std::vector<Figures> make_figures(const std::vector<Run>& runs) {
  std::map<std::pair<std::string, std::string>, std::vector<const Run*>> groups;
  for (const Run& run : runs) groups[{run.variant, scenario_of(run)}].push_back(&run);
  std::vector<Figures> all;
  for (const auto& [key, members] : groups) {
    Figures f;
    f.variant = key.first, f.scenario = key.second;
    f.runs = int64_t(members.size());
    f.closest_cars_m = kNan;
    f.origin = is_simulated(*members[0]) ? Origin::kSimulated : Origin::kRecorded;
    std::vector<BinCounts> bins(std::size_t((kFarthestM - kNearestM) / kBinM));
    TrackSamples samples;
    double frames_judged = 0;
    for (std::size_t k = 0; k < members.size(); ++k) {
      const Run& run = *members[k];
      if (is_simulated(run) != is_simulated(*members[0])) f.origin = Origin::kMixed;
      f.surface_known = f.surface_known || knows_surface(run);
      const double frames = double(run.tables.at("clusters").rows());
      frames_judged += frames;
      f.frames += int64_t(frames);
      const auto cpu = run.about.find("cpu");
      f.cpus.insert(cpu == run.about.end() ? "unknown CPU" : cpu->second);
      const auto every = run.about.find("every");
      if (every != run.about.end() && every->second != "none") f.every.insert(every->second);
      f.seconds += frames * step_of(run);
      add_ground(run.tables.at("scans"), f.ground);
      add_ground(run.tables.at("grid"), f.grid);
      add_ground(run.tables.at("auto_label"), f.auto_label);
      add_ground(run.tables.at("scans_auto"), f.ground_auto);
      add_ground(run.tables.at("grid_auto"), f.grid_auto);
      const Table& seams = run.tables.at("seams");
      for (const double joined : column_of(seams, "joined")) ++f.seams.trials, f.seams.hits += joined > 0;
      add_lean(run, f);
      const Table& points = run.tables.at("car_points");
      const auto range = column_of(points, "range_m"), count = column_of(points, "points"),
                 found = column_of(points, "found");
      for (std::size_t i = 0; i < range.size(); ++i)
        f.car_points[range[i]].first += count[i], f.car_points[range[i]].second += found[i];
      add_clusters(run, f);
      add_distance(run, k, bins);
      add_errors(run, f);
      add_movers(run, f);
      add_tracks(run, f, samples);
      add_times(run, f);
    }
    finish_tracks(f, samples);
    for (std::size_t b = 0; b < bins.size(); ++b) {
      std::vector<metrics::Group> detected, confirmed;
      for (const auto& [event, groups_of] : bins[b].of_event)
        detected.push_back(groups_of.first), confirmed.push_back(groups_of.second);
      f.distance.push_back({kNearestM + (double(b) + 0.5) * kBinM, metrics::grouped_share(detected),
                            metrics::grouped_share(confirmed), int64_t(detected.size()),
                            bins[b].false_detections / frames_judged, bins[b].false_confirmed / frames_judged});
    }
    all.push_back(std::move(f));
  }
  return all;
}

}  // namespace overtake::evaluation
