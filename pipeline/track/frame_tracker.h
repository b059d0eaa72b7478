// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// The interface of every method's tracker. Every tracker is a ReplayTracker (replay_tracker.h) with a policy
// (track_policy.h).
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>

#include "core/arena.h"
#include "core/circuit_map.h"
#include "core/sensor_model.h"
#include "core/track_table.h"
#include "pipeline/track/measurement.h"
#include "pipeline/track/tracker_params.h"
#include "pipeline/view_gaps.h"

namespace overtake {

// right < left, left - right <= 2 pi
struct Sector {
  double left_rad, right_rad;
};

// What a sensor of this frame saw, in the tracker's frame of reference.
struct ObservedSector {
  double x_m, y_m;
  Sector view;
  double range_min_m, range_max_m;
  int32_t gap_count = 0;  // of the view
  Sector gap[kMaxViewGaps] = {};
};

struct TrackerEgo {
  bool known = false;
  double x_m = 0, y_m = 0, heading_rad = 0, speed_mps = 0, yaw_rate_rps = 0;
};

struct TrackerFrame {
  int64_t stamp_ns = 0;  // the iteration's time: the frame's last stamp
  // Any number of rows; the tracker reads at most detection_capacity, those nearest to the ego. It rejects a row whose
  // position is not finite or over 1e8 m from the origin, or whose stamp is more than 1 s from the frame's. A heading
  // or an extent that no car can have counts as not measured.
  std::span<const Measurement> measurements;
  TrackerEgo ego;
  bool in_map = true;                       // the frame of reference is the map: there the course tells a car's front
  bool ask_map = true;                      // with in_map: an initiation may use the map
  const ObservedSector* sectors = nullptr;  // seen by the sensors; sector_count < 0: everything was seen
  int32_t sector_count = -1;                // the tracker reads at most kMaxSensors
  bool of_rows = false;                     // of pushed rows: nothing tells where their source looks
};

// Results of the iterations. An iteration that ran again counts once, with its last result. So the counts are those of
// the same frames in sorted order.
struct IterationCounts {
  int64_t births = 0, deaths = 0, hits = 0, misses = 0;
  // Deaths, each for one reason: deaths = missed + silent + displaced + unsound + forgotten + joined.
  int64_t missed = 0;     // too few hits among the last iterations
  int64_t silent = 0;     // no hit for max_silence_s
  int64_t displaced = 0;  // evicted for a nearer measurement
  int64_t unsound = 0;    // a state that is not finite, or that no car can have
  int64_t forgotten = 0;  // by restart()
  int64_t joined = 0;     // two tracks of one car became one
  int64_t unborn = 0;     // rows not initiated: no free slot, or beyond detection_capacity
  int64_t rejected = 0;   // rows that are not a valid measurement
  int64_t debris = 0;     // rows of debris that no track took
  int64_t limited = 0;    // iterations that the work limit shortened

  int64_t overflow() const { return unborn + displaced; }  // rows and tracks without a slot
};

// Results of the frames, in the order of arrival.
struct FrameCounts {
  int64_t measurements = 0;  // rows given to step
  int64_t late = 0;          // rows of late frames: too old, or too much work
  int64_t late_frames = 0;
  int64_t refused = 0;     // late frames that were not too old, but cost too much work
  int64_t replays = 0;     // frames inserted out of sequence
  int64_t refiltered = 0;  // iterations that ran again for them
};

// Every row ends in exactly one place: measurements = hits + births + unborn + rejected + debris + late.
struct TrackerCounts : IterationCounts, FrameCounts {};

struct StepResult {
  bool limited = false;     // the work limit made the frame late, or shortened an iteration
  int32_t refiltered = 0;   // iterations that ran again; 0 for a frame in sequence
  int64_t work = 0;         // in the steps that work_limit counts
  bool ego_jumped = false;  // since the iteration before
};

// Only one thread may call at a time. Exceptions are publish, writes_optional, path_points, path_step_s and
// state_bytes, which any thread may call at any time. Only the constructor allocates.
class FrameTracker {
 public:
  virtual ~FrameTracker() = default;

