// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// The track stage of a frame: chooses the tracker's frame of reference, makes measurements of detections, and runs the
// tracker.
//
// The tracker works in the vehicle frame until the first ego pose, and in the map from then on. Rows that are pushed in
// the map need no pose: where no scan came before, they turn the tracker to the map, and the next scan without a pose
// turns it back. Each change deletes all tracks, whose states are not valid in the other frame.
//
//   frame                   ego pose at its stamp   tracks in    action
//   scans                   known                   map          measure, step
//                           unknown                 vehicle      measure, step
//                           unknown                 map          predict: the detections have no known place in the map
//   pushed, vehicle frame   as scans
//   pushed, map             known or not            map          measure, step
//                           unknown                 vehicle      predict: the rows have no known place
//   prediction              known or not            as they are  predict
//   detect threw            known or not            as above     predict
//
// If the method measures walls, rows go from the vehicle frame to the map with the corrected ego heading. An old ego
// pose widens their variance as before. psi_REF of the map came to the vehicle frame with the published heading, so it
// goes back with that one.
#pragma once

#include <memory>

#include "pipeline/frame.h"
#include "pipeline/track/frame_tracker.h"
#include "pipeline/track/gap_watch.h"
#include "pipeline/track/heading_filter.h"

namespace overtake {

struct StageContext;

class TrackStage {
 public:
  // Throws std::bad_alloc when the allocator has no memory.
  TrackStage(const StageContext& context, const TrackerParams& params,
             const Allocator& allocator = default_allocator());
  //   reads  detections or external, ego, walls, gaps   writes  measurements, views.ego_offset_rad, tracks,
  //   track_states, detections.heading_rad of psi_REF, reference, ego_known, ego_state, ego_heading, blocked,
  //   tracks_ns, refiltered, lost_rows, values_ignored, flags
  void run(Frame& frame) noexcept;
  FrameTracker& tracker() noexcept { return *tracker_; }

 private:
  void choose_reference(Frame& frame) noexcept;
  void correct_heading(Frame& frame) noexcept;
  bool may_measure(Frame& frame) const noexcept;
  void measure_detections(Frame& frame) const noexcept;
  void measure_external(Frame& frame) const noexcept;
  // Deviation of the corrected heading of a sensor, or of kMean, in the frame under way.
  double heading_sigma(int32_t sensor) const noexcept;
  void find_blocked(Frame& frame) noexcept;
  int32_t observe(const Frame& frame, ObservedSector* sectors) const noexcept;
  StepResult step(Frame& frame) noexcept;
  void predict(Frame& frame) noexcept;

  const StageContext& context_;
  TrackerParams params_;
  const int64_t lead_ns_;  // pushed detections may be ahead of scans by this much
  std::unique_ptr<FrameTracker> tracker_;
  std::unique_ptr<HeadingFilter> heading_;  // null: the method measures no walls
  std::unique_ptr<GapWatch> gaps_;          // null: the method finds no gaps
  EgoWindow corrected_;                     // of the frame under way: poses with corrected headings, without constants
  HeadingFilter::State learned_{};          // of the frame under way
  HeadingCause cause_{};                    // of the frame under way
  bool tracks_scans_ = false;               // in the vehicle frame
  bool rows_chose_map_ = false;             // reference_ is the map by pushed rows alone
  int32_t reference_ = OVT_REFERENCE_VEHICLE;
  int64_t newest_ns_ = INT64_MIN;  // of the frames run so far
};

}  // namespace overtake
