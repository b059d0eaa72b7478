// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// Multi-target tracker (paper IV-C, eqs. 6 and 7): constant velocity and turn rate EKF with variable step, Mahalanobis
// gating, Munkres assignment, M/N life cycle; frames out of sequence by filtering again. One thread at a time. Nothing
// allocates after construction.
#pragma once

#include <cstdint>
#include <span>

#include "core/arena.h"
#include "core/sensor_model.h"
#include "core/track_map.h"
#include "core/track_table.h"
#include "pipeline/track/frame_tracker.h"
#include "pipeline/track/measurement.h"

namespace overtake {

// Beyond these a number is nothing of a car's.
inline constexpr double kMaxPlace_m = 1e8, kMaxAngle_rad = 1e6, kMaxSpeed_mps = 1e3, kMaxYawRate_rps = 100.0;

struct TrackerParams {
  double q_diag[5] = {0.005, 0.005, 0.5, 0.005, 0.0005};  // per q_step_s, scales with dt
  double q_step_s = 0.05;
  double r_diag[2] = {5.0, 5.0};  // m^2; a detection may carry its own
  double birth_sigma_v = 20.0, birth_sigma_phi = 0.2, birth_sigma_omega = 0.1;
  double birth_speed_share = 0.8;  // of the ego speed
  double gate_d2 = 9.21, gate_m = 8.0;
  int32_t window = 20, confirm_hits = 6, keep_hits = 5;  // N (1..64), M_c, M_e
  double max_silence_s = 4.0;                            // without a hit a track dies in any case; at most 60
  double predict_step_s = 0.05;                          // longer steps are cut into such
  double horizon_s = 3.0, horizon_step_s = 0.1;
  double heading_speed_mps = 3.0;   // in the map a confirmed track this fast turns its heading
  double history_s = 0.5;           // a frame this much older than the newest is taken in, at
  int32_t history_iterations = 32;  // most so many iterations back (1..256)
  int32_t track_capacity = 256, detection_capacity = 256;
  double work_limit = 1e7;  // steps of about 2 ns that a frame may take
};

// A sector that a sensor of this frame saw, in the tracker's frame of reference.
struct ObservedSector {
  double x_m, y_m, left_rad, right_rad;  // right < left, left - right <= 2 pi
  double range_min_m, range_max_m;
};

struct TrackerEgo {
  bool known = false;
  double x_m = 0, y_m = 0, heading_rad = 0, speed_mps = 0;
};

struct TrackerFrame {
  int64_t stamp_ns = 0;  // the iteration's time: the frame's last stamp
  // In the tracker's frame of reference, any number of rows; beyond detection_capacity the ones nearest to the ego are
  // read. A row whose place is not finite or over 1e8 m from the origin, or whose stamp is more than 1 s from the
  // frame's, is left out and counted as rejected. A heading or an extent that is no number of a car's counts as not
  // measured.
  std::span<const Measurement> measurements;
  TrackerEgo ego;
  bool in_map = true;                       // frame of reference is the map's: a course says where a car's front is
  bool ask_map = true;                      // births may ask the map, where in_map
  const ObservedSector* sectors = nullptr;  // what was seen; with sector_count < 0 everything was
  int32_t sector_count = -1;                // beyond kMaxSectors they are not read
};
inline constexpr int32_t kMaxSectors = 16;

// What came of everything so far. An iteration that ran again counts once, by how it went the last time; so all down
// to `rejected` are those of the same frames in sorted order. Every row ends in exactly one place:
// measurements = hits + births + unborn + rejected + late.
struct TrackerCounts {
  int64_t iterations = 0, births = 0, deaths = 0, hits = 0, misses = 0;
  // Deaths, each for one reason: deaths = missed + silent + displaced + unsound + forgotten.
  int64_t missed = 0;        // too few hits among the last iterations
  int64_t silent = 0;        // no hit for max_silence_s
  int64_t displaced = 0;     // put out for a nearer detection
  int64_t unsound = 0;       // the numbers were lost
  int64_t forgotten = 0;     // by restart()
  int64_t overflow = 0;      // unborn, and tracks put out for nearer ones
  int64_t unborn = 0;        // rows that found no slot, or beyond detection_capacity
  int64_t rejected = 0;      // rows that are no measurement
  int64_t measurements = 0;  // rows given to step
  int64_t late = 0;          // rows of frames too old to be taken in
  int64_t late_frames = 0;
  int64_t limited = 0;     // iterations that the work limit cut short
  int64_t refused = 0;     // late frames that were not too old, but too much work
  int64_t replays = 0;     // frames taken in out of sequence
  int64_t refiltered = 0;  // iterations that ran again for them
};

struct StepResult {
  bool late = false;       // too old, or too much work: nothing changed
  bool limited = false;    // the work limit was met: late for it, or an iteration that ran was cut short
  int32_t refiltered = 0;  // iterations that ran again; 0 for a frame in sequence
  int64_t work = 0;        // steps taken, by what work_limit counts
};

class Tracker final : public FrameTracker {
 public:
  struct State;  // pipeline/track/tracker_state.h

