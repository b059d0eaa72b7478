// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
#include "tools/evaluation/track_identity.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <set>
#include <utility>

#include "tools/evaluation/figures_parts.h"
#include "tools/evaluation/numbers.h"

namespace overtake::evaluation {
namespace {

// An approach begins at least this far away and comes at least this near.
struct ApproachLimits {
  double from_m, to_m;
};
constexpr ApproachLimits kFromAhead = {120, 80}, kFromBehind = {80, 50};

double distance_of(const CarRow& row) { return std::hypot(row.ahead_m, row.left_m); }
bool is_near(const CarRow& row) { return bin_of(row.ahead_m) >= 0 && distance_of(row) <= kFarthestM; }
bool is_detectable(const CarRow& row) { return row.points >= kSeenPoints; }

// The pieces [begin, end) of consecutive rows that hold `in`, without a pause longer than away_s.
std::vector<std::pair<std::size_t, std::size_t>> pieces_of(const std::vector<CarRow>& rows, double away_s,
                                                           const std::function<bool(const CarRow&)>& in) {
  std::vector<std::pair<std::size_t, std::size_t>> pieces;
  for (std::size_t i = 0; i < rows.size(); ++i) {
    if (!in(rows[i])) continue;
    const bool goes_on = !pieces.empty() && pieces.back().second == i && rows[i].time_s - rows[i - 1].time_s <= away_s;
    if (goes_on)
      ++pieces.back().second;
    else
      pieces.push_back({i, i + 1});
  }
  return pieces;
}

void count_overtakes(const std::vector<CarRow>& rows, double away_s, metrics::Group& out) {
  const auto is_close = [](const CarRow& row) {
    return std::fabs(row.ahead_m) <= kOvertakeM && std::fabs(row.left_m) <= kOvertakeAsideM;
  };
  const auto follows = [&](std::size_t i) { return rows[i].time_s - rows[i - 1].time_s <= away_s; };
  for (const auto& [begin, end] : pieces_of(rows, away_s, is_close)) {
    if (begin == 0 || end == rows.size() || !follows(begin) || !follows(end)) continue;
    const double before = rows[begin - 1].ahead_m, after = rows[end].ahead_m;
    if (!(std::min(before, after) < -kOvertakeM && std::max(before, after) > kOvertakeM)) continue;
    std::set<uint64_t> ids;
    bool ahead = false, behind = false;
    for (std::size_t i = begin; i < end; ++i)
      if (rows[i].id != 0) ids.insert(rows[i].id), (rows[i].ahead_m > 0 ? ahead : behind) = true;
    ++out.trials, out.hits += ids.size() == 1 && ahead && behind;
  }
}

// Whether the id after a gap from row `last` to row `next`, both detectable, is the one before. -1: does not count.
int32_t keeps_id(const std::vector<CarRow>& rows, std::size_t last, std::size_t next, std::size_t end) {
  uint64_t before = 0;
  for (std::size_t i = last + 1; i-- > 0 && rows[i].time_s >= rows[last].time_s - kBeforeGapS && before == 0;)
    before = rows[i].id;
  if (before == 0) return -1;
  for (std::size_t i = next; i < end && rows[i].time_s <= rows[next].time_s + kAfterGapS; ++i)
    if (rows[i].id != 0) return rows[i].id == before;
  return rows[end - 1].time_s >= rows[next].time_s + kAfterGapS ? 0 : -1;  // it left or the log ended too soon
}

void count_gaps(const std::vector<CarRow>& rows, double away_s, metrics::Group& out) {
  for (const auto& [begin, end] : pieces_of(rows, away_s, is_near)) {
    std::size_t last = end;  // the last detectable row
    for (std::size_t i = begin; i < end; ++i) {
      if (!is_detectable(rows[i])) continue;
      if (last != end && rows[i].time_s - rows[last].time_s >= kGapS)
        if (const int32_t kept = keeps_id(rows, last, i, end); kept >= 0) ++out.trials, out.hits += kept;
      last = i;
    }
  }
}

// Times of kGapS and longer without a confirmed track, between two with one.
void count_losses(const std::vector<CarRow>& rows, double away_s, metrics::Group& out) {
  for (const auto& [begin, end] : pieces_of(rows, away_s, is_near)) {
    std::size_t last = end;
    for (std::size_t i = begin; i < end; ++i) {
      if (rows[i].id == 0) continue;
      if (last != end && rows[i].time_s - rows[last].time_s >= kGapS)
        ++out.trials, out.hits += rows[i].id == rows[last].id;
      last = i;
    }
  }
}

}  // namespace

std::map<double, std::vector<CarRow>> car_rows(const Run& run) {
  std::map<std::pair<double, double>, uint64_t> id_of;  // frame, car
  metrics::ClearMot mot(kGateM);
  for (const auto& [number, f] : mot_frames(run)) {
    mot.add_frame(f.objects, f.tracks);
    for (std::size_t i = 0; i < f.objects.size(); ++i)
      if (const int32_t track = mot.track_of_object()[i]; track >= 0)
        id_of[{number, double(f.objects[i].id)}] = f.tracks[std::size_t(track)].id;
  }
  std::map<std::pair<double, double>, double> existence_of;
  const Table &existence = run.tables.at("existence"), &cars = run.tables.at("cars");
  const auto e_frame = column_of(existence, "frame"), e_car = column_of(existence, "car"),
             value = column_of(existence, "existence");
  for (std::size_t i = 0; i < value.size(); ++i) {
    double& most = existence_of[{e_frame[i], e_car[i]}];
    most = std::max(most, value[i]);
  }
  std::map<double, std::vector<CarRow>> out;
  const auto frame = column_of(cars, "frame"), time = column_of(cars, "time_s"), car = column_of(cars, "car"),
             ahead = column_of(cars, "ahead_m"), left = column_of(cars, "left_m"), points = column_of(cars, "points"),
             confirmed = column_of(cars, "confirmed");
  for (std::size_t i = 0; i < frame.size(); ++i) {
    CarRow row{time[i], ahead[i], left[i], points[i], confirmed[i] > 0, 0, 0};
    row.begins_log = frame[i] == 0;
    if (const auto found = id_of.find({frame[i], car[i]}); found != id_of.end()) row.id = found->second;
    if (const auto found = existence_of.find({frame[i], car[i]}); found != existence_of.end())
      row.existence = found->second;
    out[car[i]].push_back(row);
  }
  return out;
}

KeptIds count_kept_ids(const std::vector<CarRow>& rows, double away_s) {
  KeptIds out;
  count_overtakes(rows, away_s, out.overtakes);
  count_gaps(rows, away_s, out.gaps);
  count_losses(rows, away_s, out.losses);
  return out;
}

Delays delays_to(const std::vector<CarRow>& rows, const std::function<bool(const CarRow&)>& is_found, double away_s) {
  struct InReach {
    bool found_first = false;
    double last_s = 0, seen_s = kNan, found_s = kNan;
  };
  Delays out;
  const auto close = [&](const InReach& p) {
    if (std::isnan(p.seen_s)) return;
    if (p.found_first)
      ++out.already_found;
    else
      out.seconds.push_back(std::isnan(p.found_s) ? kNan : std::max(0.0, p.found_s - p.seen_s));
  };
  std::optional<InReach> presence;
  for (const CarRow& row : rows) {
    if (bin_of(row.ahead_m) < 0) continue;
    if (presence && row.time_s - presence->last_s > away_s) close(*std::exchange(presence, std::nullopt));
    if (!presence) presence = InReach{!row.begins_log && is_found(row)};
    presence->last_s = row.time_s;
    if (std::isnan(presence->seen_s) && is_detectable(row)) presence->seen_s = row.time_s;
    if (std::isnan(presence->found_s) && is_found(row)) presence->found_s = row.time_s;
  }
  if (presence) close(*presence);
  return out;
}

std::vector<Approach> find_approaches(const std::vector<CarRow>& rows, double away_s) {
  std::vector<Approach> out;
  const auto is_close = [](const CarRow& row) { return distance_of(row) <= kApproachM; };
  for (const auto& [begin, end] : pieces_of(rows, away_s, is_close)) {
    const CarRow& first = rows[begin];
    const ApproachLimits& limits = first.ahead_m > 0 ? kFromAhead : kFromBehind;
    if (!(std::fabs(first.ahead_m) >= limits.from_m)) continue;
    Approach approach{first.ahead_m > 0, kNan};
    double nearest_m = kApproachM;
    for (std::size_t i = begin; i < end; ++i) {
      nearest_m = std::min(nearest_m, distance_of(rows[i]));
      if (rows[i].confirmed && std::isnan(approach.confirmed_m)) approach.confirmed_m = distance_of(rows[i]);
    }
    if (nearest_m <= limits.to_m) out.push_back(approach);
  }
  return out;
}

}  // namespace overtake::evaluation
