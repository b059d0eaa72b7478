// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
#include "tools/cli/compare_runs.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <limits>
#include <optional>
#include <set>
#include <tuple>

#include "tools/client/circuit_file.h"
#include "tools/io/angles.h"
#include "tools/io/csv.h"
#include "tools/io/error.h"
#include "tools/io/text.h"

namespace overtake::cli {
namespace {

constexpr double kUnknown = std::numeric_limits<double>::quiet_NaN();

// A table of `overtake run`; none if it has its header alone, because nothing was found.
std::optional<io::Csv> read_table(const std::string& path) {
  std::string text = io::read_whole_file(path);
  const std::size_t end = text.find('\n');
  const bool only_header = end == std::string::npos || end + 1 == text.size();
  if (only_header && text.find("stamp_ns") != std::string::npos) return std::nullopt;
  return io::Csv::parse(path, std::move(text));
}

double number_or_unknown(const io::Csv& csv, std::size_t row, int32_t column) {
  return column < 0 || csv.text(row, column).empty() ? kUnknown : csv.number(row, column);
}

// tracks.csv does not name its frame of reference. In the vehicle frame, the places beside each other are the same.
Reference reference_of(const RunTables& run) {
  Reference found = Reference::kUnknown;
  for (const auto& [frame, rows] : run.tracks)
    for (const RunTables::Track& t : rows) {
      if (t.ahead_m != t.x_m || t.left_m != t.y_m) return Reference::kMap;
      found = Reference::kVehicle;
    }
  return found;
}

struct Pair {
  double distance_m;
  std::size_t a, b;
};

// Pairs within kSamePlaceM, each row in one of them at most: the nearest first. A row of unknown place is in none.
template <class Row>
std::vector<Pair> match(const std::vector<Row>& a, const std::vector<Row>& b, double Row::*x = &Row::x_m,
                        double Row::*y = &Row::y_m) {
  std::vector<Pair> pairs, out;
  for (std::size_t i = 0; i < a.size(); ++i)
    for (std::size_t k = 0; k < b.size(); ++k)
      if (const double d = std::hypot(a[i].*x - b[k].*x, a[i].*y - b[k].*y); d <= kSamePlaceM)
        pairs.push_back({d, i, k});
  std::sort(pairs.begin(), pairs.end(), [](const Pair& p, const Pair& q) {
    return std::tie(p.distance_m, p.a, p.b) < std::tie(q.distance_m, q.a, q.b);
  });
  std::vector<bool> used_a(a.size(), false), used_b(b.size(), false);
  for (const Pair& p : pairs) {
    if (used_a[p.a] || used_b[p.b]) continue;
    used_a[p.a] = used_b[p.b] = true;
    out.push_back(p);
  }
  return out;
}

template <class Row>
const std::vector<Row>& rows_at(const std::map<int64_t, std::vector<Row>>& table, int64_t key) {
  static const std::vector<Row> kNone;
  const auto found = table.find(key);
  return found == table.end() ? kNone : found->second;
}

template <class Row>
std::set<int64_t> keys_of(const std::map<int64_t, std::vector<Row>>& a, const std::map<int64_t, std::vector<Row>>& b) {
  std::set<int64_t> keys;
  for (const auto* table : {&a, &b})
    for (const auto& [key, rows] : *table) keys.insert(key);
  return keys;
}

// A frame of both has about the same stamp in both. Runs without a common frame may be of one recording: each found
// something else.
void check_same_recording(const RunTables& a, const RunTables& b) {
  constexpr int64_t kFarNs = 1'000'000'000;
  for (const auto& [frame, stamp_ns] : a.stamp_of_frame)
    if (const auto other = b.stamp_of_frame.find(frame);
        other != b.stamp_of_frame.end() && std::llabs(stamp_ns - other->second) > kFarNs)
      throw io::Error(b.folder, 0, "is of another recording than " + a.folder + ": their frames have other stamps");
}

// The stamp depends on the scans of the frame, of which one run may have fewer. The earlier one of both.
int64_t stamp_of(int64_t frame, const RunTables& a, const RunTables& b) {
  const auto of_a = a.stamp_of_frame.find(frame), of_b = b.stamp_of_frame.find(frame);
  if (of_b == b.stamp_of_frame.end()) return of_a->second;
  return of_a == a.stamp_of_frame.end() ? of_b->second : std::min(of_a->second, of_b->second);
}

struct Life {
  LoneTrack track;
  int64_t last_ns = 0, first_ns = 0;
};
using Lives = std::map<uint64_t, Life>;

void live(Lives& lives, const RunTables::Track& t, int64_t stamp_ns, int64_t begin_ns, bool matched) {
  const auto [at, is_new] = lives.try_emplace(t.id);
  Life& life = at->second;
  if (is_new) {
    life.first_ns = stamp_ns;
    life.track = {t.id,     0,        0,       double(stamp_ns - begin_ns) * 1e-9, 0, t.x_m, t.y_m, t.ahead_m,
                  t.left_m, kUnknown, kUnknown};
  }
  life.last_ns = stamp_ns;
  ++life.track.frames, life.track.matched += matched;
}

void finish(const Lives& lives, RunCounts& out) {
  out.confirmed_tracks = int64_t(lives.size());
  for (const auto& [id, life] : lives) {
    out.confirmed_rows += life.track.frames, out.lone_rows += life.track.frames - life.track.matched;
    if (2 * life.track.matched >= life.track.frames) continue;
    out.lone_tracks.push_back(life.track);
    out.lone_tracks.back().duration_s = double(life.last_ns - life.first_ns) * 1e-9;
  }
  std::stable_sort(out.lone_tracks.begin(), out.lone_tracks.end(),
                   [](const LoneTrack& x, const LoneTrack& y) { return x.from_s < y.from_s; });
}

void count(const RunTables& run, RunCounts& out) {
  out.reference = run.reference;
  std::set<uint64_t> ids;
  for (const auto& [frame, rows] : run.detections) out.detections += int64_t(rows.size());
  out.frames_with_detections = int64_t(run.detections.size());
  for (const auto& [frame, rows] : run.tracks)
    for (const RunTables::Track& t : rows) ids.insert(t.id);
  out.tracks = int64_t(ids.size());
}

std::vector<RunTables::Track> confirmed_of(const std::vector<RunTables::Track>& rows) {
  std::vector<RunTables::Track> out;
  for (const RunTables::Track& t : rows)
    if (t.confirmed) out.push_back(t);
  return out;
}

}  // namespace

RunTables read_run(const std::string& folder) {
  RunTables out;
  out.folder = folder;
  if (const auto csv = read_table(folder + "/detections.csv")) {
    const int32_t frame = csv->need({"frame"}), stamp = csv->need({"stamp_ns"}), x = csv->need({"x_m"}),
                  y = csv->need({"y_m"}), heading = csv->find({"heading_rad"});
    for (std::size_t i = 0; i < csv->row_count(); ++i) {
      out.detections[csv->integer(i, frame)].push_back(
          {csv->number(i, x), csv->number(i, y), number_or_unknown(*csv, i, heading)});
      out.stamp_of_frame.try_emplace(csv->integer(i, frame), csv->integer(i, stamp));
    }
  }
  if (const auto csv = read_table(folder + "/tracks.csv")) {
    const int32_t stamp = csv->need({"stamp_ns"}), frame = csv->need({"frame"}), id = csv->need({"id"}),
                  state = csv->need({"state"}), x = csv->need({"x_m"}), y = csv->need({"y_m"}),
                  speed = csv->find({"speed_mps"}), ahead = csv->find({"ahead_m"}), left = csv->find({"left_m"});
    for (std::size_t i = 0; i < csv->row_count(); ++i) {
      const std::string_view word = csv->text(i, state);
      if (word != "confirmed" && word != "tentative") csv->fail(i, state, "is neither confirmed nor tentative");
      out.tracks[csv->integer(i, frame)].push_back(
          {uint64_t(csv->integer(i, id)), word == "confirmed", csv->number(i, x), csv->number(i, y),
           number_or_unknown(*csv, i, speed), number_or_unknown(*csv, i, ahead), number_or_unknown(*csv, i, left)});
      out.stamp_of_frame.try_emplace(csv->integer(i, frame), csv->integer(i, stamp));
    }
    if (ahead >= 0 && left >= 0) out.reference = reference_of(out);
  }
  return out;
}

RunComparison compare_runs(const RunTables& a, const RunTables& b) {
  check_same_recording(a, b);
  RunComparison out;
  count(a, out.a), count(b, out.b);
  out.by_vehicle =
      a.reference != b.reference && a.reference != Reference::kUnknown && b.reference != Reference::kUnknown;
  const auto x = out.by_vehicle ? &RunTables::Track::ahead_m : &RunTables::Track::x_m;
  const auto y = out.by_vehicle ? &RunTables::Track::left_m : &RunTables::Track::y_m;
  std::vector<double> distance, turn;
  for (const int64_t frame : keys_of(a.detections, b.detections)) {
    const auto &of_a = rows_at(a.detections, frame), &of_b = rows_at(b.detections, frame);
    const std::vector<Pair> pairs = match(of_a, of_b);
    for (const Pair& p : pairs) {
      distance.push_back(p.distance_m);
      turn.push_back(std::fabs(io::wrap_angle(of_a[p.a].heading_rad - of_b[p.b].heading_rad)));
    }
    out.a.lone_detections += int64_t(of_a.size() - pairs.size());
    out.b.lone_detections += int64_t(of_b.size() - pairs.size());
  }
  out.detection_distance_m = metrics::summarize(distance), out.detection_turn_rad = metrics::summarize(turn);

  const std::set<int64_t> frames = keys_of(a.tracks, b.tracks);
  const int64_t begin_ns = frames.empty() ? 0 : stamp_of(*frames.begin(), a, b);
  std::vector<double> apart, faster;
  Lives lives_a, lives_b;
  for (const int64_t frame : frames) {
    const int64_t stamp_ns = stamp_of(frame, a, b);
    const auto of_a = confirmed_of(rows_at(a.tracks, frame)), of_b = confirmed_of(rows_at(b.tracks, frame));
    std::vector<bool> matched_a(of_a.size(), false), matched_b(of_b.size(), false);
    for (const Pair& p : match(of_a, of_b, x, y)) {
      matched_a[p.a] = matched_b[p.b] = true;
      apart.push_back(p.distance_m);
      if (!out.by_vehicle) faster.push_back(std::fabs(of_a[p.a].speed_mps - of_b[p.b].speed_mps));
    }
    for (std::size_t i = 0; i < of_a.size(); ++i) live(lives_a, of_a[i], stamp_ns, begin_ns, matched_a[i]);
    for (std::size_t i = 0; i < of_b.size(); ++i) live(lives_b, of_b[i], stamp_ns, begin_ns, matched_b[i]);
  }
  out.track_distance_m = metrics::summarize(apart), out.track_speed_mps = metrics::summarize(faster);
  finish(lives_a, out.a), finish(lives_b, out.b);
  return out;
}

void place_on_map(RunComparison& comparison, const std::string& map_file) {
  const CircuitMap map = read_circuit(map_file);
  for (RunCounts* run : {&comparison.a, &comparison.b}) {
    if (run->reference == Reference::kVehicle) continue;
    for (LoneTrack& t : run->lone_tracks) {
      const MapProjection at = map.project(t.x_m, t.y_m);
      t.s_m = at.s_m, t.d_m = at.d_m;
    }
  }
}

}  // namespace overtake::cli
