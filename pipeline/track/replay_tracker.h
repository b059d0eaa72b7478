// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// Decides which iterations run: the new one, or, for a frame out of sequence, that one and all later ones. Every
// tracker is this class with a policy (track_policy.h); FrameTracker describes each call.
#pragma once

#include "core/check.h"
#include "core/table.h"
#include "pipeline/track/track_set.h"

namespace overtake {

template <TrackPolicy Policy>
class ReplayTracker final : public FrameTracker {
 public:
  using State = typename Policy::State;

  ReplayTracker(const TrackerParams& params, const CircuitMap* map, const Allocator& allocator = default_allocator())
      : params_(make_sane(params)), tracks_(params_, map, allocator) {
    arena_.build_or_throw(allocator, [this](Carver& carver) {
      tracks_.carve(carver);
      history_.carve(carver, params_, sizeof(State));
      ids_.carve(carver, params_);
    });
    tracks_.clear();
  }

  StepResult step(const TrackerFrame& frame, TrackId* track_of_measurement) noexcept override {
    const auto rows = int32_t(frame.measurements.size());
    int32_t counted = 0;
    for (const Measurement& z : frame.measurements) counted += !z.faint;
    counts_.measurements += counted;
    if (track_of_measurement) std::fill_n(track_of_measurement, rows, kNobody);
    shown_ = kNone;
    int32_t place = history_.find_place(frame.stamp_ns);
    const bool too_much = place >= 0 && double(history_.work_from(place)) > params_.work_limit;
    if (place < 0 || too_much) {
      counts_.late += counted;
      ++counts_.late_frames;
      counts_.refused += too_much;
      return {.limited = too_much};
    }
    const int32_t refiltered = history_.count() - place;
    counts_.replays += refiltered > 0;
    counts_.refiltered += refiltered;
    read_frame(params_, frame, history_.insert(place));
    run_from(place);
    shown_ = place;
    if (track_of_measurement)
      for_each_shown([&](const TrackHead& head) {
        if (head.row >= 0) track_of_measurement[head.row] = head.id;
      });
    return {.limited = history_.limited_from(place),
            .refiltered = refiltered,
            .work = history_.work_from(place),
            .ego_jumped = history_.at(place).ego_jumped};
  }

  void restart() noexcept override {
    tracks_.forget();
    history_.clear();
    shown_ = kNone;
  }

  void snapshot(TrackTable& rows, std::byte* states) const noexcept override {
    OVT_CHECK(rows.capacity >= params_.track_capacity);
    rows.count = 0;
    tracks_.for_each_live([&](int32_t slot) {
      TrackHead head = tracks_.head(slot);
      show_last_frame(slot, head);
      write(head, tracks_.policy().publishable(tracks_.state(slot), tracks_.in_map()), rows, states);
    });
  }

  void predict(int64_t stamp_ns, TrackTable& rows, std::byte* states) const noexcept override {
    OVT_CHECK(rows.capacity >= params_.track_capacity);
    rows.count = 0;
    tracks_.for_each_live([&](int32_t slot) {
      TrackHead head = tracks_.head(slot);
      if (tracks_.is_silent(head, stamp_ns)) return;
      State state = tracks_.state(slot);
      if (stamp_ns > head.state_ns) {
        tracks_.policy().predict(state, seconds_between(head.state_ns, stamp_ns));
        head.state_ns = stamp_ns;
      }
      if (!tracks_.policy().is_sound(state)) return;
      head.row = -1;
      head.flags = kTrackCoasting | kTrackUnobserved;
      write(head, tracks_.policy().publishable(state, tracks_.in_map()), rows, states);
    });
  }

