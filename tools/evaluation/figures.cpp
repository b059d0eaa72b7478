// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
#include "tools/evaluation/figures.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "pipeline/overtake.h"
#include "tools/metrics/consistency.h"
#include "tools/metrics/gospa.h"

namespace overtake::evaluation {
namespace {

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

std::vector<double> column_of(const Table& table, const std::string& name) {
  const std::size_t c = table.column(name);
  std::vector<double> out;
  for (std::size_t r = 0; r < table.rows(); ++r) out.push_back(table.at(r, c));
  return out;
}

void add_ground(const Table& scans, GroundFigures& out) {
  const auto tp = column_of(scans, "tp"), fp = column_of(scans, "fp"), fn = column_of(scans, "fn");
  for (std::size_t i = 0; i < tp.size(); ++i) {
    out.tpr.push_back(tp[i] + fn[i] > 0 ? tp[i] / (tp[i] + fn[i]) : kNan);
    out.ppv.push_back(tp[i] + fp[i] > 0 ? tp[i] / (tp[i] + fp[i]) : kNan);
    out.f1.push_back(tp[i] + fp[i] + fn[i] > 0 ? 2 * tp[i] / (2 * tp[i] + fp[i] + fn[i]) : kNan);
  }
}

void add_clusters(const Run& run, Figures& out) {
  const Table &cars = run.tables.at("cars"), &clusters = run.tables.at("clusters"), &euclid = run.tables.at("euclid");
  const auto frame = column_of(cars, "frame"), points = column_of(cars, "points"), of = column_of(cars, "clusters"),
             boxed = column_of(cars, "boxed");
  std::map<double, bool> with_car;
  for (std::size_t i = 0; i < frame.size(); ++i) {
    if (points[i] < kMinCarPoints) continue;
    with_car[frame[i]] = true;
    out.clusters_per_car.push_back(of[i]);
    out.boxed_per_car.push_back(boxed[i]);
  }
  const auto at = column_of(clusters, "frame"), other = column_of(clusters, "mixed_other"),
             two = column_of(clusters, "mixed_cars");
  for (std::size_t i = 0; i < at.size(); ++i)
    if (with_car.count(at[i])) out.mixed_other.push_back(other[i]), out.mixed_cars.push_back(two[i]);
  const auto radius = column_of(euclid, "radius_m"), car = column_of(euclid, "car"),
             count = column_of(euclid, "clusters"), when = column_of(euclid, "frame");
  for (std::size_t i = 0; i < radius.size(); ++i)
    if (with_car.count(when[i])) (car[i] < 0 ? out.euclid_mixed : out.euclid_clusters)[radius[i]].push_back(count[i]);
}

int32_t bin_of(double ahead_m) {
  return ahead_m >= kNearestM && ahead_m < kFarthestM ? int32_t((ahead_m - kNearestM) / kBinM) : -1;
}

struct BinCounts {
  std::map<std::pair<std::size_t, int32_t>, std::pair<metrics::Group, metrics::Group>>
      of_event;  // (run and car, event)
  double false_detections = 0, false_confirmed = 0;
};

void add_distance(const Run& run, std::size_t run_number, std::vector<BinCounts>& bins) {
  const Table& cars = run.tables.at("cars");
  const auto car = column_of(cars, "car"), ahead = column_of(cars, "ahead_m"), found = column_of(cars, "detections"),
             confirmed = column_of(cars, "confirmed");
  std::map<double, std::vector<std::size_t>> rows_of;
  for (std::size_t i = 0; i < car.size(); ++i) rows_of[car[i]].push_back(i);
  for (const auto& [number, rows] : rows_of) {
    std::vector<double> way;
    for (const std::size_t r : rows) way.push_back(ahead[r]);
    const std::vector<int32_t> events = events_of(way);
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

struct TrackSamples {
  std::vector<double> gospa, nees, nis, to_confirm, gap, age;
  double hota[4] = {0, 0, 0, 0};
  int64_t runs = 0;
};

// Cars count from kNearestM to kFarthestM, whether a beam meets them or not; a track at a car farther out is not false.
void add_tracks(const Run& run, Figures& out, TrackSamples& samples) {
  const Table &cars = run.tables.at("cars"), &tracks = run.tables.at("tracks");
  struct Frame {
    std::vector<metrics::MotPlace> objects, tracks;
  };
  std::map<double, Frame> frames;
  for (const double f : column_of(run.tables.at("clusters"), "frame")) frames[f];
  metrics::Continuity continuity;
  metrics::FalseTracks false_tracks;
  const auto frame = column_of(cars, "frame"), time = column_of(cars, "time_s"), car = column_of(cars, "car"),
             ahead = column_of(cars, "ahead_m"), x = column_of(cars, "x_m"), y = column_of(cars, "y_m"),
             confirmed = column_of(cars, "confirmed");
  for (std::size_t i = 0; i < frame.size(); ++i) {
    if (bin_of(ahead[i]) < 0) continue;
    frames[frame[i]].objects.push_back({uint64_t(car[i]), x[i], y[i]});
    continuity.add(time[i], uint64_t(car[i]), confirmed[i] > 0);
  }
  const auto t_frame = column_of(tracks, "frame"), id = column_of(tracks, "id"), t_car = column_of(tracks, "car"),
             t_confirmed = column_of(tracks, "confirmed"), t_ahead = column_of(tracks, "ahead_m"),
             t_x = column_of(tracks, "x_m"), t_y = column_of(tracks, "y_m"), nees = column_of(tracks, "nees"),
             age = column_of(tracks, "age_s");
  for (std::size_t i = 0; i < t_frame.size(); ++i) {
    if (t_confirmed[i] <= 0) continue;
    false_tracks.add(uint64_t(id[i]), t_car[i] >= 0);
    if (bin_of(t_ahead[i]) >= 0) frames[t_frame[i]].tracks.push_back({uint64_t(id[i]), t_x[i], t_y[i]});
    if (t_car[i] >= 0) samples.nees.push_back(nees[i]), samples.age.push_back(age[i]);
  }
  metrics::ClearMot mot(kGateM);
  metrics::Hota hota(kGateM);
  for (const auto& [number, f] : frames) {
    mot.add_frame(f.objects, f.tracks);
    hota.add_frame(f.objects, f.tracks);
    samples.gospa.push_back(metrics::gospa(f.objects, f.tracks).distance_m);
  }
  out.tracks.mot += mot.counts();
  const metrics::HotaResult h = hota.result();
  if (std::isfinite(h.hota)) {
    samples.hota[0] += h.hota, samples.hota[1] += h.detection, samples.hota[2] += h.association;
    samples.hota[3] += std::isfinite(h.localisation) ? h.localisation : 0;
    ++samples.runs;
  }
  out.tracks.false_tracks += false_tracks.count();
  for (const metrics::Presence& p : continuity.presences()) {
    ++out.tracks.cars_seen;
    out.tracks.never_confirmed += std::isnan(p.time_to_confirm_s);
    samples.to_confirm.push_back(p.time_to_confirm_s);
    if (!std::isnan(p.time_to_confirm_s)) samples.gap.push_back(p.longest_gap_s);
  }
  const Table& innovations = run.tables.at("innovations");
  const auto nis = column_of(innovations, "nis"), n_car = column_of(innovations, "car");
  for (std::size_t i = 0; i < nis.size(); ++i)
    if (n_car[i] >= 0) samples.nis.push_back(nis[i]);
}

void finish_tracks(Figures& out, const TrackSamples& s) {
  TrackFigures& t = out.tracks;
  t.gospa_m = metrics::summarize(s.gospa), t.nees = metrics::summarize(s.nees), t.nis = metrics::summarize(s.nis);
  t.time_to_confirm_s = metrics::summarize(s.to_confirm), t.longest_gap_s = metrics::summarize(s.gap);
  t.data_age_s = metrics::summarize(s.age);
  t.false_per_hour = out.seconds > 0 ? double(t.false_tracks) * 3600 / out.seconds : kNan;
  const double n = double(s.runs);
  t.hota.hota = s.hota[0] / n, t.hota.detection = s.hota[1] / n;  // NaN without a run
  t.hota.association = s.hota[2] / n, t.hota.localisation = s.hota[3] / n;
  const auto bounds = [](const metrics::Summary& of, double degrees, double& low, double& high) {
    const double count = double(std::max<int64_t>(of.count, 1));
    low = metrics::chi_square_quantile(0.025, degrees * count) / count;
    high = metrics::chi_square_quantile(0.975, degrees * count) / count;
  };
  bounds(t.nees, 5, t.nees_low, t.nees_high);
  bounds(t.nis, 2, t.nis_low, t.nis_high);
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

std::vector<Figures> make_figures(const std::vector<Run>& runs) {
  std::map<std::pair<std::string, std::string>, std::vector<const Run*>> groups;
  for (const Run& run : runs) {
    const auto scenario = run.about.find("scenario");
    groups[{run.contestant, scenario == run.about.end() ? run.log : scenario->second}].push_back(&run);
  }
  std::vector<Figures> all;
  for (const auto& [key, members] : groups) {
    Figures f;
    f.contestant = key.first, f.scenario = key.second;
    f.runs = int64_t(members.size());
    std::vector<BinCounts> bins(std::size_t((kFarthestM - kNearestM) / kBinM));
    TrackSamples samples;
    double frames_judged = 0;
    for (std::size_t k = 0; k < members.size(); ++k) {
      const Run& run = *members[k];
      const double frames = double(run.tables.at("clusters").rows());
      frames_judged += frames;
      f.frames += int64_t(frames);
      const auto period = run.about.find("period_s");
      f.seconds += frames * (period == run.about.end() ? 0.05 : std::stod(period->second));
      add_ground(run.tables.at("scans"), f.ground);
      add_ground(run.tables.at("grid"), f.grid);
      const Table& points = run.tables.at("car_points");
      const auto range = column_of(points, "range_m"), count = column_of(points, "points"),
                 found = column_of(points, "found");
      for (std::size_t i = 0; i < range.size(); ++i)
        f.car_points[range[i]].first += count[i], f.car_points[range[i]].second += found[i];
      add_clusters(run, f);
      add_distance(run, k, bins);
      add_errors(run, f);
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
