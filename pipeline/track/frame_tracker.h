// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// What a frame asks of a tracker, whichever method it belongs to. Every tracker is a ReplayTracker (replay_tracker.h)
// of a policy, which keeps these promises.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>

#include "core/arena.h"
#include "core/circuit_map.h"
#include "core/track_table.h"
#include "pipeline/track/measurement.h"
#include "pipeline/track/tracker_params.h"

namespace overtake {

// A sector that a sensor of this frame saw, in the tracker's frame of reference.
struct ObservedSector {
  double x_m, y_m, left_rad, right_rad;  // right < left, left - right <= 2 pi
  double range_min_m, range_max_m;
};
inline constexpr int32_t kMaxSectors = 16;

struct TrackerEgo {
  bool known = false;
  double x_m = 0, y_m = 0, heading_rad = 0, speed_mps = 0;
};

struct TrackerFrame {
  int64_t stamp_ns = 0;  // the iteration's time: the frame's last stamp
  // Any number of rows; beyond detection_capacity the ones nearest to the ego are read. A row whose place is not finite
  // or over 1e8 m from the origin, or whose stamp is more than 1 s from the frame's, is left out and counted as
  // rejected. A heading or an extent that is no number of a car's is taken as not measured.
  std::span<const Measurement> measurements;
  TrackerEgo ego;
  bool in_map = true;                       // frame of reference is the map's: a course says where a car's front is
  bool ask_map = true;                      // births may ask the map, where in_map
  const ObservedSector* sectors = nullptr;  // what was seen; with sector_count < 0 everything was
  int32_t sector_count = -1;                // beyond kMaxSectors they are not read
};

// What came of the iterations. One that ran again counts once, by how it went the last time; so these are those of the
// same frames in sorted order.
struct IterationCounts {
  int64_t iterations = 0, births = 0, deaths = 0, hits = 0, misses = 0;
  // Deaths, each for one reason: deaths = missed + silent + displaced + unsound + forgotten.
  int64_t missed = 0;     // too few hits among the last iterations
  int64_t silent = 0;     // no hit for max_silence_s
  int64_t displaced = 0;  // put out for a nearer measurement
  int64_t unsound = 0;    // the numbers were lost
  int64_t forgotten = 0;  // by restart()
  int64_t overflow = 0;   // unborn, and tracks put out for nearer ones
  int64_t unborn = 0;     // rows that found no slot, or beyond detection_capacity
  int64_t rejected = 0;   // rows that are no measurement
  int64_t limited = 0;    // iterations that the work limit cut short
};

// What came of the frames, in the order of arrival.
struct FrameCounts {
  int64_t measurements = 0;  // rows given to step
  int64_t late = 0;          // rows of frames too old to be taken in
  int64_t late_frames = 0;
  int64_t refused = 0;     // late frames that were not too old, but too much work
  int64_t replays = 0;     // frames taken in out of sequence
  int64_t refiltered = 0;  // iterations that ran again for them
};

// Every row ends in exactly one place: measurements = hits + births + unborn + rejected + late.
struct TrackerCounts : IterationCounts, FrameCounts {};

struct StepResult {
  bool late = false;       // too old, or too much work: nothing changed
  bool limited = false;    // the work limit was met: late for it, or an iteration that ran was cut short
  int32_t refiltered = 0;  // iterations that ran again; 0 for a frame in sequence
  int64_t work = 0;        // steps taken, by what work_limit counts
};

// One thread at a time, but for publish, path_points, path_step_s and state_bytes, which any thread may call at any
// time. Nothing allocates after construction.
class FrameTracker {
 public:
  virtual ~FrameTracker() = default;

  // One iteration: predict each track to its measurement's own stamp, associate, update, count, give birth. A track
  // without measurement is predicted to the frame's stamp. A track's time never goes back: a measurement up to 0.5 s
  // older than its track's state (scans overlap by a few ms) measures where the track was.
  //
  // A frame older than the newest goes to its place in time (after those of equal stamp), and what came after it runs
  // again: states, life cycles and slots are, bit for bit, those of a tracker that was given the same frames in sorted
  // order. Ids stay with their cars: a track born in what ran again takes the id under which its measurements were
  // known. Older than history_s, than the history holds, or than the first frame since restart(): late, nothing
  // changes. The same where the iterations that would run again took more than work_limit when they ran before.
  //
  // An iteration itself keeps to work_limit: beyond it an association looks at less and says so (limited). Work is
  // counted in steps, never timed, so the limit is met at the same place everywhere.
  //
  // track_of_measurement[measurements.size()], may be null: the id each one went to (also a newborn's).
  virtual StepResult step(const TrackerFrame& frame, TrackId* track_of_measurement) noexcept = 0;
  // Forgets every track; ids are never reused.
  virtual void restart() noexcept = 0;

  // All tracks as they are, each at its own time, ordered by slot; `rows` has room for track_capacity, `states` for as
  // many times state_bytes(). `detection` and `flags` are about the frame that was given last, also where it was an old
  // one.
  virtual void snapshot(TrackTable& rows, std::byte* states) const noexcept = 0;
  // A pure prediction: the same with each track moved on to stamp_ns, without those that silence or unsound numbers end
  // by then. The tracker itself stays as it is: what it becomes must not depend on the times somebody named.
  virtual void predict(int64_t stamp_ns, TrackTable& rows, std::byte* states) const noexcept = 0;
  virtual TrackerCounts counts() const noexcept = 0;

  // The tracks of a snapshot (whose rows may be `tracks` itself) predicted to publish_ns, and their paths from there.
  // Depends on the arguments and on parameters alone. Before a track's own time: the way back, without noise. More than
  // 60 s from it: 60 s, and stamp_ns says so. `paths` has room for path_points() of each track; it may be null.
  virtual void publish(const TrackTable& rows, const std::byte* states, int64_t publish_ns, TrackTable& tracks,
                       PathTable* paths) const noexcept = 0;
  virtual std::size_t state_bytes() const noexcept = 0;  // of one track in a snapshot
  virtual int32_t path_points() const noexcept = 0;      // of each track
  virtual double path_step_s() const noexcept = 0;       // between two of them
};

// The tracker of a method. `map` may be null or empty; it must outlive the tracker. Throws std::bad_alloc when the
// allocator has no memory.
using MakeTracker = std::unique_ptr<FrameTracker>(const TrackerParams& params, const CircuitMap* map,
                                                  const Allocator& allocator);

// publish_ns, but at most so long from the other stamp.
int64_t limit_stamp(int64_t stamp_ns, int64_t publish_ns, double most_s) noexcept;
// The time nearest to publish_ns to which all tracks of an iteration at stamp_ns can be predicted: at most 59 s away.
int64_t limit_publish_ns(int64_t stamp_ns, int64_t publish_ns) noexcept;

}  // namespace overtake
