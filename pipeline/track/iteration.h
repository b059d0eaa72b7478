// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// One iteration: what it was given and what came of it. The history keeps both, so that it can run again.
#pragma once

#include <cstddef>
#include <cstdint>

#include "pipeline/track/frame_tracker.h"

namespace overtake {

// Exact for any two stamps; never overflows.
inline double seconds_between(int64_t from_ns, int64_t to_ns) {
  return to_ns >= from_ns ? double(uint64_t(to_ns) - uint64_t(from_ns)) / 1e9
                          : -(double(uint64_t(from_ns) - uint64_t(to_ns)) / 1e9);
}

inline constexpr int32_t kHasId = -1;  // TrackHead::birth

// What every tracker knows of a track. What is estimated is the policy's state, which holds at state_ns.
struct TrackHead {
  bool alive = false;
  TrackId id = kNobody;
  int32_t birth = kHasId;  // number of its birth (track_ids.h) as long as it has no id
  int64_t state_ns = 0, measured_ns = 0;
  int32_t row = -1;    // of the last iteration's frame: its measurement, -1 none
  uint32_t flags = 0;  // of the last iteration; kTrackStale is found when published
};

// The live tracks at one time, and the counts up to then.
struct SavedTracks {
  int32_t count;
  int32_t* slot;  // ascending
  TrackHead* head;
  std::byte* state;  // of the policy, one after the other
  IterationCounts counts;
};

struct Iteration {
  // given
  int64_t stamp_ns;
  TrackerEgo ego;
  bool in_map, ask_map;
  int32_t sector_count;  // -1: everything was seen
  ObservedSector sectors[kMaxSectors];
  int32_t rejected, unread;  // rows that are no measurement; beyond capacity
  int32_t count;
  Measurement* measurement;  // by (stamp, x, y, row); its covariance is one
  int32_t* row;              // of the frame
  double* ego_distance_m2;
  // what came of it when it ran last; columns by measurement
  int64_t work;           // steps it took
  bool limited;           // ... which the work limit cut short
  int32_t* slot;          // of the track that took it or that it gave birth to, -1 none
  TrackId* track;         // that track's id; kNobody for none, and until ids are settled for a newborn
  int32_t* birth;         // number of that track's birth as long as it has no id, else kHasId
  TrackId* track_before;  // `track` before the iteration ran again
  SavedTracks before;
};

// What the iteration is given: the frame's sane values, its measurements in an order that depends on what was measured.
void read_frame(const TrackerParams& params, const TrackerFrame& frame, Iteration& it) noexcept;

// Whether a sensor of the frame could see the place.
bool is_observed(const Iteration& it, double x_m, double y_m) noexcept;

}  // namespace overtake
