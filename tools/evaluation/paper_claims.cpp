// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
#include "tools/evaluation/paper_claims.h"

#include <algorithm>
#include <cctype>
#include <cmath>
#include <limits>
#include <tuple>

#include "tools/evaluation/numbers.h"
#include "tools/io/angles.h"

namespace overtake::evaluation {
namespace {

double mean_of(const std::vector<double>& values) { return metrics::summarize(values).mean; }

// Over the bins whose middle is between the limits: a share, or a sum per frame.
double share_between(const Figures& f, double from_m, double to_m, metrics::Share DistanceBin::*share) {
  int64_t hits = 0, trials = 0;
  for (const DistanceBin& b : f.distance)
    if (b.middle_m > from_m && b.middle_m < to_m) hits += (b.*share).hits, trials += (b.*share).trials;
  return trials > 0 ? double(hits) / double(trials) : kNan;
}
double sum_between(const Figures& f, double from_m, double to_m, double DistanceBin::*rate) {
  double sum = 0;
  for (const DistanceBin& b : f.distance)
    if (b.middle_m > from_m && b.middle_m < to_m) sum += b.*rate;
  return sum;
}

// The outer edge of the farthest bin in a direction (1 ahead, -1 behind) that reaches the probability.
double farthest_m(const Figures& f, double direction, double probability) {
  double edge = kNan;
  for (const DistanceBin& b : f.distance)
    if (b.middle_m * direction > 0 && b.detected.trials > 0 && b.detected.value >= probability)
      if (std::isnan(edge) || std::fabs(b.middle_m) + kBinM / 2 > edge) edge = std::fabs(b.middle_m) + kBinM / 2;
  return edge;
}

// The outer edge of the farthest bin in a direction that contained a car.
double farthest_car_m(const Figures& f, double direction) { return farthest_m(f, direction, 0); }

struct Check {
  Claim claim;
  bool has_case = true;
  Check(std::string name, std::string text) { claim.name = std::move(name), claim.text = std::move(text); }
  Check& number(const char* name, double value) {
    claim.numbers.push_back({name, value});
    return *this;
  }
  // An optional number; `none` tells what its absence means.
  Check& extra(const char* name, double value, const char* none) {
    claim.numbers.push_back({name, value, none, false});
    return *this;
  }
  // Without a case for this sentence, the claim counts as not measured.
  Check& needs(bool it_is_there) {
    has_case = has_case && it_is_there;
    return *this;
  }
  Claim holds(bool it_does) {
    claim.known = has_case && std::all_of(claim.numbers.begin(), claim.numbers.end(),
                                          [](const Number& n) { return !n.is_needed || std::isfinite(n.value); });
    claim.holds = claim.known && it_does;
    return claim;
  }
};

void check_ground(const std::string& by, const GroundFigures& ours, const GroundFigures& grid,
                  std::vector<Claim>& out) {
  const auto compare = [&](const std::string& metric, const std::string& name, const std::string& text, double a,
                           double b, bool holds) {
    std::string capitals = metric;
    for (char& c : capitals) c = char(std::toupper(static_cast<unsigned char>(c)));
    out.push_back(Check("ground_" + metric + "_" + name + "_by_" + by,
                        "ground removal, " + capitals + ": " + text + " than the 2.5-D grid, by " +
                            (by == "truth" ? "truth" : "automatic labels"))
                      .number("pipeline", a)
                      .number("grid_2_5d", b)
                      .holds(holds));
  };
  for (const auto& [name, values] : {std::pair("tpr", &GroundFigures::tpr), std::pair("f1", &GroundFigures::f1)}) {
    const metrics::Summary a = metrics::summarize(ours.*values), b = metrics::summarize(grid.*values);
    compare(name, "higher", "a higher mean", a.mean, b.mean, a.mean > b.mean);
    compare(name, "steadier", "a smaller deviation over the scans", a.deviation, b.deviation,
            a.deviation < b.deviation);
  }
  const double a = mean_of(ours.ppv), b = mean_of(grid.ppv);
  compare("ppv", "lower", "a lower mean", a, b, a < b);
}

// Compares with the best radius of those tried: the smallest sum of surplus and mixed clusters.
Claim check_clusters(const char* name, const char* text, const std::vector<double>& per_car,
                     const std::vector<double>& mixed, const std::map<double, std::vector<double>>& euclid_per_car,
                     const std::map<double, std::vector<double>>& euclid_mixed) {
  double best = kNan, radius = kNan, clusters = kNan, joined = kNan;
  for (const auto& [r, values] : euclid_per_car) {
    const auto at = euclid_mixed.find(r);
    if (at == euclid_mixed.end()) continue;
    const double c = mean_of(values), m = mean_of(at->second), sum = std::fabs(c - 1) + m;
    if (std::isnan(best) || sum < best) best = sum, radius = r, clusters = c, joined = m;
  }
  return Check(name, text)
      .number("clusters_per_car", mean_of(per_car))
      .number("mixed_per_frame", mean_of(mixed))
      .number("euclidean_radius_m", radius)
      .number("clusters_per_car_euclidean", clusters)
      .number("mixed_per_frame_euclidean", joined)
      .holds(mean_of(per_car) > clusters && mean_of(mixed) < joined);
}

void check_detection(const Figures& f, std::vector<Claim>& out) {
  constexpr auto detected = &DistanceBin::detected, confirmed = &DistanceBin::confirmed;
  const double dip = share_between(f, -40, -20, detected), nearer = share_between(f, -20, 0, detected),
               beyond = share_between(f, -60, -40, detected), kept = share_between(f, -40, -20, confirmed);
  out.push_back(Check("dip_behind", "the probability of detection dips 20 to 40 m behind (own rear wing)")
                    .number("detected_20_to_40_m_behind", dip)
                    .number("detected_0_to_20_m_behind", nearer)
                    .number("detected_40_to_60_m_behind", beyond)
                    .holds(dip < nearer && dip < beyond));
  out.push_back(
      Check("track_over_dip", "20 to 40 m behind the probability of a confirmed track is above that of a detection")
          .number("confirmed_20_to_40_m_behind", kept)
          .number("detected_20_to_40_m_behind", dip)
          .holds(kept > dip));
  // Only if cars were beyond the given distance: otherwise the distance is no limit of the method.
  for (const auto& [name, expected_m, direction] : {std::tuple("ahead", 90.0, 1.0), std::tuple("behind", 85.0, -1.0)}) {
    const double found_m = farthest_m(f, direction, 0.1), there_m = farthest_car_m(f, direction);
    out.push_back(Check(std::string("seen_") + name, "cars are seen (in one frame of ten) to " +
                                                         std::to_string(int32_t(expected_m)) + " m " + name +
                                                         ", a bin of 10 m either way")
                      .number("paper_m", expected_m)
                      .extra("found_m", found_m, "nowhere")
                      .number("farthest_car_m", there_m)
                      .needs(there_m > expected_m + kBinM)
                      .holds(std::fabs(found_m - expected_m) <= kBinM));
  }
  double falls_m = kNan;  // the near edge of the nearest bin ahead that is certainly below 1/2
  for (const DistanceBin& b : f.distance)
    if (b.middle_m > 0 && b.detected.trials > 0 && b.detected.high < 0.5)
      falls_m = std::fmin(falls_m, b.middle_m - kBinM / 2);
  out.push_back(Check("half_ahead",
                      "the probability of detection falls below a half (its interval as well) 80 m ahead, a bin of "
                      "10 m either way")
                    .number("paper_m", 80)
                    .extra("falls_below_half_m", falls_m, "never")
                    .extra("farthest_with_half_m", farthest_m(f, 1, 0.5), "nowhere")
                    .number("farthest_car_m", farthest_car_m(f, 1))
                    .needs(std::isfinite(falls_m) || farthest_car_m(f, 1) > 80 + kBinM)
                    .holds(std::fabs(falls_m - 80) <= kBinM));
  const double raw = sum_between(f, kNearestM, kFarthestM, &DistanceBin::false_detections),
               tracked = sum_between(f, kNearestM, kFarthestM, &DistanceBin::false_confirmed);
  out.push_back(
      Check("false_tracks_rare", "confirmed false tracks are far rarer than false detections (a fifth at most)")
          .number("false_detections_per_frame", raw)
          .number("false_confirmed_per_frame", tracked)
          .holds(tracked < raw / 5));
}

void check_errors(const Figures& f, std::vector<Claim>& out) {
  const auto of = [](const std::map<std::string, std::vector<double>>& errors, const char* name) {
    const auto at = errors.find(name);
    return at == errors.end() ? std::vector<double>() : at->second;
  };
  std::vector<double> heading = of(f.detection_errors, "heading_rad");
  for (double& h : heading) h /= io::rad(1);
  const std::vector<double> modes = modes_of(heading, -30, 30);
  Check humps("heading_humps", "the raw heading error has two humps");
  humps.number("humps", heading.empty() ? kNan : double(modes.size()));
  for (std::size_t i = 0; i < std::min<std::size_t>(modes.size(), 4); ++i)
    humps.number(("hump_" + std::to_string(i + 1) + "_deg").c_str(), modes[i]);
  out.push_back(humps.holds(modes.size() == 2));

  const metrics::Summary left = metrics::summarize(f.across_in_left_turns),
                         rest = metrics::summarize(f.across_elsewhere);
  out.push_back(Check("lean_right",
                      "in left turns the lateral error of detections leans to the right: mean below zero, and the left "
                      "tail (5 %) longer than the right one about the median")
                    .number("mean_m", left.mean)
                    .number("median_m", left.median)
                    .number("p5_m", left.p5)
                    .number("p95_m", left.p95)
                    .number("mean_elsewhere_m", rest.count > 0 ? rest.mean : 0)
                    .number("mean_of_cars_ahead_m", mean_of(f.across_left_ahead))
                    .number("mean_of_cars_behind_m", mean_of(f.across_left_behind))
                    .holds(left.mean < 0 && left.median - left.p5 > left.p95 - left.median));
  const double dx = mean_of(of(f.detection_errors, "x_veh_m")), dy = mean_of(of(f.detection_errors, "y_veh_m")),
               tx = mean_of(of(f.track_errors, "x_veh_m")), ty = mean_of(of(f.track_errors, "y_veh_m"));
  out.push_back(Check("tracks_less_biased", "tracks are less biased than detections, along and across the own car")
                    .number("detections_x_m", dx)
                    .number("tracks_x_m", tx)
                    .number("detections_y_m", dy)
                    .number("tracks_y_m", ty)
                    .holds(std::fabs(tx) < std::fabs(dx) && std::fabs(ty) < std::fabs(dy)));
}

// The share of the frames with a car in which a false detection would lie within the car's gate by chance, if those of
// each bin were spread evenly along the bin: 1 - exp(-n), n false ones on 2 kGateM of road. A little too high, because
// some of them are beside the car and farther away than the gate.
double chance_share(const Figures& f) {
  double hits = 0, trials = 0;
  for (const DistanceBin& b : f.distance) {
    hits += double(b.detected.trials) * -std::expm1(-b.false_detections * 2 * kGateM / kBinM);
    trials += double(b.detected.trials);
  }
  return trials > 0 ? hits / trials : kNan;
}

double joined_share(const Figures& f) {
  return f.seams.trials > 0 ? double(f.seams.hits) / double(f.seams.trials) : kNan;
}

}  // namespace

std::vector<double> modes_of(const std::vector<double>& values, double from, double to) {
  constexpr double kBin = 0.5;
  const std::size_t n = std::size_t((to - from) / kBin);
  std::vector<double> counts(n, 0), smooth(n, 0);
  for (const double v : values)
    if (v >= from && v < to) counts[std::min(n - 1, std::size_t((v - from) / kBin))] += 1;
  for (std::size_t i = 0; i < n; ++i)
    for (int64_t k = -1; k <= 1; ++k)
      if (const int64_t j = int64_t(i) + k; j >= 0 && j < int64_t(n)) smooth[i] += counts[std::size_t(j)] / 3;
  const double highest = n ? *std::max_element(smooth.begin(), smooth.end()) : 0;
  std::vector<std::size_t> peaks;
  double valley = 0;  // since the last peak
  for (std::size_t i = 0; i < n; ++i) {
    valley = std::min(valley, smooth[i]);
    const bool rises = i == 0 || smooth[i] > smooth[i - 1];
    std::size_t end = i;
    while (end + 1 < n && smooth[end + 1] == smooth[i]) ++end;
    if (!rises || smooth[i] <= 0 || smooth[i] < highest / 10 || (end + 1 < n && smooth[end + 1] > smooth[i])) continue;
    if (!peaks.empty() && valley > 0.8 * std::min(smooth[peaks.back()], smooth[i])) {
      if (smooth[i] > smooth[peaks.back()]) peaks.back() = i, valley = smooth[i];
      continue;
    }
    peaks.push_back(i);
    valley = smooth[i];
  }
  std::vector<double> out;
  for (const std::size_t p : peaks) out.push_back(from + (double(p) + 0.5) * kBin);
  return out;
}

const Figures* find_figures(const std::vector<Figures>& all, const std::string& variant, const std::string& scenario) {
  for (const Figures& f : all)
    if (f.variant == variant && f.scenario == scenario) return &f;
  return nullptr;
}

std::vector<Claim> check_claims(const Figures& f, const std::vector<Figures>& all) {
  std::vector<Claim> out;
  check_ground("truth", f.ground, f.grid, out);
  check_ground("labels", f.ground_auto, f.grid_auto, out);
  out.push_back(check_clusters("clusters_by_truth",
                               "more car splits and fewer mixed clusters than Euclidean clustering at its best radius; "
                               "by surface truth",
                               f.clusters_per_car, f.mixed_other, f.euclid_clusters, f.euclid_mixed));
  out.push_back(check_clusters("clusters_by_boxes",
                               "more car splits and fewer mixed clusters than Euclidean clustering at its best radius; "
                               "by the paper's rule (boxes)",
                               f.boxed_per_car, f.mixed_by_size, f.euclid_boxed, f.euclid_mixed_by_size));
  check_detection(f, out);
  const Figures* ego = find_figures(all, f.variant + ":ego", f.scenario);
  constexpr auto rate = &DistanceBin::false_detections;
  const double there = sum_between(f, -90, -70, rate), everywhere = sum_between(f, kNearestM, kFarthestM, rate);
  const double with_truth = ego ? sum_between(*ego, -90, -70, rate) : kNan;
  out.push_back(
      Check("false_gather_behind",
            "false detections gather 70 to 90 m behind: more than an even spread over -100 to 150 m would give")
          .number("per_frame_70_to_90_m_behind", there)
          .number("per_frame_everywhere", everywhere)
          .number("share_70_to_90_m_behind", everywhere > 0 ? there / everywhere : kNan)
          .number("share_if_even", 20 / (kFarthestM - kNearestM))
          .holds(there / everywhere > 20 / (kFarthestM - kNearestM)));
  out.push_back(Check("false_behind_by_heading",
                      "false detections 70 to 90 m behind come from the ego's heading error: gone (to a quarter) with "
                      "the true pose")
                    .number("per_frame", there)
                    .number("per_frame_with_true_pose", with_truth)
                    .holds(with_truth < there / 4));
  check_errors(f, out);
  const Figures* off = find_figures(all, f.variant + ":mounting", f.scenario);
  const double off_joined = off ? joined_share(*off) : kNan, off_clusters = off ? mean_of(off->clusters_per_car) : kNan;
  out.push_back(Check("mounting",
                      "merging withstands mounting errors of 2 cm and 0.2 deg: cars over a seam stay one "
                      "cluster (5 points of a hundred lost at most)")
                    .number("joined_over_seams", joined_share(f))
                    .number("joined_over_seams_misplaced", off_joined)
                    .number("clusters_per_car", mean_of(f.clusters_per_car))
                    .number("clusters_per_car_misplaced", off_clusters)
                    .holds(joined_share(f) - off_joined <= 0.05));
  return out;
}

std::vector<Claim> check_controls(const Figures& f, const std::vector<Figures>& all) {
  const auto detected = [](const Figures* of) {
    return of ? share_between(*of, kNearestM, kFarthestM, &DistanceBin::detected) : kNan;
  };
  const auto number_of_hits = [](const Figures& of) {
    double hits = 0;
    for (const DistanceBin& b : of.distance) hits += double(b.detected.hits + b.confirmed.hits);
    return hits;
  };
  const auto mean_size = [](const Figures& of, const char* name) {
    const auto at = of.detection_errors.find(name);
    std::vector<double> sizes;
    if (at != of.detection_errors.end())
      for (const double v : at->second) sizes.push_back(std::fabs(v));
    return mean_of(sizes);
  };
  std::vector<Claim> out;
  if (f.tracks.mot.objects == 0)
    out.push_back(Check("empty_track", "on a track without cars nothing is detected at a car, and all tracks are false")
                      .number("detected_at_a_car", number_of_hits(f))
                      .number("false_confirmed_tracks_per_hour", f.tracks.false_per_hour)
                      .holds(number_of_hits(f) == 0 && f.tracks.mot.matches == 0));
  if (const Figures* empty = find_figures(all, f.variant + ":empty", f.scenario))
    // False detections are more frequent at walls, where the cars drive, and not even over a bin: hence a factor of
    // 1.5.
    out.push_back(
        Check("no_car_points",
              "without the points of cars no more is detected at them than false detections that lie there by chance "
              "(1.5 times that at most), and less than half of what is detected with them")
            .number("detected", detected(&f))
            .number("detected_without_points", detected(empty))
            .number("by_chance", chance_share(*empty))
            .holds(detected(empty) <= 1.5 * chance_share(*empty) && detected(empty) < detected(&f) / 2));
  if (const Figures* shuffled = find_figures(all, f.variant + ":shuffled", f.scenario)) {
    const double moved = std::fabs(mean_size(*shuffled, "x_veh_m") - mean_size(f, "x_veh_m"));
    out.push_back(
        Check("shuffled_rows", "the order of the points changes no count, and places by less than a millimetre")
            .number("hits", number_of_hits(f))
            .number("hits_shuffled", number_of_hits(*shuffled))
            .number("mean_error_moved_m", moved)
            .holds(number_of_hits(*shuffled) == number_of_hits(f) && moved < 1e-3));
  }
  if (const Figures* late = find_figures(all, f.variant + ":late_truth", f.scenario))
    out.push_back(Check("late_truth",
                        "against the truth of the next frame the error along grows by more than a metre, at cars that "
                        "drive 1.5 m or more in a frame")
                      .number("mean_error_along_m", mean_of(f.along_moving_m))
                      .number("mean_error_along_late_m", mean_of(late->along_moving_m))
                      .holds(mean_of(late->along_moving_m) > mean_of(f.along_moving_m) + 1));
  return out;
}

std::vector<Cost> find_costs(const Figures& f, const std::vector<Figures>& all) {
  const auto heading = [](const Figures& of) {
    const auto at = of.track_errors.find("heading_rad");
    if (at == of.track_errors.end()) return kNan;
    std::vector<double> absolute;
    for (const double v : at->second) absolute.push_back(std::fabs(v) / io::rad(1));
    return mean_of(absolute);
  };
  const Figures* relay = find_figures(all, f.variant + ":relay", f.scenario);
  std::vector<Cost> out;
  for (const auto& [oracle, base] :
       {std::pair("ground", &f), std::pair("clusters", relay), std::pair("heading", relay), std::pair("ego", &f)}) {
    const Figures* o = find_figures(all, f.variant + ":" + oracle, f.scenario);
    if (!o || !base) continue;
    const TrackFigures &a = base->tracks, &b = o->tracks;
    Cost c;
    c.oracle = oracle, c.against = base->variant;
    c.located_m2 = a.gospa_located_m2 - b.gospa_located_m2, c.missed_m2 = a.gospa_missed_m2 - b.gospa_missed_m2;
    c.false_m2 = a.gospa_false_m2 - b.gospa_false_m2;
    c.gospa_m2 = c.located_m2 + c.missed_m2 + c.false_m2;
    c.hota = b.hota_window.hota - a.hota_window.hota;
    c.detected = share_between(*o, kNearestM, kFarthestM, &DistanceBin::detected) -
                 share_between(*base, kNearestM, kFarthestM, &DistanceBin::detected);
    c.false_per_hour = a.false_per_hour - b.false_per_hour;
    c.heading_deg = heading(*base) - heading(*o);
    out.push_back(c);
  }
  std::sort(out.begin(), out.end(), [](const Cost& a, const Cost& b) { return a.gospa_m2 > b.gospa_m2; });
  return out;
}

}  // namespace overtake::evaluation
