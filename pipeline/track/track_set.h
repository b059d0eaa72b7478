// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// The tracks of a tracker, and one iteration on them, in this order: silence, association, hits, misses, deaths,
// births. The result depends on the tracks before and the iteration's input alone, so an iteration that runs again
// gives the same bytes.
#pragma once

#include <algorithm>
#include <cstring>
#include <tuple>

#include "pipeline/track/track_ids.h"
#include "pipeline/track/track_policy.h"

namespace overtake {

template <TrackPolicy Policy>
class TrackSet {
 public:
  using State = typename Policy::State;

  TrackSet(const TrackerParams& params, const CircuitMap* map, const Allocator& allocator)
      : params_(params), policy_(params, map, allocator) {}

  void carve(Carver& carver) {
    const auto slots = std::size_t(params_.track_capacity);
    head_ = carver.take<TrackHead>(slots);
    state_ = carver.take<State>(slots);
    measurement_of_slot_ = carver.take<int32_t>(slots);
    newborn_ = carver.take<int32_t>(std::size_t(params_.detection_capacity));
  }
  void clear() { std::fill_n(head_, params_.track_capacity, TrackHead{}); }

  // Runs the iteration at `place` of the history.
  void run(Iteration& it, int32_t place, TrackIds& ids) noexcept {
    in_map_ = it.in_map;
    if constexpr (JoinsTracks<Policy>) {
      jumps_.follow(it.stamp_ns, it.ego);
      it.since_ego_jump_s = jumps_.since_jump_s(it.stamp_ns);
      it.since_far_ego_jump_s = jumps_.since_far_jump_s(it.stamp_ns);
      it.ego_jumped = jumps_.jumped || jumps_.jumped_far;
      for (int32_t slot = 0; jumps_.jumped && slot < params_.track_capacity; ++slot)
        if (head_[slot].alive) policy_.move_with_ego(state_[slot], jumps_.jump_x_m, jumps_.jump_y_m);
    }
    counts_.rejected += it.rejected;
    counts_.unborn += it.unread;
    std::fill_n(it.slot, it.count, -1);
    std::fill_n(it.track, it.count, kNobody);
    std::fill_n(it.birth, it.count, kHasId);
    for (int32_t slot = 0; slot < params_.track_capacity; ++slot)
      if (head_[slot].alive && is_silent(head_[slot], it.stamp_ns)) end(slot, counts_.silent);
    const Effort effort =
        policy_.associate({params_.track_capacity, alive_count_, head_, state_}, it, measurement_of_slot_);
    it.work = effort.work;
    it.limited = effort.limited;
    counts_.limited += effort.limited;
    for (int32_t slot = 0; slot < params_.track_capacity; ++slot)
      if (head_[slot].alive) update_track(slot, it);
    if constexpr (JoinsTracks<Policy>) join_tracks(it);
    give_births(it, place, ids);
  }

  void save(SavedTracks& saved) const noexcept {
    saved.jumps = jumps_;
    saved.count = 0;
    saved.counts = counts_;
    for (int32_t first = 0, end; first < params_.track_capacity; first = end + 1) {
      for (end = first; end < params_.track_capacity && head_[end].alive; ++end)
        saved.slot[saved.count + end - first] = end;
      const auto i = std::size_t(saved.count), run = std::size_t(end - first);
      std::copy_n(head_ + first, run, saved.head + i);
      std::memcpy(saved.state + i * sizeof(State), state_ + first, run * sizeof(State));
      saved.count += end - first;
    }
  }
  void restore(const SavedTracks& saved) noexcept {
    for (int32_t slot = 0; slot < params_.track_capacity; ++slot) head_[slot].alive = false;
    for (std::size_t i = 0; i < std::size_t(saved.count); ++i) {
      head_[saved.slot[i]] = saved.head[i];
      std::memcpy(&state_[saved.slot[i]], saved.state + i * sizeof(State), sizeof(State));
    }
    alive_count_ = saved.count;
    jumps_ = saved.jumps;
    counts_ = saved.counts;
  }
  void forget() noexcept {
    jumps_ = {};
    for_each_live([this](int32_t slot) { end(slot, counts_.forgotten); });
  }

