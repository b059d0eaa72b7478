// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// The tracker's last iterations: what each was given, and the tracks before it, so that an older frame can be put in
// its place in time and what came after it run again.
//
//   oldest                                            newest
//   | tracks 0 | input 0 | tracks 1 | input 1 | ... | input n | -> the tracks as they are
//                                  ^ an older frame goes here: back to tracks 2, its input, input 2, input 3, ...
#pragma once

#include <cstdint>

#include "core/math.h"
#include "pipeline/track/life_cycle.h"
#include "pipeline/track/track_filter.h"
#include "pipeline/track/tracker.h"

namespace overtake {

// Exact for any two stamps; never overflows.
inline double seconds_between(int64_t from_ns, int64_t to_ns) {
  return to_ns >= from_ns ? double(uint64_t(to_ns) - uint64_t(from_ns)) / 1e9
                          : -(double(uint64_t(from_ns) - uint64_t(to_ns)) / 1e9);
}

// One slot. What is estimated holds at state_ns.
struct Track {
  bool alive = false;
  TrackId id = kNobody;
  LifeCycle life;
  int64_t state_ns = 0, measured_ns = 0;
  TrackEstimate estimate;
  bool has_heading = false;
  double heading_rad = 0;            // of the last detection that had one, turned on by omega
  double length_m = 0, width_m = 0;  // 0: never measured
  int32_t detection = -1;            // row of the last step's measurement
  uint32_t flags = 0;                // of the last step; kTrackStale is found when published
};

// The live tracks at one time.
struct SavedTracks {
  int32_t count;
  int32_t* slot;
  Track* track;
  TrackerCounts counts;
};

struct Iteration {
  int64_t stamp_ns;
  TrackerEgo ego;
  bool in_map, ask_map;
  int32_t sector_count;  // -1: everything was seen
  ObservedSector sectors[kMaxSectors];
  int32_t rejected, unread;  // rows that are no measurement; beyond capacity
  int64_t work;              // steps it took when it ran last
  bool limited;              // ... which the work limit cut short
  // Columns by measurement.
  int32_t count;
  Measurement* measurement;  // by (stamp, x, y, row); its covariance is one
  int32_t* row;              // of the frame
  double* ego_distance_m2;
  int32_t* slot;          // of the track that took it or that it gave birth to, -1 none
  TrackId* track;         // whose measurement it is, kNobody none
  TrackId* track_before;  // the same, before it ran again
  SavedTracks before;
};

// What is known of a track that was born while iterations ran again.
struct ReplayBirth {
  int32_t iteration, slot;
  TrackId id;  // found by settle_ids
  bool alive;
};
// Measurements that one such track shares with an earlier one.
struct ReplayVote {
  TrackId id;
  int32_t birth, count;
};
struct ReplayIds {
  int32_t iteration = 0;  // the one that runs
  int32_t birth_count = 0;
  ReplayBirth* births = nullptr;
  ReplayVote* votes = nullptr;
  TrackId* known = nullptr;  // the earlier ids, ascending
  bool* taken = nullptr;
  int32_t* held = nullptr;        // slots of the tracks put back, by id
  TrackId* held_id = nullptr;     // by slot: its track's id
  int32_t* held_until = nullptr;  // by slot: the last iteration in which it lives or measures
};

class TrackHistory {
 public:
  void carve(Carver& carver, const TrackerParams& params);
  // Where a frame of this stamp goes: among the iterations, after those of equal stamp; count() when it is the newest.
  // -1: late.
  int32_t find_place(int64_t stamp_ns) const noexcept;
  // Makes room there, and says where it is then: the oldest iteration is forgotten when the history is full.
  Iteration& insert(int32_t& place) noexcept;
  // Forgets everything; nothing may come before the next iteration.
  void clear() noexcept;

  // Steps that the iterations from `place` on took when they ran last.
  int64_t work_from(int32_t place) const noexcept;

  int32_t count() const noexcept { return count_; }
  Iteration& at(int32_t place) noexcept { return iterations_[order_[place]]; }
  const Iteration& at(int32_t place) const noexcept { return iterations_[order_[place]]; }

 private:
  int32_t count_ = 0, capacity_ = 0;
  double span_s_ = 0;
  bool reaches_back_ = true;  // whether what came before the oldest is known: nothing did
  Iteration* iterations_ = nullptr;
  int32_t* order_ = nullptr;  // by time -> in iterations_; those of no use follow
};

}  // namespace overtake
