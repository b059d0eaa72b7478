// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// One iteration: its input and its result. The history keeps both, so that the iteration can run again.
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

struct Place {
  double x_m, y_m;
};
inline Place place_of(const Measurement& z) { return {z.x_m, z.y_m}; }
inline double distance_m2(Place a, Place b) {
  const double dx = a.x_m - b.x_m, dy = a.y_m - b.y_m;
  return dx * dx + dy * dy;
}

inline constexpr int32_t kHasId = -1;  // TrackHead::birth

// The part of a track that every tracker has. The policy's state has the estimate at state_ns.
struct TrackHead {
  bool alive = false;
  TrackId id = kNobody;
  int32_t birth = kHasId;  // its birth number (track_ids.h) while it has no id
  int64_t state_ns = 0, measured_ns = 0;
  int32_t row = -1;    // of its measurement in the last iteration's frame, -1 none
  uint32_t flags = 0;  // of the last iteration; publish adds kTrackStale
};

// Finds jumps of the ego poses from iteration to iteration: a pose that speed and yaw rate do not lead to. Then the
// localisation has corrected itself, and everything around seems to have moved on the map. An iteration's pose lies
// between two pushed ones, so a jump may come in parts.
struct EgoJumps {
  int64_t stamp_ns = 0;
  TrackerEgo ego;  // of the last iteration that had one
  // How far poses were from where the last ones led: sums that fade. A jump ends the first ones, a far jump the last.
  double off_x_m = 0, off_y_m = 0, off_rad = 0, far_x_m = 0, far_y_m = 0;
  int64_t jumped_ns = 0;              // stamp of the last jump; the first pose is one
  int64_t jumped_far_ns = INT64_MIN;  // of the last one by over 5 m, by the pushed speed or by the places alone
  // Of the last iteration: whether the pose jumped by 0.5 to 5 m, or farther, and how far from where the way before
  // leads. A pushed speed may be wrong for long, so a jump that moves tracks is one of the places, too.
  bool jumped = false, jumped_far = false;
  double jump_x_m = 0, jump_y_m = 0;
  TrackerEgo since;  // the place from which the velocity of the way is measured
  int64_t since_ns = 0;
  bool has_way = false;
  int32_t doubts = 0;  // places in a row that the way does not lead to
  double way_x_mps = 0, way_y_mps = 0;

  void follow(int64_t now_ns, const TrackerEgo& now) noexcept;
  void follow_way(int64_t now_ns, const TrackerEgo& last, double dt_s) noexcept;
  void note_far_jump(int64_t now_ns) noexcept { jumped_far_ns = now_ns, far_x_m = far_y_m = 0.0; }
  // Infinite before the first one.
  double since_jump_s(int64_t now_ns) const noexcept;
  double since_far_jump_s(int64_t now_ns) const noexcept;
};

// The live tracks at one time, the last ego pose and its jump, and the counts up to then.
struct SavedTracks {
  EgoJumps jumps;
  int32_t count;
  int32_t* slot;  // ascending
  TrackHead* head;
  std::byte* state;  // the policy's states, one after the other
  IterationCounts counts;
};

struct Iteration {
  // input
  int64_t stamp_ns;
  TrackerEgo ego;
  bool in_map, ask_map, of_rows;
  int32_t sector_count;  // -1: everything was seen
  ObservedSector sectors[kMaxSensors];
  int32_t rejected, unread;  // invalid rows; rows beyond capacity
  int32_t count;
  Measurement* measurement;  // sorted by (stamp, x, y, row); valid covariances
  int32_t* row;              // row in the frame
  double* ego_distance_m2;   // from the ego, from the origin if its pose is unknown
  // result of the last run; columns by measurement
  // EgoJumps; only of policies that join tracks.
  double since_ego_jump_s, since_far_ego_jump_s;
  bool ego_jumped;
  int64_t work;           // in steps
  bool limited;           // the work limit shortened the run
  int32_t* slot;          // of the updated or initiated track, -1 none
  TrackId* track;         // that track's id; kNobody: none, or not yet settled
  int32_t* birth;         // that track's birth number while it has no id, else kHasId
  TrackId* track_before;  // `track` before the iteration ran again
  SavedTracks before;
};

// Values of a row that are given and count as not measured. A covariance is one value; r_diag stands in for it.
int32_t count_unusable(const Measurement& z, bool gives_covariance) noexcept;

// Fills the input: the frame's valid values, and its measurements in an order that depends on their values.
void read_frame(const TrackerParams& params, const TrackerFrame& frame, Iteration& it) noexcept;

// Whether a sensor of the frame could see the place.
bool is_observed(const Iteration& it, double x_m, double y_m) noexcept;

}  // namespace overtake
