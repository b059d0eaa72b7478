// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// A policy defines one iteration: the estimate of a track (State), predict, associate (with its cost), update,
// initiate, life cycle, publish. A policy that uses GlobalAssignment needs the members that global_assignment.h lists.
// ReplayTracker<Policy> (replay_tracker.h) is the tracker; a new policy needs no change there. cvtr_tracker.h has the
// paper's policy.
//
// The constructor is Policy(params, map, allocator): the parameters are valid, and all memory of the policy comes from
// the allocator. A policy may keep results of an association for the updates of the same iteration, but not longer: an
// iteration that runs again must give the same bytes.
#pragma once

#include <concepts>
#include <span>
#include <type_traits>

#include "pipeline/track/iteration.h"

namespace overtake {

// The tracks as an association sees them, by slot.
template <class State>
struct TrackView {
  int32_t slot_count, alive_count;
  const TrackHead* head;
  const State* state;
};

// Cost of an association in the steps of work_limit, and whether the limit shortened it.
struct Effort {
  int64_t work = 0;
  bool limited = false;
};

template <class P>
concept TrackPolicy = std::is_trivially_copyable_v<typename P::State> &&
    requires(P& policy, const P& constant, typename P::State& state, const typename P::State& seen, double dt_s,
             const Measurement& z, const Iteration& it, bool hit, bool in_map, int32_t slot,
             const TrackView<typename P::State>& tracks, int32_t* measurement_of_slot, TrackTable& rows, std::size_t i,
             PathTable& paths, std::span<const typename P::State> group) {
  // Predicts a state by dt_s; if dt_s is negative, back without process noise. ReplayTracker calls it also without an
  // update after it: for a miss, for publication and for ovt_advance.
  constant.predict(state, dt_s);
  { constant.place(seen) } -> std::same_as<Place>;
  // Whether the state is finite and within what a car can do.
  { constant.is_sound(seen) } -> std::same_as<bool>;

  // Writes the measurement of each slot, -1 none; no measurement goes to two slots, and none to a slot whose state
  // is more than kMaxBackward_s ahead of it.
  { policy.associate(tracks, it, measurement_of_slot) } -> std::same_as<Effort>;
  // Predicts the slot's state by dt_s to the measurement and updates it. If dt_s is negative, predicts back, updates,
  // and predicts forward to the state's time.
  policy.update(slot, state, dt_s, z);
  // The state of a track that the measurement initiates, including its first hit.
  { constant.initiate(z, it) } -> std::same_as<typename P::State>;

  // Records one iteration that could have seen the slot's track. False: the track is dead.
  { constant.record(slot, state, hit) } -> std::same_as<bool>;
  // A full table may evict a track that is not confirmed.
  { constant.is_confirmed(seen) } -> std::same_as<bool>;

  // The state to publish, with all decisions that depend on the state's own time.
  { constant.publishable(seen, in_map) } -> std::same_as<typename P::State>;
  // Writes state, x to yaw rate, covariance, heading, extent, age and hits of row i.
  constant.write(seen, rows, i);
  // Appends the points_per_track points of the predicted path of each state.
  constant.write_paths(group, paths);
};

// A policy with these members as well keeps one track for one car.
template <class P>
concept JoinsTracks = requires(P& policy, const P& constant, typename P::State& state, const typename P::State& seen,
                               const Iteration& it, int32_t slot, int32_t measurement, double distance, bool is_newer,
                               const TrackView<typename P::State>& tracks) {
  // The ego pose has jumped by so much since the iteration before, so the car's place on the map seems to have moved.
  constant.move_with_ego(state, distance, distance);
  // Called before the following, after each change of the tracks.
  policy.look_round(tracks, it);
  // The slot of an older track of the same car, -1 none.
  { constant.find_elder(tracks, slot) } -> std::same_as<int32_t>;
  // Joins the state of a younger track that ends to that of the elder; is_newer: the younger one was measured last.
  // True: the elder goes on from the younger one's estimate, which has the younger one's time.
  { constant.join(state, seen, is_newer) } -> std::same_as<bool>;
  // The slot of the track whose car a measurement without a track is a part of, -1 none: it initiates no track then.
  { constant.find_owner(tracks, it, measurement) } -> std::same_as<int32_t>;
};

// A policy with these members as well publishes the optional columns.
template <class P>
concept WritesOptional = requires(const P& constant, typename P::State& state, const typename P::State& seen,
                                  OptionalTrackTable& rows, std::size_t i) {
  // Whether this iteration, which could see the place of the track, tells by a miss that its car is not there.
  { constant.may_miss(seen) } -> std::same_as<bool>;
  // An iteration that tells nothing of the track; `record` is not called then.
  constant.leave_view(state);
  // Writes row i, but for unseen_s.
  constant.write_optional(seen, rows, i);
};

}  // namespace overtake
