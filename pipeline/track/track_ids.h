// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// Ids of tracks. An initiated track has a birth number first, and gets its id after all iterations of a frame have run.
// In a frame in sequence that is a new id. If iterations ran again, a track that one of them initiated inherits the id
// of the earlier track with which it shares most measurements. One id goes to one track only, and never to two tracks
// that live at the same time.
#pragma once

#include "pipeline/track/track_history.h"

namespace overtake {

class TrackIds {
 public:
  void carve(Carver& carver, const TrackerParams& params);
  // Called before the iterations of a frame.
  void begin() noexcept { birth_count_ = 0; }
  // Returns the birth number of a track that the iteration at `place` initiates.
  int32_t add_birth(int32_t place, int32_t slot) noexcept;
  // Called after the iterations from `first` on: writes the ids of the tracks that they initiated to the history and to
  // `head` (by slot).
  void settle(TrackHistory& history, int32_t first, TrackHead* head) noexcept;

 private:
  struct Birth {
    int32_t place, slot;
    TrackId id;
    bool alive;  // after the last iteration
  };
  // Number of measurements that an initiated track shares with an earlier track.
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
  uint32_t* generation_ = nullptr;  // by slot: grows with each new id, never decreases
  int32_t birth_count_ = 0;
  Birth* births_ = nullptr;
  Vote* votes_ = nullptr;
  TrackId* known_ = nullptr;  // the earlier ids, ascending
  bool* taken_ = nullptr;
  int32_t* held_ = nullptr;        // slots of the restored tracks, by id
  TrackId* held_id_ = nullptr;     // by slot: its track's id
  int32_t* held_until_ = nullptr;  // by slot: the last iteration in which it lives or is measured
};

}  // namespace overtake