  // `map` may be null or empty; it must outlive the tracker. Throws std::bad_alloc when the allocator has no memory.
  Tracker(const TrackerParams& params, const TrackMap* map, const Allocator& allocator = default_allocator());
  ~Tracker() override;
  Tracker(const Tracker&) = delete;
  Tracker& operator=(const Tracker&) = delete;

  // One iteration: predict each track to its detection's own stamp, associate, update, count, give birth. A track
  // without detection is predicted to the frame's stamp. A detection up to 0.5 s older than its track's state (scans
  // overlap by a few ms) measures where the track was: the state goes back without process noise, takes it and returns;
  // a track's time never goes back.
  //
  // A frame older than the newest goes to its place in time (after those of equal stamp), and what came after it runs
  // again: states, covariances, life cycles and slots are, bit for bit, those of a tracker that was given the same
  // frames in sorted order. Ids stay with their cars: a track born in what ran again takes the id under which its
  // measurements were known. Older than history_s, than the history holds, or than the first frame since restart():
  // late, nothing changes. The same where the iterations that would run again took more than work_limit when they ran
  // before.
  //
  // An iteration itself keeps to work_limit: half of it may go into gating, where each track then looks at the nearest
  // detections only; what is left into the assignment, which then is not the cheapest. Work is counted in steps, never
  // timed, so the limit is met at the same place everywhere.
  //
  // track_of_measurement[measurements.size()], may be null: the id each detection went to (also a newborn's).
  StepResult step(const TrackerFrame& frame, TrackId* track_of_measurement) noexcept override;
  // Forgets every track; ids are never reused.
  void restart() noexcept override;

  // All tracks as they are, each at its own time, ordered by slot. Capacity at least track_capacity. `detection` and
  // `flags` are about the frame that was given last, also where it was an old one.
  void snapshot(TrackTable& states) const noexcept override;
  // A pure prediction: the same with each track moved on to stamp_ns, without those that silence or unsound numbers end
  // by then. The tracker itself stays as it is: what it becomes must not depend on the times somebody named.
  void predict(int64_t stamp_ns, TrackTable& states) const noexcept override;
  // Copies of all tracks predicted to publish_ns (the state itself stays), ordered by slot, and their paths from there.
  // Before a track's own time: exactly the way back, without noise. More than 60 s from it: 60 s, and stamp_ns says so.
  // The tables' capacities must be at least track_capacity and track_capacity * path_points(); paths may be null.
  void publish(int64_t publish_ns, TrackTable& tracks, PathTable* paths) const noexcept;
  // The same of a snapshot.
  void publish(const TrackTable& states, int64_t publish_ns, TrackTable& tracks,
               PathTable* paths) const noexcept override;

  int32_t path_points() const noexcept override;
  double path_step_s() const noexcept override;
  int32_t track_count() const noexcept;
  TrackerCounts counts() const noexcept override;

 private:
  Arena arena_;  // of the state
  State* state_ = nullptr;
};

// Points of a predicted path.
int32_t count_path_points(const TrackerParams& params) noexcept;
// The time nearest to publish_ns to which all tracks of an iteration at stamp_ns can be predicted: at most 59 s away.
int64_t limit_publish_ns(int64_t stamp_ns, int64_t publish_ns) noexcept;
// What Tracker::publish does, from a snapshot (which may be `tracks` itself), on any thread.
void publish_tracks(const TrackerParams& params, const TrackTable& states, int64_t publish_ns, TrackTable& tracks,
                    PathTable* paths) noexcept;

}  // namespace overtake
