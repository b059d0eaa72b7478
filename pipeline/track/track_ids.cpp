// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
#include "pipeline/track/track_ids.h"

#include <algorithm>
#include <tuple>

namespace overtake {

void TrackIds::carve(Carver& carver, const TrackerParams& params) {
  slot_count_ = params.track_capacity;
  const auto slots = std::size_t(params.track_capacity);
  const std::size_t rows = std::size_t(params.detection_capacity) * std::size_t(params.history_iterations);
  generation_ = carver.take<uint32_t>(slots);
  births_ = carver.take<Birth>(rows);
  votes_ = carver.take<Vote>(rows);
  known_ = carver.take<TrackId>(rows);
  taken_ = carver.take<bool>(rows);
  held_ = carver.take<int32_t>(slots);
  held_id_ = carver.take<TrackId>(slots);
  held_until_ = carver.take<int32_t>(slots);
}

int32_t TrackIds::add_birth(int32_t place, int32_t slot) noexcept {
  births_[birth_count_] = {place, slot, kNobody, false};
  return birth_count_++;
}

// One vote for each measurement that an initiated track shares with an earlier one.
int32_t TrackIds::collect_votes(const TrackHistory& history, int32_t first) noexcept {
  int32_t count = 0;
  for (int32_t place = first; place < history.count(); ++place) {
    const Iteration& it = history.at(place);
    for (int32_t i = 0; i < it.count; ++i)
      if (it.track_before[i] != kNobody && it.birth[i] != kHasId)
        votes_[count++] = {it.track_before[i], it.birth[i], 1};
  }
  return count;
}

// Finds the restored tracks, and the last iteration in which each lives or is measured.
int32_t TrackIds::find_held(const TrackHistory& history, int32_t first, const TrackHead* head) noexcept {
  std::fill_n(held_id_, slot_count_, kNobody);
  const SavedTracks& put_back = history.at(first).before;
  for (int32_t i = 0; i < put_back.count; ++i) {
    held_[i] = put_back.slot[i];
    held_id_[put_back.slot[i]] = put_back.head[i].id;
    held_until_[put_back.slot[i]] = first - 1;
  }
  const auto lives = [this](int32_t slot, TrackId id, int32_t place) {
    if (id != kNobody && held_id_[slot] == id) held_until_[slot] = place;
  };
  for (int32_t place = first; place < history.count(); ++place) {
    const Iteration& it = history.at(place);
    if (place > first)
      for (int32_t i = 0; i < it.before.count; ++i) lives(it.before.slot[i], it.before.head[i].id, place - 1);
    for (int32_t i = 0; i < it.count; ++i)
      if (it.slot[i] >= 0) lives(it.slot[i], it.track[i], place);
  }
  for (int32_t slot = 0; slot < slot_count_; ++slot)
    if (head[slot].alive) lives(slot, head[slot].id, history.count() - 1);
  std::sort(held_, held_ + put_back.count, [this](int32_t a, int32_t b) { return held_id_[a] < held_id_[b]; });
  return put_back.count;
}

// Drops the votes for ids that another track still had at the birth.
int32_t TrackIds::drop_votes_for_held(int32_t vote_count, int32_t held_count) noexcept {
  const auto is_held = [&](const Vote& vote) {
    const int32_t* found = std::lower_bound(held_, held_ + held_count, vote.id,
                                            [this](int32_t slot, TrackId id) { return held_id_[slot] < id; });
    return found != held_ + held_count && held_id_[*found] == vote.id &&
           held_until_[*found] >= births_[vote.birth].place;
  };
  return int32_t(std::remove_if(votes_, votes_ + vote_count, is_held) - votes_);
}

// Adds up the votes of each pair (birth, id); returns the number of pairs.
int32_t TrackIds::add_up(int32_t vote_count) noexcept {
  std::sort(votes_, votes_ + vote_count,
            [](const Vote& a, const Vote& b) { return std::tie(a.birth, a.id) < std::tie(b.birth, b.id); });
  int32_t pairs = 0;
  for (int32_t i = 0; i < vote_count; ++i) {
    if (pairs > 0 && votes_[pairs - 1].birth == votes_[i].birth && votes_[pairs - 1].id == votes_[i].id)
      ++votes_[pairs - 1].count;
    else
      votes_[pairs++] = votes_[i];
  }
  return pairs;
}

// Assigns earlier ids to births. Order: live tracks first, then more shared measurements, earlier birth, lower id.
void TrackIds::hand_out(int32_t pairs) noexcept {
  for (int32_t i = 0; i < pairs; ++i) known_[i] = votes_[i].id;
  std::sort(known_, known_ + pairs);
  TrackId* const known_end = std::unique(known_, known_ + pairs);
  std::fill_n(taken_, known_end - known_, false);
  std::sort(votes_, votes_ + pairs, [this](const Vote& a, const Vote& b) {
    const bool dead_a = !births_[a.birth].alive, dead_b = !births_[b.birth].alive;
    return std::tie(dead_a, b.count, a.birth, a.id) < std::tie(dead_b, a.count, b.birth, b.id);
  });
  for (int32_t i = 0; i < pairs; ++i) {
    Birth& birth = births_[votes_[i].birth];
    bool& taken = taken_[std::lower_bound(known_, known_end, votes_[i].id) - known_];
    if (birth.id != kNobody || taken) continue;
    birth.id = votes_[i].id;
    taken = true;
  }
}

void TrackIds::settle(TrackHistory& history, int32_t first, TrackHead* head) noexcept {
  if (birth_count_ == 0) return;
  for (int32_t slot = 0; slot < slot_count_; ++slot)
    if (head[slot].alive && head[slot].birth != kHasId) births_[head[slot].birth].alive = true;
  if (const int32_t votes = collect_votes(history, first); votes > 0)
    hand_out(add_up(drop_votes_for_held(votes, find_held(history, first, head))));
  for (int32_t i = 0; i < birth_count_; ++i)
    if (Birth& birth = births_[i]; birth.id == kNobody)
      birth.id = make_track_id(uint32_t(birth.slot), ++generation_[birth.slot]);

  const auto name = [this](TrackId& id, int32_t& birth) {
    if (birth == kHasId) return;
    id = births_[birth].id;
    birth = kHasId;
  };
  for (int32_t place = first; place < history.count(); ++place) {
    Iteration& it = history.at(place);
    for (int32_t i = 0; i < it.count; ++i) name(it.track[i], it.birth[i]);
    for (int32_t i = 0; i < it.before.count; ++i) name(it.before.head[i].id, it.before.head[i].birth);
  }
  for (int32_t slot = 0; slot < slot_count_; ++slot) name(head[slot].id, head[slot].birth);
}

}  // namespace overtake
