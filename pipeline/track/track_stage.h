// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// The tracker's side of a frame: which frame of reference the tracker works in, what the frame measures, and the
// iteration itself.
//
// The tracker works in the map from the first ego pose on, in the vehicle frame until then. Changing over forgets the
// tracks: they mean nothing in the other frame.
//
//   frame                   ego pose at its stamp   tracks in    what is done
//   scans                   known                   map          measure, step
//                           unknown                 vehicle      measure, step
//                           unknown                 map          predict: nobody knows where they were measured
//   pushed, vehicle frame   as scans
//   pushed, map             known or not            map          measure, step
//   prediction              known or not            as they are  predict
//   detect threw            known or not            as above     predict
#pragma once

#include <memory>

#include "pipeline/frame.h"
#include "pipeline/track/frame_tracker.h"

namespace overtake {

struct StageContext;

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
  void choose_reference(Frame& frame) noexcept;
  bool may_measure(Frame& frame) const noexcept;
  void measure_detections(Frame& frame) const noexcept;
  void measure_external(Frame& frame) const noexcept;
  int32_t observe(const Frame& frame, ObservedSector* sectors) const noexcept;
  void step(Frame& frame) noexcept;
  void predict(Frame& frame) noexcept;

  const StageContext& context_;
  TrackerParams params_;
  std::unique_ptr<FrameTracker> tracker_;
  int32_t reference_ = OVT_REFERENCE_VEHICLE;
  int64_t newest_ns_ = INT64_MIN;  // of the frames run so far
  StepResult last_step_;
};

}  // namespace overtake
