// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// Tracking quality of confirmed tracks at publish time: CLEAR MOT, HOTA, GOSPA, consistency, gaps.
#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <set>
#include <tuple>

#include "tools/evaluation/figures_parts.h"
#include "tools/evaluation/metrics/consistency.h"
#include "tools/evaluation/metrics/gospa.h"
#include "tools/evaluation/numbers.h"

namespace overtake::evaluation {
namespace {

// Unmatched tracks at a car that has another track.
int64_t count_doubles(const std::vector<metrics::MotPlace>& objects, const std::vector<metrics::MotPlace>& tracks,
                      const std::vector<int32_t>& track_of_object) {
  int64_t doubles = 0;
  for (std::size_t j = 0; j < tracks.size(); ++j) {
    if (std::find(track_of_object.begin(), track_of_object.end(), int32_t(j)) != track_of_object.end()) continue;
    doubles += std::any_of(objects.begin(), objects.end(), [&](const metrics::MotPlace& o) {
      return std::hypot(o.x_m - tracks[j].x_m, o.y_m - tracks[j].y_m) <= kGateM;
    });
  }
  return doubles;
}

// Ids of a car or a track by window: each window has ids of its own. In the order of the windows, then of the ids.
class WindowIds {
 public:
  explicit WindowIds(const std::map<double, MotFrame>& frames) {
    for (const auto& [number, f] : frames)
      for (const auto* places : {&f.objects, &f.tracks})
        for (const metrics::MotPlace& p : *places) ids_[{window_of(f), p.id}];
    uint64_t next = 0;
    for (auto& [key, id] : ids_) id = next++;
  }
  std::vector<metrics::MotPlace> rename(const MotFrame& f, std::vector<metrics::MotPlace> places) const {
    for (metrics::MotPlace& p : places) p.id = ids_.at({window_of(f), p.id});
    return places;
  }

