// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
#include "tools/evaluation/pieces.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <set>

#include "tools/io/error.h"
#include "tools/io/text.h"

namespace overtake::evaluation {
namespace {

std::string text_of(double seconds) {
  std::string text;
  io::append_number(text, seconds);
  return text;
}

double seconds_of(const Run& run, const char* key) {
  double value = 0;
  if (!io::parse_number(run.about.at(key), value))
    throw io::Error(run.folder + "/about.json", 0, std::string(key) + " is no number");
  return value;
}

struct Place {
  double id, x_m, y_m;
};
// The tracks at the first or at the last frame of the cuts, and this frame; -1 without tracks.
std::vector<Place> tracks_at(const Table& cuts, bool last, double& frame) {
  frame = -1;
  std::vector<Place> out;
  for (std::size_t r = 0; r < cuts.rows(); ++r)
    if (frame < 0 || (last ? cuts.at(r, 0) > frame : cuts.at(r, 0) < frame)) frame = cuts.at(r, 0);
  for (std::size_t r = 0; r < cuts.rows(); ++r)
    if (cuts.at(r, 0) == frame) out.push_back({cuts.at(r, 1), cuts.at(r, 2), cuts.at(r, 3)});
  return out;
}

// Pairs of ids, the nearest first: an id of `next` and that of `before`.
std::map<double, double> pair_tracks(const std::vector<Place>& before, const std::vector<Place>& next) {
  struct Pair {
    double distance_m;
    std::size_t a, b;
  };
  std::vector<Pair> pairs;
  for (std::size_t a = 0; a < before.size(); ++a)
    for (std::size_t b = 0; b < next.size(); ++b)
      if (const double d = std::hypot(before[a].x_m - next[b].x_m, before[a].y_m - next[b].y_m); d <= kCutPlaceM)
        pairs.push_back({d, a, b});
  std::stable_sort(pairs.begin(), pairs.end(),
                   [](const Pair& p, const Pair& q) { return p.distance_m < q.distance_m; });
  std::set<std::size_t> used_a, used_b;
  std::map<double, double> out;
  for (const Pair& p : pairs)
    if (!used_a.count(p.a) && !used_b.count(p.b)) {
      used_a.insert(p.a), used_b.insert(p.b);
      out[next[p.b].id] = before[p.a].id;
    }
  return out;
}

constexpr const char* kWithIds[] = {"tracks", "existence", "parked_tracks"};

template <class Function>
void for_each_id(Tables& tables, Function&& function) {
  for (const char* name : kWithIds) {
    Table& table = tables.at(name);
    const std::size_t column = table.column("id"), width = table.columns.size();
    for (std::size_t r = 0; r < table.rows(); ++r) function(table.cells[r * width + column]);
  }
}

void check_fit(const std::vector<Run>& pieces) {
  const std::string what = pieces[0].variant + " on " + pieces[0].about.at("log");
  double until_s = 0;
  for (const Run& piece : pieces) {
    const double from_s = seconds_of(piece, "from_s");
    if (until_s < 0 || from_s < until_s) throw io::Error(piece.folder, 0, "overlaps another piece of " + what);
    if (from_s > until_s)
      throw io::Error(piece.folder, 0,
                      "no piece of " + what + " from " + text_of(until_s) + " to " + text_of(from_s) + " s");
    until_s = piece.about.at("to_s") == "end" ? -1 : seconds_of(piece, "to_s");
    for (const char* key : {"input", "compared", "extent", "config", "frame_limit", "every"})
      if (piece.about.count(key) != pieces[0].about.count(key) ||
          (piece.about.count(key) && piece.about.at(key) != pieces[0].about.at(key)))
        throw io::Error(piece.folder, 0, "differs in '" + std::string(key) + "' from " + pieces[0].folder);
  }
  if (until_s >= 0)
    throw io::Error(pieces.back().folder, 0, "no piece of " + what + " from " + text_of(until_s) + " s to the end");
}

}  // namespace

PieceTimes::PieceTimes(double from_s, double to_s, double warm_up_s)
    : from_s_(from_s), to_s_(to_s), warm_up_s_(warm_up_s) {
  if (to_s >= 0 && to_s <= from_s)
    throw io::Error("--to " + text_of(to_s), 0, "is not after --from " + text_of(from_s));
}

int64_t PieceTimes::ns_of(double seconds) { return std::llround(seconds * 1e9); }
int64_t PieceTimes::warm_up_ns() const { return std::max<int64_t>(0, begin_ns() - ns_of(warm_up_s_)); }

std::string PieceTimes::name_of(const std::string& log) const {
  return is_whole() ? log : log + "_from_" + text_of(from_s_) + "s";
}

void PieceTimes::add_to(About& about, const std::string& log) const {
  if (is_whole()) return;
  about["log"] = log, about["from_s"] = text_of(from_s_), about["to_s"] = to_s_ < 0 ? "end" : text_of(to_s_);
  about["warm_up_s"] = text_of(warm_up_s_);
}

int64_t first_stamp(const LogFrame& frame) {
  int64_t first_ns = INT64_MAX;
  for (const io::SensorScan& scan : frame.scans.scans) first_ns = std::min(first_ns, scan.stamp_ns);
  return first_ns;
}

Run join_pieces(std::vector<Run> pieces) {
  std::sort(pieces.begin(), pieces.end(),
            [](const Run& a, const Run& b) { return seconds_of(a, "from_s") < seconds_of(b, "from_s"); });
  check_fit(pieces);
  Run out = std::move(pieces[0]);
  out.log = out.about.at("log");
  double fresh = 0, last_frame = 0;
  std::vector<Place> last = tracks_at(out.tables.at("cuts"), true, last_frame);
  for_each_id(out.tables, [&](double id) { fresh = std::max(fresh, id); });
  int64_t frames = std::stoll(out.about.at("frames"));
  for (std::size_t k = 1; k < pieces.size(); ++k) {
    Run& piece = pieces[k];
    const Table cuts = piece.tables.at("cuts");
    double warm_frame = 0, end_frame = 0;
    const std::vector<Place> warm = tracks_at(cuts, false, warm_frame);
    // Without a warm-up the piece's only cut is its end, a later frame.
    std::map<double, double> names = warm_frame == last_frame ? pair_tracks(last, warm) : std::map<double, double>();
    const auto rename = [&](double& id) {
      const auto [at, is_new] = names.try_emplace(id);
      if (is_new) at->second = ++fresh;
      id = at->second;
    };
    for_each_id(piece.tables, rename);
    std::vector<Place> end = tracks_at(cuts, true, end_frame);
    for (Place& p : end) rename(p.id);
    if (end_frame >= 0 || std::stoll(piece.about.at("frames")) > 0) last = std::move(end), last_frame = end_frame;
    for (auto& [name, table] : out.tables) {
      const std::vector<double>& more = piece.tables.at(name).cells;
      table.cells.insert(table.cells.end(), more.begin(), more.end());
    }
    frames += std::stoll(piece.about.at("frames"));
    if (out.about["damage"].empty()) out.about["damage"] = piece.about["damage"];
    if (out.about["cpu"] != piece.about["cpu"]) out.about["cpu"] += ", " + piece.about["cpu"];
    piece = {};
  }
  out.tables.at("cuts").cells.clear();
  out.about["frames"] = std::to_string(frames);
  for (const char* key : {"log", "from_s", "to_s", "warm_up_s"}) out.about.erase(key);
  return out;
}

}  // namespace overtake::evaluation