  template <class F>
  void for_each_live(F&& f) const {
    for (int32_t slot = 0; slot < params_.track_capacity; ++slot)
      if (head_[slot].alive) f(slot);
  }
  bool is_silent(const TrackHead& head, int64_t now_ns) const noexcept {
    return seconds_between(head.measured_ns, now_ns) > params_.max_silence_s;
  }
  TrackHead* heads() noexcept { return head_; }
  const TrackHead& head(int32_t slot) const noexcept { return head_[slot]; }
  const State& state(int32_t slot) const noexcept { return state_[slot]; }
  const Policy& policy() const noexcept { return policy_; }
  const IterationCounts& counts() const noexcept { return counts_; }
  bool in_map() const noexcept { return in_map_; }  // in the newest iteration

 private:
  void end(int32_t slot, int64_t& reason) noexcept {  // reason: one of counts_
    head_[slot].alive = false;
    ++reason;
    ++counts_.deaths;
    --alive_count_;
  }

  void update_track(int32_t slot, Iteration& it) noexcept {
    TrackHead& head = head_[slot];
    State& state = state_[slot];
    bool lives = true;
    if (const int32_t hit = measurement_of_slot_[slot]; hit >= 0) {
      const Measurement& z = it.measurement[hit];
      policy_.update(slot, state, seconds_between(head.state_ns, z.stamp_ns), z);
      head.state_ns = std::max(head.state_ns, z.stamp_ns);
      head.measured_ns = std::max(head.measured_ns, z.stamp_ns);
      head.row = z.faint ? -1 : it.row[hit];
      head.flags = z.faint ? kTrackCoasting : 0;
      it.slot[hit] = slot;
      it.track[hit] = head.id;
      it.birth[hit] = head.birth;
      counts_.hits += !z.faint;
      lives = policy_.record(slot, state, !(z.debris || z.faint) || policy_.is_confirmed(state));
    } else {
      if (it.stamp_ns > head.state_ns) {  // a track's time never goes back
        policy_.predict(state, seconds_between(head.state_ns, it.stamp_ns));
        head.state_ns = it.stamp_ns;
      }
      head.row = -1;
      head.flags = kTrackCoasting | kTrackUnobserved;
      if (may_miss(it, state)) {
        head.flags = kTrackCoasting;  // an iteration that could not see the track does not count
        ++counts_.misses;
        lives = policy_.record(slot, state, false);
      } else if constexpr (WritesOptional<Policy>) {
        policy_.leave_view(state);
      }
    }
    if (!lives)
      end(slot, counts_.missed);
    else if (!policy_.is_sound(state))
      end(slot, counts_.unsound);
  }

  bool may_miss(const Iteration& it, const State& state) const noexcept {
    const Place place = policy_.place(state);
    if (!is_observed(it, place.x_m, place.y_m)) return false;
    if constexpr (WritesOptional<Policy>) return policy_.may_miss(state);
    return true;
  }

  TrackView<State> view() const noexcept { return {params_.track_capacity, alive_count_, head_, state_}; }

