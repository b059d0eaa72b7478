// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// The tracker's working memory: private to pipeline/track*.cpp, pipeline/track/associate.cpp and
// pipeline/track/publish_tracks.cpp.
#pragma once

#include <cstdint>

#include "pipeline/track/munkres.h"
#include "pipeline/track/track_history.h"

namespace overtake {

inline constexpr double kMaxStampSpread_s = 1.0;  // a measurement's stamp lies this near to its frame's
inline constexpr double kMaxBackward_s = 0.5;     // a track goes back so far to take an older measurement
inline constexpr double kMaxPredict_s = 60.0;

// A track at the stamp of a measurement it was gated with.
struct Prediction {
  bool there = false;
  int64_t stamp_ns = 0;
  TrackEstimate estimate;
  bool is_at(int64_t ns) const noexcept { return there && stamp_ns == ns; }
};

// Moves an estimate together with the heading that turns with it.
inline void turn_heading(Track& track, double dt_s) {
  track.heading_rad = wrap_angle(track.heading_rad + track.estimate.mean.yaw_rate_rps * dt_s);
}
inline void predict_track(Track& track, const ProcessNoise& noise, double dt_s) {
  turn_heading(track, dt_s);
  predict(track.estimate, noise, dt_s);
}
// The same to a stamp; a track's time never goes back.
inline void predict_track_to(Track& track, const ProcessNoise& noise, int64_t stamp_ns) {
  if (stamp_ns <= track.state_ns) return;
  predict_track(track, noise, seconds_between(track.state_ns, stamp_ns));
  track.state_ns = stamp_ns;
}

struct Tracker::State {
  State(const TrackerParams& p, const TrackMap* m, const Allocator& allocator);

  Arena arena;  // of everything below but the assignment's
  TrackerParams params;
  const TrackMap* map;
  LifeCycleParams life_cycle;
  ProcessNoise noise, no_noise;
  TrackerCounts counts;
  int32_t alive_count = 0;
  bool in_map = true;  // of the newest iteration

  Track* tracks = nullptr;         // by slot
  uint32_t* generation = nullptr;  // by slot: grows with each id drawn, never goes back
  int32_t* measurement_of_slot = nullptr;
  Prediction* predictions = nullptr;                        // by slot: of the iteration that runs, where it was gated
  double *measured_x_m = nullptr, *measured_y_m = nullptr;  // of the iteration that runs
  int32_t* within_reach = nullptr;                          // measurements near the track that is asked
  uint64_t* nearest = nullptr;                              // of these, when they are too many
  int32_t* newborn = nullptr;                               // measurements that give birth, nearest first
  int32_t* shown_detection = nullptr;  // by slot: of the frame given last, where TrackTable::detection
  uint32_t* shown_flags = nullptr;     // and flags come from
  Munkres munkres;
  TrackHistory history;
  bool runs_again = false;  // an iteration that ran before: ids are found out afterwards
  ReplayIds replay;

  bool is_silent(const Track& track, int64_t now_ns) const;
  void bury(Track& track, int64_t& reason);  // one of the counts
  TrackId draw_id(int32_t slot);
  // What is put back when iterations run again: live tracks, and the counts of what came of them.
  void save(SavedTracks& saved) const;
  void restore(const SavedTracks& saved);
};

// Parameters of any value give a tracker that works; the configuration refuses senseless ones by name.
TrackerParams make_sane(TrackerParams params) noexcept;
ProcessNoise make_process_noise(const TrackerParams& params) noexcept;
// Fills the iteration's measurements from the frame.
void select_measurements(const TrackerParams& params, const TrackerFrame& frame, Iteration& iteration) noexcept;
// Gates every pair and assigns: state.measurement_of_slot, Iteration::slot, work and limited.
void associate(Tracker::State& state, Iteration& iteration) noexcept;
// A number in place of an id, for a track born while iterations run again.
TrackId number_birth(ReplayIds& replay, int32_t slot) noexcept;
// After the iterations from `first` on ran again: gives the tracks born in them their ids, everywhere.
void settle_ids(Tracker::State& state, int32_t first) noexcept;

}  // namespace overtake
