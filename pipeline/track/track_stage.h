// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// The tracker's side of a frame.
#pragma once

#include <memory>

#include "pipeline/frame.h"
#include "pipeline/track/tracker.h"

namespace overtake {

struct StageContext;

// The tracker's side: which frame of reference it works in, and the iteration itself.
class TrackStage {
 public:
  // Throws std::bad_alloc when the allocator has no memory.
  TrackStage(const StageContext& context, const TrackerParams& params,
             const Allocator& allocator = default_allocator());
  //   reads  detections or external, ego   writes  measurements, tracks, reference, flags
  void run(Frame& frame) noexcept;
  // What became of the last frame; a prediction is none.
  StepResult last_step() const noexcept { return last_step_; }
  FrameTracker& tracker() noexcept { return *tracker_; }

 private:
  void measure_detections(Frame& frame) noexcept;
  void measure_external(Frame& frame) noexcept;
  int32_t observe(const Frame& frame, ObservedSector* sectors) const noexcept;

  const StageContext& context_;
  TrackerParams params_;
  std::unique_ptr<FrameTracker> tracker_;
  int32_t reference_ = OVT_REFERENCE_VEHICLE;
  int64_t newest_ns_ = INT64_MIN;  // of the frames run so far
  StepResult last_step_;
};

}  // namespace overtake