  // Of two tracks of one car the elder keeps its slot and its id. Its state has the later time of both.
  void join_tracks(Iteration& it) noexcept {
    policy_.look_round(view(), it);
    for (int32_t slot = 0; slot < params_.track_capacity; ++slot) {
      if (!head_[slot].alive) continue;
      const int32_t elder = policy_.find_elder(view(), slot);
      if (elder < 0) continue;
      TrackHead &kept = head_[elder], &left = head_[slot];
      const bool is_newer = left.measured_ns > kept.measured_ns;
      const bool takes_over = policy_.join(state_[elder], state_[slot], is_newer);
      const int64_t state_ns = takes_over ? left.state_ns : kept.state_ns;
      kept.state_ns = std::max(kept.state_ns, left.state_ns);
      policy_.predict(state_[elder], seconds_between(state_ns, kept.state_ns));
      if (is_newer) {
        kept.measured_ns = left.measured_ns;
        kept.row = left.row;
        kept.flags = left.flags;
      }
      for (int32_t i = 0; i < it.count; ++i) {
        if (it.slot[i] != slot) continue;
        it.slot[i] = elder;
        it.track[i] = kept.id;
        it.birth[i] = kept.birth;
      }
      end(slot, counts_.joined);
      policy_.look_round(view(), it);
    }
  }

  // Nearest first: so no new track is evicted for another new one, and row order does not matter.
  void give_births(Iteration& it, int32_t place, TrackIds& ids) noexcept {
    int32_t count = 0;
    for (int32_t i = 0; i < it.count; ++i) {
      if (it.slot[i] >= 0) continue;
      if constexpr (JoinsTracks<Policy>) {
        if (const int32_t owner = policy_.find_owner(view(), it, i); owner >= 0) {
          it.slot[i] = owner;
          it.track[i] = head_[owner].id;
          it.birth[i] = head_[owner].birth;
          counts_.hits += !it.measurement[i].faint;
          continue;
        }
      }
      if (it.measurement[i].faint) continue;
      if (it.measurement[i].debris)
        ++counts_.debris;
      else
        newborn_[count++] = i;
    }
    std::sort(newborn_, newborn_ + count, [&it](int32_t a, int32_t b) {
      const double da = it.ego_distance_m2[a], db = it.ego_distance_m2[b];
      return std::tie(da, a) < std::tie(db, b);
    });
    for (int32_t k = 0; k < count; ++k) {
      const int32_t i = newborn_[k], slot = find_slot(it, i);
      if (slot < 0) continue;
      const Measurement& z = it.measurement[i];
      head_[slot] = {.alive = true,
                     .birth = ids.add_birth(place, slot),
                     .state_ns = z.stamp_ns,
                     .measured_ns = z.stamp_ns,
                     .row = it.row[i]};
      state_[slot] = policy_.initiate(z, it);
      it.slot[i] = slot;
      it.birth[i] = head_[slot].birth;
      ++counts_.births;
      ++alive_count_;
    }
  }

  // Returns the first free slot. A full table evicts its farthest tentative track if it is farther than the
  // measurement. -1: none.
  int32_t find_slot(const Iteration& it, int32_t measurement) noexcept {
    for (int32_t slot = 0; slot < params_.track_capacity; ++slot)
      if (!head_[slot].alive) return slot;
    const auto distance_of_m2 = [&](int32_t slot) {
      return distance_m2(policy_.place(state_[slot]), {it.ego.x_m, it.ego.y_m});
    };
    int32_t farthest = -1;
    for (int32_t slot = 0; slot < params_.track_capacity; ++slot) {
      if (policy_.is_confirmed(state_[slot])) continue;
      if (farthest < 0 || distance_of_m2(slot) > distance_of_m2(farthest)) farthest = slot;
    }
    if (farthest < 0 || !(distance_of_m2(farthest) > it.ego_distance_m2[measurement])) {
      ++counts_.unborn;
      return -1;
    }
    end(farthest, counts_.displaced);
    return farthest;
  }

  const TrackerParams params_;
  Policy policy_;
  TrackHead* head_ = nullptr;  // by slot
  State* state_ = nullptr;
  int32_t* measurement_of_slot_ = nullptr;
  int32_t* newborn_ = nullptr;  // measurements that initiate tracks, nearest first
  EgoJumps jumps_;
  IterationCounts counts_;
  int32_t alive_count_ = 0;
  bool in_map_ = true;
};

}  // namespace overtake
