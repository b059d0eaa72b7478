// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
#include "tools/evaluation/metrics/clear_mot.h"

#include <cmath>
#include <limits>

#include "tools/evaluation/metrics/assignment.h"

namespace overtake::metrics {
namespace {

double distance_m(const MotPlace& a, const MotPlace& b) { return std::hypot(a.x_m - b.x_m, a.y_m - b.y_m); }

}  // namespace

double ClearMotCounts::mota() const {
  if (objects == 0) return std::numeric_limits<double>::quiet_NaN();
  return 1.0 - double(misses + false_positives + switches) / double(objects);
}

double ClearMotCounts::motp_m() const {
  return matches == 0 ? std::numeric_limits<double>::quiet_NaN() : distance_m / double(matches);
}

ClearMotCounts& ClearMotCounts::operator+=(const ClearMotCounts& other) {
  frames += other.frames;
  objects += other.objects;
  tracks += other.tracks;
  matches += other.matches;
  misses += other.misses;
  false_positives += other.false_positives;
  switches += other.switches;
  fragments += other.fragments;
  distance_m += other.distance_m;
  return *this;
}

void ClearMot::add_frame(const std::vector<MotPlace>& objects, const std::vector<MotPlace>& tracks) {
  track_of_object_.assign(objects.size(), -1);
  track_taken_.assign(tracks.size(), false);
  keep_last(objects, tracks);
  pair_rest(objects, tracks);
  count(objects, tracks);
}

void ClearMot::keep_last(const std::vector<MotPlace>& objects, const std::vector<MotPlace>& tracks) {
  std::map<uint64_t, std::size_t> row_of_track;
  for (std::size_t j = 0; j < tracks.size(); ++j) row_of_track[tracks[j].id] = j;
  for (std::size_t i = 0; i < objects.size(); ++i) {
    const auto last = memory_.find(objects[i].id);
    if (last == memory_.end() || holder_[last->second.track] != objects[i].id) continue;
    const auto row = row_of_track.find(last->second.track);
    if (row == row_of_track.end() || !(distance_m(objects[i], tracks[row->second]) <= gate_m_)) continue;
    track_of_object_[i] = int32_t(row->second);
    track_taken_[row->second] = true;
  }
}

void ClearMot::pair_rest(const std::vector<MotPlace>& objects, const std::vector<MotPlace>& tracks) {
  // More than any number of pairs costs: as many pairs as the gate allows, then the nearest.
  const double alone = 1.0 + 1e3 * gate_m_ * double(objects.size() + 1);
  const std::vector<int32_t> track_of_row =
      assign(int32_t(objects.size()), int32_t(tracks.size()), alone, [&](int32_t i, int32_t j) {
        if (track_of_object_[std::size_t(i)] >= 0 || track_taken_[std::size_t(j)]) return kForbidden;
        const double apart_m = distance_m(objects[std::size_t(i)], tracks[std::size_t(j)]);
        return apart_m <= gate_m_ ? apart_m : kForbidden;
      });
  for (std::size_t i = 0; i < objects.size(); ++i) {
    if (track_of_row[i] < 0) continue;
    track_of_object_[i] = track_of_row[i];
    track_taken_[std::size_t(track_of_row[i])] = true;
  }
}

void ClearMot::count(const std::vector<MotPlace>& objects, const std::vector<MotPlace>& tracks) {
  ++counts_.frames;
  counts_.objects += int64_t(objects.size());
  counts_.tracks += int64_t(tracks.size());
  for (const bool taken : track_taken_) counts_.false_positives += taken ? 0 : 1;
  for (std::size_t i = 0; i < objects.size(); ++i) {
    const auto last = memory_.find(objects[i].id);
    if (track_of_object_[i] < 0) {
      ++counts_.misses;
      if (last != memory_.end()) last->second.missed = true;
      continue;
    }
    const MotPlace& track = tracks[std::size_t(track_of_object_[i])];
    ++counts_.matches;
    counts_.distance_m += distance_m(objects[i], track);
    if (last != memory_.end()) {
      counts_.switches += last->second.track != track.id ? 1 : 0;
      counts_.fragments += last->second.missed ? 1 : 0;
    }
    memory_[objects[i].id] = {track.id, false};
    holder_[track.id] = objects[i].id;
  }
}

}  // namespace overtake::metrics
