// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// Ids after iterations ran again. A track that was put back keeps its id. One that was born while they ran again is,
// for whoever reads the ids, the earlier track with which it shares most measurements; an id goes to one track only,
// and never to two that lived at one time.
#include <algorithm>
#include <tuple>

#include "pipeline/track/tracker_state.h"

namespace overtake {
namespace {

// Until its id is found, a track born while iterations run again has a number: no slot is this high.
constexpr uint32_t kReplaySlot = UINT32_MAX;
bool is_number(TrackId id) { return slot_of(id) == kReplaySlot; }
int32_t index_of(TrackId id) { return int32_t(generation_of(id)); }

template <class F>
void for_each_live(const Tracker::State& state, F&& f) {
  for (int32_t slot = 0; slot < state.params.track_capacity; ++slot)
    if (state.tracks[slot].alive) f(slot, state.tracks[slot].id);
}

// The tracks put back, and the last iteration each lived or measured in.
int32_t find_held(Tracker::State& state, int32_t first) {
  ReplayIds& r = state.replay;
  std::fill_n(r.held_id, state.params.track_capacity, kNobody);
  const SavedTracks& put_back = state.history.at(first).before;
  for (int32_t i = 0; i < put_back.count; ++i) {
    r.held[i] = put_back.slot[i];
    r.held_id[put_back.slot[i]] = put_back.track[i].id;
    r.held_until[put_back.slot[i]] = first - 1;
  }
  const auto lives = [&r](int32_t slot, TrackId id, int32_t place) {
    if (id != kNobody && r.held_id[slot] == id) r.held_until[slot] = place;
  };
  for (int32_t place = first; place < state.history.count(); ++place) {
    const Iteration& it = state.history.at(place);
    if (place > first)
      for (int32_t i = 0; i < it.before.count; ++i) lives(it.before.slot[i], it.before.track[i].id, place - 1);
    for (int32_t c = 0; c < it.count; ++c)
      if (it.slot[c] >= 0) lives(it.slot[c], it.track[c], place);
  }
  for_each_live(state, [&](int32_t slot, TrackId id) { lives(slot, id, state.history.count() - 1); });
  std::sort(r.held, r.held + put_back.count, [&r](int32_t a, int32_t b) { return r.held_id[a] < r.held_id[b]; });
  return put_back.count;
}

// One vote for each measurement that a new-born track shares with an earlier one whose id may go to it.
int32_t collect_votes(Tracker::State& state, int32_t first, int32_t held_count) {
  ReplayIds& r = state.replay;
  const auto is_held_at = [&](TrackId id, int32_t place) {
    const int32_t* found = std::lower_bound(r.held, r.held + held_count, id,
                                            [&r](int32_t slot, TrackId wanted) { return r.held_id[slot] < wanted; });
    return found != r.held + held_count && r.held_id[*found] == id && r.held_until[*found] >= place;
  };
  int32_t count = 0;
  for (int32_t place = first; place < state.history.count(); ++place) {
    const Iteration& it = state.history.at(place);
    for (int32_t c = 0; c < it.count; ++c) {
      const TrackId earlier = it.track_before[c];
      if (earlier == kNobody || !is_number(it.track[c])) continue;
      const int32_t birth = index_of(it.track[c]);
      if (!is_held_at(earlier, r.births[birth].iteration)) r.votes[count++] = {earlier, birth, 1};
    }
  }
  return count;
}

// Votes of one pair become one; returns how many pairs there are.
int32_t add_up(ReplayVote* votes, int32_t count) {
  std::sort(votes, votes + count,
            [](const ReplayVote& a, const ReplayVote& b) { return std::tie(a.birth, a.id) < std::tie(b.birth, b.id); });
  int32_t pairs = 0;
  for (int32_t i = 0; i < count; ++i) {
    if (pairs > 0 && votes[pairs - 1].birth == votes[i].birth && votes[pairs - 1].id == votes[i].id)
      ++votes[pairs - 1].count;
    else
      votes[pairs++] = votes[i];
  }
  return pairs;
}

// Tracks that live choose first, then those with more measurements in common, the earlier born, the lower id.
void hand_out_ids(Tracker::State& state, int32_t pairs) {
  ReplayIds& r = state.replay;
  for (int32_t i = 0; i < pairs; ++i) r.known[i] = r.votes[i].id;
  std::sort(r.known, r.known + pairs);
  TrackId* const known_end = std::unique(r.known, r.known + pairs);
  std::fill_n(r.taken, known_end - r.known, false);
  std::sort(r.votes, r.votes + pairs, [&r](const ReplayVote& a, const ReplayVote& b) {
    const bool dead_a = !r.births[a.birth].alive, dead_b = !r.births[b.birth].alive;
    return std::tie(dead_a, b.count, a.birth, a.id) < std::tie(dead_b, a.count, b.birth, b.id);
  });
  for (int32_t i = 0; i < pairs; ++i) {
    ReplayBirth& birth = r.births[r.votes[i].birth];
    bool& taken = r.taken[std::lower_bound(r.known, known_end, r.votes[i].id) - r.known];
    if (birth.id != kNobody || taken) continue;
    birth.id = r.votes[i].id;
    taken = true;
  }
  for (int32_t i = 0; i < r.birth_count; ++i)
    if (r.births[i].id == kNobody) r.births[i].id = state.draw_id(r.births[i].slot);
}

}  // namespace

TrackId number_birth(ReplayIds& r, int32_t slot) noexcept {
  r.births[r.birth_count] = {r.iteration, slot, kNobody, false};
  return make_track_id(kReplaySlot, uint32_t(r.birth_count++));
}

void settle_ids(Tracker::State& state, int32_t first) noexcept {
  ReplayIds& r = state.replay;
  if (r.birth_count == 0) return;
  for_each_live(state, [&r](int32_t, TrackId id) {
    if (is_number(id)) r.births[index_of(id)].alive = true;
  });
  const int32_t held_count = find_held(state, first);
  hand_out_ids(state, add_up(r.votes, collect_votes(state, first, held_count)));

  const auto name = [&r](TrackId& id) {
    if (is_number(id)) id = r.births[index_of(id)].id;
  };
  for (int32_t place = first; place < state.history.count(); ++place) {
    Iteration& it = state.history.at(place);
    for (int32_t c = 0; c < it.count; ++c) name(it.track[c]);
    for (int32_t i = 0; i < it.before.count; ++i) name(it.before.track[i].id);
  }
  for (int32_t slot = 0; slot < state.params.track_capacity; ++slot) name(state.tracks[slot].id);
}

}  // namespace overtake
