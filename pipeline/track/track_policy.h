// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// A policy says what one iteration does to one track: what is estimated (State), predict, associate (with its cost),
// update, initiate, life, publish. ReplayTracker<Policy> (replay_tracker.h) is the tracker; nothing of it needs to
// change for a new policy. cvtr_tracker.h is the paper's.
//
// A policy is built as Policy(params, map, allocator), where all its own memory comes from the allocator and the
// parameters are sane. It may keep what it found while associating for the updates of the same iteration, nothing
// longer: an iteration that runs again must give the same bytes.
#pragma once

#include <concepts>
#include <type_traits>

#include "pipeline/track/iteration.h"

namespace overtake {

struct Place {
  double x_m, y_m;
};

// The tracks as an association sees them, by slot.
template <class State>
struct TrackView {
  int32_t slot_count, alive_count;
  const TrackHead* head;
  const State* state;
};

// What an association cost, in the steps of work_limit, and whether the limit cut it short.
struct Effort {
  int64_t work = 0;
  bool limited = false;
};

template <class P>
concept TrackPolicy = std::is_trivially_copyable_v<typename P::State> &&
    requires(P& policy, const P& constant, typename P::State& state, const typename P::State& seen, double dt_s,
             const Measurement& z, const Iteration& it, bool hit, bool in_map, int32_t slot,
             const TrackView<typename P::State>& tracks, int32_t* measurement_of_slot, TrackTable& rows, std::size_t i,
             PathTable& paths) {
  // Moves a state by dt_s; where dt_s is negative, back without process noise.
  constant.predict(state, dt_s);
  { constant.place(seen) } -> std::same_as<Place>;
  // Whether the numbers are still those of a car.
  { constant.is_sound(seen) } -> std::same_as<bool>;

  // Writes the measurement of each slot, -1 none; no measurement goes to two slots, and none to a slot whose state
  // is more than kMaxBackward_s ahead of it.
  { policy.associate(tracks, it, measurement_of_slot) } -> std::same_as<Effort>;
  // The state of that slot takes the measurement, which is dt_s away from it, and moves on to there; where dt_s is
  // negative it goes back, takes the measurement and returns.
  policy.update(slot, state, dt_s, z);
  // The state of a track that the measurement gives birth to: its first hit.
  { constant.initiate(z, it) } -> std::same_as<typename P::State>;

  // One iteration that could have seen the track. False: the track is dead.
  { constant.record(state, hit) } -> std::same_as<bool>;
  // In a full table a track that is not confirmed makes room for a nearer one.
  { constant.is_confirmed(seen) } -> std::same_as<bool>;

  // A state as it leaves the tracker: what has to be decided at the state's own time.
  { constant.publishable(seen, in_map) } -> std::same_as<typename P::State>;
  // Writes state, x to yaw rate, covariance, heading, extent, age and hits of row i.
  constant.write(seen, rows, i);
  // Appends the points_per_track points of its predicted path.
  constant.write_path(seen, paths);
};

}  // namespace overtake
