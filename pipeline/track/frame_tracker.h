// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// What a frame asks of a tracker, whichever method it belongs to.
#pragma once

#include <cstdint>

#include "core/track_table.h"

namespace overtake {

struct TrackerFrame;   // pipeline/track/tracker.h
struct TrackerCounts;  // pipeline/track/tracker.h
struct StepResult;     // pipeline/track/tracker.h

// One thread at a time, but for publish, path_points and path_step_s, which any thread may call at any time. Nothing
// allocates after construction. Tracker (pipeline/track/tracker.h) says what each call promises.
class FrameTracker {
 public:
  virtual ~FrameTracker() = default;

  // One iteration on the measurements of a frame. track_of_measurement[measurements.size()]: the id each one went to.
  virtual StepResult step(const TrackerFrame& frame, TrackId* track_of_measurement) noexcept = 0;
  // Forgets every track; ids are never reused.
  virtual void restart() noexcept = 0;
  // All tracks as they are, ordered by slot.
  virtual void snapshot(TrackTable& states) const noexcept = 0;
  // All tracks predicted to stamp_ns. The tracker itself stays as it is.
  virtual void predict(int64_t stamp_ns, TrackTable& states) const noexcept = 0;
  virtual TrackerCounts counts() const noexcept = 0;

  // The tracks of a snapshot (which may be `tracks` itself) predicted to publish_ns, and their paths, which may be
  // null. Depends on the arguments and on parameters alone.
  virtual void publish(const TrackTable& states, int64_t publish_ns, TrackTable& tracks,
                       PathTable* paths) const noexcept = 0;
  virtual int32_t path_points() const noexcept = 0;  // of each track
  virtual double path_step_s() const noexcept = 0;   // between two of them
};

}  // namespace overtake
