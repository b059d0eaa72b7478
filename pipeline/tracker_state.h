// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// The tracker's working memory: private to pipeline/tracker*.cpp and pipeline/associate.cpp.
#pragma once

#include <cstdint>
#include <vector>

#include "core/math.h"
#include "pipeline/life_cycle.h"
#include "pipeline/munkres.h"
#include "pipeline/track_filter.h"
#include "pipeline/tracker.h"

namespace overtake {

inline constexpr double kMaxPlace_m = 1e8;           // farther from the origin is no place
inline constexpr double kMaxStampSpread_s = 1.0;     // a detection's stamp lies this near to its frame's
inline constexpr double kMaxBackward_s = 0.5;        // a track goes back so far to take an older detection
inline constexpr double kMaxPredict_s = 60.0;

// Exact for any two stamps; never overflows.
inline double seconds_between(int64_t from_ns, int64_t to_ns) {
  return to_ns >= from_ns ? double(uint64_t(to_ns) - uint64_t(from_ns)) / 1e9
                          : -(double(uint64_t(from_ns) - uint64_t(to_ns)) / 1e9);
}

// A detection that is a measurement.
struct Candidate {
  int64_t stamp_ns;
  PositionMeasurement z;
  double heading_rad, length_m, width_m;             // NaN: none
  double ego_distance_m2;
  int32_t row;                                       // in TrackerDetections
  int32_t slot;                                      // of the track that took it, -1 none
};

// One slot. What is estimated holds at state_ns.
struct Track {
  bool alive = false;
  uint32_t generation = 0;                           // grows with each birth, survives restart()
  LifeCycle life;
  int64_t state_ns = 0, measured_ns = 0;
  TrackEstimate estimate;
  bool has_heading = false;
  double heading_rad = 0;                            // of the last detection that had one, turned on by omega
  double length_m = 0, width_m = 0;                  // 0: never measured
  int32_t detection = -1;                            // row of the last step's detection
};

// Moves an estimate together with the heading that turns with it.
inline void predict_track(Track& track, const ProcessNoise& noise, double dt_s) {
  track.heading_rad = wrap_angle(track.heading_rad + track.estimate.mean.yaw_rate_rps * dt_s);
  predict(track.estimate, noise, dt_s);
}

struct Tracker::State {
  State(const TrackerParams& p, const TrackMap* m);

  TrackerParams params;
  const TrackMap* map;
  LifeCycleParams life_cycle;
  ProcessNoise noise, no_noise;
  TrackerCounts counts;
  int32_t alive_count = 0;
  bool in_map = true;                                // of the last step

  std::vector<Track> tracks;                         // by slot
  std::vector<Candidate> candidates;                 // by (stamp, x, y, row)
  std::vector<int32_t> newborn;                      // candidates that give birth, nearest first
  std::vector<int32_t> candidate_of_slot;
  Munkres munkres;

  void bury(Track& track);
  bool bury_silent(Track& track, int64_t now_ns);    // true: it died
};

// Parameters of any value give a tracker that works; the configuration refuses senseless ones by name.
TrackerParams make_sane(TrackerParams params) noexcept;
ProcessNoise make_process_noise(const TrackerParams& params) noexcept;
// Fills state.candidates from the frame.
void select_candidates(Tracker::State& state, const TrackerFrame& frame) noexcept;
// Gates every pair and assigns: state.candidate_of_slot and Candidate::slot.
void associate(Tracker::State& state) noexcept;

}  // namespace overtake