  // Runs one iteration: predicts each track to its measurement's stamp, associates, updates, counts hits and misses,
  // initiates. It predicts a track without a measurement to the frame's stamp. A track's time never goes back: a
  // measurement may be up to 0.5 s older than its track's state (scans overlap by a few ms), and then corrects the
  // state at the measurement's stamp.
  //
  // The tracker inserts a frame older than the newest at its stamp (after frames of equal stamp), and runs all later
  // iterations again. States, life cycles and slots are then, bit for bit, those of a tracker that got the same frames
  // in sorted order. Ids stay with their cars: a track that a repeated iteration initiates inherits the id that its
  // measurements had before. A frame is late, and changes nothing, if it is older than history_s, than the whole
  // history, or than the first frame since restart(). It is also late if the iterations after it took more than
  // work_limit when they last ran.
  //
  // Each iteration keeps to work_limit: beyond it, the association examines fewer pairs and sets `limited`. Work is
  // counted in steps, never timed, so every machine reaches the limit at the same step.
  //
  // track_of_measurement[measurements.size()], may be null: id of the track that each measurement updated or initiated.
  virtual StepResult step(const TrackerFrame& frame, TrackId* track_of_measurement) noexcept = 0;
  // Deletes every track; ids are never reused.
  virtual void restart() noexcept = 0;

  // Copies all tracks, each at its own time, ordered by slot. `rows` has room for track_capacity rows, `states` for
  // track_capacity * state_bytes(). `detection` and `flags` refer to the frame of the last step, also if that frame was
  // out of sequence.
  virtual void snapshot(TrackTable& rows, std::byte* states) const noexcept = 0;
  // Like snapshot, but with each track predicted to stamp_ns, and without tracks that are silent for too long or
  // unsound by then. The tracker does not change: its results must not depend on the stamps of such calls.
  virtual void predict(int64_t stamp_ns, TrackTable& rows, std::byte* states) const noexcept = 0;
  virtual TrackerCounts counts() const noexcept = 0;

  // Predicts the tracks of a snapshot to publish_ns, and their paths from there; `rows` and `tracks` may be the same
  // table. Depends on the arguments and the parameters alone. If publish_ns is before a track's own time, predicts back
  // without noise. If it is more than 60 s away, predicts 60 s; stamp_ns is the stamp reached. `optional` has room for
  // the rows; a tracker without writes_optional() does not write it. `paths` has room for the caller's
  // points_per_track, at most path_points(), of each track. Both may be null.
  virtual void publish(const TrackTable& rows, const std::byte* states, int64_t publish_ns, TrackTable& tracks,
                       OptionalTrackTable* optional, PathTable* paths) const noexcept = 0;
  virtual bool writes_optional() const noexcept = 0;
  virtual std::size_t state_bytes() const noexcept = 0;  // of one track in a snapshot
  virtual int32_t path_points() const noexcept = 0;      // of each track
  virtual double path_step_s() const noexcept = 0;       // between two of them
};

// The tracker of a method. `map` may be null or empty; it must outlive the tracker. Throws std::bad_alloc when the
// allocator has no memory.
using MakeTracker = std::unique_ptr<FrameTracker>(const TrackerParams& params, const CircuitMap* map,
                                                  const Allocator& allocator);

// publish_ns, limited to at most most_s from stamp_ns.
int64_t limit_stamp(int64_t stamp_ns, int64_t publish_ns, double most_s) noexcept;
// The time nearest to publish_ns to which all tracks of an iteration at stamp_ns can be predicted: at most 59 s away.
int64_t limit_publish_ns(int64_t stamp_ns, int64_t publish_ns) noexcept;

}  // namespace overtake