  void publish(const TrackTable& rows, const std::byte* states, int64_t publish_ns, TrackTable& tracks,
               [[maybe_unused]] OptionalTrackTable* optional, PathTable* paths) const noexcept override {
    if (&rows != &tracks) copy_table(rows, tracks);
    if constexpr (WritesOptional<Policy>) {
      if (optional) {
        OVT_CHECK(optional->capacity >= tracks.count);
        optional->count = tracks.count;
      }
    }
    if (paths) {
      paths->count = 0;
      OVT_CHECK(paths->points_per_track >= 0 && paths->points_per_track <= path_points());
      OVT_CHECK(paths->capacity >= tracks.count * paths->points_per_track);
    }
    State group[kPathGroup];
    std::size_t grouped = 0;
    for (std::size_t i = 0; i < std::size_t(tracks.count); ++i) {
      State& state = group[grouped++];
      std::memcpy(&state, states + i * sizeof(State), sizeof(State));
      const int64_t state_ns = tracks.stamp_ns[i];
      tracks.stamp_ns[i] = limit_stamp(state_ns, publish_ns, kMaxPredict_s);
      tracks_.policy().predict(state, seconds_between(state_ns, tracks.stamp_ns[i]));
      // The state is a published one; what depends on its time is decided anew. Any thread may be here, so the frame of
      // reference of the newest iteration is not asked: these policies have no use for it.
      if constexpr (WritesOptional<Policy>) state = tracks_.policy().publishable(state, true);
      tracks_.policy().write(state, tracks, i);
      tracks.flags[i] = (tracks.flags[i] & ~kTrackStale) | stale_flag(tracks.measured_ns[i], publish_ns);
      if constexpr (WritesOptional<Policy>) {
        if (optional) {
          tracks_.policy().write_optional(state, *optional, i);
          optional->unseen_s[i] = std::max(0.0, seconds_between(tracks.measured_ns[i], tracks.stamp_ns[i]));
        }
      }
      if (grouped == kPathGroup || i + 1 == std::size_t(tracks.count)) {
        if (paths && paths->points_per_track > 0)
          tracks_.policy().write_paths(std::span<const State>(group, grouped), *paths);
        grouped = 0;
      }
    }
  }

  bool writes_optional() const noexcept override { return WritesOptional<Policy>; }
  std::size_t state_bytes() const noexcept override { return sizeof(State); }
  int32_t path_points() const noexcept override { return overtake::path_points(params_, params_.horizon_s); }
  double path_step_s() const noexcept override { return params_.horizon_step_s; }
  TrackerCounts counts() const noexcept override { return {tracks_.counts(), counts_}; }

 private:
  static constexpr std::size_t kPathGroup = 8;  // tracks whose paths are written at once
  static constexpr int32_t kNone = -1;          // no frame to show: it was late, or there was none

  // Restores the tracks before the new iteration at `place`, then runs it and all later ones.
  void run_from(int32_t place) noexcept {
    Iteration& first = history_.at(place);
    const bool is_newest = place == history_.count() - 1;
    if (is_newest) {
      tracks_.save(first.before);
    } else {
      std::swap(first.before, history_.at(place + 1).before);
      tracks_.restore(first.before);
    }
    std::fill_n(first.track, first.count, kNobody);
    ids_.begin();
    for (int32_t i = place; i < history_.count(); ++i) {
      Iteration& it = history_.at(i);
      if (i > place) tracks_.save(it.before);
      std::swap(it.track, it.track_before);
      tracks_.run(it, i, ids_);
    }
    ids_.settle(history_, place, tracks_.heads());
  }

  // Calls f for each track after the iteration of the last step's frame.
  template <class F>
  void for_each_shown(F&& f) const {
    if (shown_ == history_.count() - 1) {
      tracks_.for_each_live([&](int32_t slot) { f(tracks_.head(slot)); });
    } else {
      const SavedTracks& after = history_.at(shown_ + 1).before;
      std::for_each_n(after.head, after.count, f);
    }
  }

  // Sets a live track's row and flags to those of the last step's frame.
  void show_last_frame(int32_t slot, TrackHead& head) const noexcept {
    if (shown_ == history_.count() - 1) return;
    const TrackHead* then = nullptr;
    if (shown_ != kNone) {
      const SavedTracks& after = history_.at(shown_ + 1).before;
      const int32_t* found = std::lower_bound(after.slot, after.slot + after.count, slot);
      if (found != after.slot + after.count && *found == slot) then = &after.head[found - after.slot];
    }
    const bool is_same = then && then->id == head.id;
    head.row = is_same ? then->row : -1;
    head.flags = is_same ? then->flags : kTrackCoasting;
  }

  static uint32_t stale_flag(int64_t measured_ns, int64_t stamp_ns) noexcept {
    return seconds_between(measured_ns, stamp_ns) > kTrackStale_s ? kTrackStale : 0;
  }

  void write(const TrackHead& head, const State& state, TrackTable& rows, std::byte* states) const noexcept {
    const auto i = std::size_t(rows.count++);
    rows.id[i] = head.id;
    rows.stamp_ns[i] = head.state_ns;
    rows.measured_ns[i] = head.measured_ns;
    rows.detection[i] = head.row;
    rows.flags[i] = head.flags | stale_flag(head.measured_ns, head.state_ns);
    tracks_.policy().write(state, rows, i);
    std::memcpy(states + i * sizeof(State), &state, sizeof(State));
  }

  const TrackerParams params_;
  Arena arena_;
  TrackSet<Policy> tracks_;
  TrackHistory history_;
  TrackIds ids_;
  FrameCounts counts_;
  int32_t shown_ = kNone;  // place of the last step's frame, whose rows and flags a snapshot shows
};

}  // namespace overtake