 private:
  static int64_t window_of(const MotFrame& f) { return int64_t(std::floor(f.time_s / kWindowS)); }
  std::map<std::pair<int64_t, uint64_t>, uint64_t> ids_;  // window, id
};

}  // namespace

std::map<double, MotFrame> mot_frames(const Run& run) {
  const Table &cars = run.tables.at("cars"), &tracks = run.tables.at("tracks");
  std::map<double, MotFrame> frames;
  std::set<std::pair<double, double>> here;  // frame, car
  for (const double f : column_of(run.tables.at("clusters"), "frame")) frames[f];
  const Table& ego = run.tables.at("ego");
  const auto e_frame = column_of(ego, "frame"), e_time = column_of(ego, "time_s");
  for (std::size_t i = 0; i < e_frame.size(); ++i) frames[e_frame[i]].time_s = e_time[i];
  const auto frame = column_of(cars, "frame"), time = column_of(cars, "time_s"), car = column_of(cars, "car"),
             ahead = column_of(cars, "ahead_m"), x = column_of(cars, "x_m"), y = column_of(cars, "y_m");
  for (std::size_t i = 0; i < frame.size(); ++i) {
    frames[frame[i]].time_s = time[i];
    if (bin_of(ahead[i]) < 0) continue;
    here.insert({frame[i], car[i]});
    frames[frame[i]].objects.push_back({uint64_t(car[i]), x[i], y[i]});
  }
  const auto t_frame = column_of(tracks, "frame"), id = column_of(tracks, "id"), t_car = column_of(tracks, "car"),
             confirmed = column_of(tracks, "confirmed"), t_ahead = column_of(tracks, "ahead_m"),
             t_x = column_of(tracks, "x_m"), t_y = column_of(tracks, "y_m");
  for (std::size_t i = 0; i < t_frame.size(); ++i)
    if (confirmed[i] > 0 && (t_car[i] < 0 ? bin_of(t_ahead[i]) >= 0 : here.count({t_frame[i], t_car[i]}) > 0))
      frames[t_frame[i]].tracks.push_back({uint64_t(id[i]), t_x[i], t_y[i]});
  return frames;
}

int64_t count_false_tracks(const Run& run) {
  const Table &tracks = run.tables.at("tracks"), &parked = run.tables.at("parked_tracks");
  metrics::FalseTracks false_tracks;
  const auto id = column_of(tracks, "id"), car = column_of(tracks, "car"), confirmed = column_of(tracks, "confirmed");
  for (std::size_t i = 0; i < id.size(); ++i)
    if (confirmed[i] > 0) false_tracks.add(uint64_t(id[i]), car[i] >= 0);
  const auto parked_id = column_of(parked, "id"), parked_confirmed = column_of(parked, "confirmed");
  for (std::size_t i = 0; i < parked_id.size(); ++i)
    if (parked_confirmed[i] > 0) false_tracks.add(uint64_t(parked_id[i]), true);
  return false_tracks.count();
}

void add_tracks(const Run& run, Figures& out, TrackSamples& samples) {
  const Table &cars = run.tables.at("cars"), &tracks = run.tables.at("tracks");
  const std::map<double, MotFrame> frames = mot_frames(run);
  metrics::Continuity continuity(away_of(run, metrics::kAwayS));
  const auto time = column_of(cars, "time_s"), car = column_of(cars, "car"), ahead = column_of(cars, "ahead_m"),
             confirmed = column_of(cars, "confirmed");
  for (std::size_t i = 0; i < car.size(); ++i)
    if (bin_of(ahead[i]) >= 0) continuity.add(time[i], uint64_t(car[i]), confirmed[i] > 0);
  const auto t_car = column_of(tracks, "car"), t_confirmed = column_of(tracks, "confirmed"),
             nees = column_of(tracks, "nees"), age = column_of(tracks, "age_s");
  for (std::size_t i = 0; i < t_car.size(); ++i) {
    if (t_confirmed[i] <= 0) continue;
    if (t_car[i] >= 0)
      samples.nees.push_back(nees[i]), samples.age.push_back(age[i]);
    else
      out.tracks.false_s += step_of(run);
  }
  metrics::ClearMot mot(kGateM);
  metrics::Hota hota(kGateM), hota_window(kGateM);
  const WindowIds ids(frames);
  for (const auto& [number, f] : frames) {
    mot.add_frame(f.objects, f.tracks);
    hota.add_frame(f.objects, f.tracks);
    hota_window.add_frame(ids.rename(f, f.objects), ids.rename(f, f.tracks));
    if (f.objects.empty() && f.tracks.empty()) continue;  // nothing to follow and nothing wrong
    const metrics::Gospa g = metrics::gospa(f.objects, f.tracks);
    samples.gospa.push_back(g.distance_m), samples.located.push_back(g.localisation);
    samples.missed.push_back(g.missed), samples.false_tracks.push_back(g.false_tracks);
    out.tracks.doubles += count_doubles(f.objects, f.tracks, mot.track_of_object());
  }
  out.tracks.mot += mot.counts();
  const metrics::HotaResult whole = hota.result(), window = hota_window.result();
  if (std::isfinite(whole.hota)) {
    for (const auto& [to, h] : {std::pair(&samples.hota, &whole), std::pair(&samples.hota_window, &window)})
      to->hota += h->hota, to->detection += h->detection, to->association += h->association;
    for (const auto& [to, h, count] : {std::tuple(&samples.hota, &whole, &samples.with_pairs),
                                       std::tuple(&samples.hota_window, &window, &samples.with_pairs_window)})
      if (std::isfinite(h->localisation)) to->localisation += h->localisation, ++*count;
    ++samples.runs;
  }
  out.tracks.false_tracks += count_false_tracks(run);
  for (const metrics::Presence& p : continuity.presences()) {
    ++out.tracks.cars_seen;
    out.tracks.never_confirmed += std::isnan(p.time_to_confirm_s);
    if (p.time_to_confirm_s != 0) samples.to_confirm.push_back(p.time_to_confirm_s);  // 0: it had its track before
    if (!std::isnan(p.time_to_confirm_s)) samples.gap.push_back(p.longest_gap_s);
  }
  for (const auto& [name, to] : {std::pair("innovations", &samples.nis), {"innovations_own", &samples.nis_own}}) {
    const Table& innovations = run.tables.at(name);
    const auto nis = column_of(innovations, "nis"), n_car = column_of(innovations, "car");
    for (std::size_t i = 0; i < nis.size(); ++i)
      if (n_car[i] >= 0) to->push_back(nis[i]);
  }
}

void finish_tracks(Figures& out, const TrackSamples& s) {
  TrackFigures& t = out.tracks;
  t.gospa_m = metrics::summarize(s.gospa), t.nees = metrics::summarize(s.nees), t.nis = metrics::summarize(s.nis);
  t.time_to_confirm_s = metrics::summarize(s.to_confirm), t.longest_gap_s = metrics::summarize(s.gap);
  t.data_age_s = metrics::summarize(s.age);
  t.false_per_hour = out.seconds > 0 ? double(t.false_tracks) * 3600 / out.seconds : kNan;
  t.false_s_per_hour = out.seconds > 0 ? t.false_s * 3600 / out.seconds : kNan;
  t.gospa_located_m2 = metrics::summarize(s.located).mean;
  t.gospa_missed_m2 = metrics::summarize(s.missed).mean;
  t.gospa_false_m2 = metrics::summarize(s.false_tracks).mean;
  const double n = double(s.runs);  // NaN without a run
  for (const auto& [to, h] : {std::pair(&t.hota, &s.hota), std::pair(&t.hota_window, &s.hota_window)}) {
    to->hota = h->hota / n, to->detection = h->detection / n;
    to->association = h->association / n;
  }
  t.hota.localisation = s.hota.localisation / double(s.with_pairs);
  t.hota_window.localisation = s.hota_window.localisation / double(s.with_pairs_window);
  const auto bounds = [](const metrics::Summary& of, double degrees, double& low, double& high) {
    const double count = double(std::max<int64_t>(of.count, 1));
    low = metrics::chi_square_quantile(0.025, degrees * count) / count;
    high = metrics::chi_square_quantile(0.975, degrees * count) / count;
  };
  // 95 % of the values of a consistent filter: quantiles 0.025 and 0.975 of chi-square, 5 and 2 degrees of freedom.
  constexpr double kNisLow = 0.0506356, kNisHigh = 7.3777589;
  const auto share_within = [](const std::vector<double>& values, double low, double high) {
    int64_t inside = 0, known = 0;
    for (const double v : values) known += std::isfinite(v), inside += v >= low && v <= high;
    return metrics::binomial_share(inside, known);
  };
  t.nees_inside = share_within(s.nees, 0.8312116, 12.8325020), t.nis_inside = share_within(s.nis, kNisLow, kNisHigh);
  t.nis_own = metrics::summarize(s.nis_own), t.nis_own_inside = share_within(s.nis_own, kNisLow, kNisHigh);
  bounds(t.nees, 5, t.nees_low, t.nees_high);
  bounds(t.nis, 2, t.nis_low, t.nis_high);
}

}  // namespace overtake::evaluation
