// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// Ids of tracks. A track is born with a number, and gets its id when all iterations that a frame makes run have run. In
// a frame in sequence that is a new id. Where iterations ran again, a track that was born in one of them is, for
// whoever reads the ids, the earlier track with which it shares most measurements; an id goes to one track only, and
// never to two that lived at one time.
#pragma once

#include "pipeline/track/track_history.h"

namespace overtake {

class TrackIds {
 public:
  void carve(Carver& carver, const TrackerParams& params);
  // Before the iterations of a frame run.
  void begin() noexcept { birth_count_ = 0; }
  // The number of a track that the iteration at `place` gives birth to.
  int32_t add_birth(int32_t place, int32_t slot) noexcept;
  // After the iterations from `first` on ran: gives the tracks born in them their ids, everywhere. `head`: by slot.
  void settle(TrackHistory& history, int32_t first, TrackHead* head) noexcept;

 private:
  struct Birth {
    int32_t place, slot;
    TrackId id;
    bool alive;  // still
  };
  // Measurements that one of these tracks shares with an earlier one.
  struct Vote {
    TrackId id;
    int32_t birth, count;
  };

  int32_t collect_votes(const TrackHistory& history, int32_t first) noexcept;
  int32_t find_held(const TrackHistory& history, int32_t first, const TrackHead* head) noexcept;
  int32_t drop_votes_for_held(int32_t vote_count, int32_t held_count) noexcept;
  int32_t add_up(int32_t vote_count) noexcept;
  void hand_out(int32_t pairs) noexcept;

  int32_t slot_count_ = 0;
  uint32_t* generation_ = nullptr;  // by slot: grows with each id drawn, never goes back
  int32_t birth_count_ = 0;
  Birth* births_ = nullptr;
  Vote* votes_ = nullptr;
  TrackId* known_ = nullptr;  // the earlier ids, ascending
  bool* taken_ = nullptr;
  int32_t* held_ = nullptr;        // slots of the tracks put back, by id
  TrackId* held_id_ = nullptr;     // by slot: its track's id
  int32_t* held_until_ = nullptr;  // by slot: the last iteration in which it lives or measures
};

}  // namespace overtake
