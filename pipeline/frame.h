// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// One sweep of all sensors: tables per sensor and shared ones. One Frame is one reused slot of the pool; nothing in it
// allocates after create. Who writes what:
//
//   intake     sequence, stamps, sensor_mask, kind, ego, sensors[s].scan          (one thread, before the stages)
//   segment    sensors[s]: everything else                                        (one task per sensor, side by side)
//   detect     members, merged, kept, detections                                  (after all of the frame's segments)
//   track      tracks, track_of_detection, flags                                  (frame after frame)
#pragma once

#include <atomic>
#include <cstddef>
#include <cstdint>

#include "core/cluster_table.h"
#include "core/point_table.h"
#include "core/sensor_model.h"
#include "core/table.h"
#include "core/track_table.h"
#include "kernels/kernel_table.h"
#include "pipeline/ego_buffer.h"
#include "pipeline/method/segment_views.h"
#include "pipeline/overtake.h"
#include "pipeline/stage_clock.h"
#include "pipeline/track/measurement.h"

namespace overtake {

struct Method;
extern const Method kPaper;

// One sensor's part of a frame.
struct SensorPart {
  bool present = false;
  bool failed = false;  // its segmentation threw: not present then
  int64_t stamp_ns = 0;
  ScanTable scan;
  SegmentViews kept;  // in this frame's memory: what rules and readers get of the segmentation's columns
  ClusterTable clusters;
  ClusterPointTable cluster_points;
  int32_t row_count = 0;  // layers found
  int32_t label_count = 0;
  int32_t cluster_overflow = 0;
  int32_t reason_count[kReasonCount] = {};  // points by reason
  StageSpans spans;
  int32_t* row_of_label = nullptr;      // [label_count + 1] in clusters, -1 none
  int32_t* cluster_of_label = nullptr;  // the same in the frame's merged table; written by merge
};

enum class FrameKind : int32_t { kScans, kExternal, kPrediction };

// Detections pushed by the user, as the tracker takes them.
struct ExternalTable {
  int32_t count = 0, capacity = 0;
  double *x_m = nullptr, *y_m = nullptr, *heading_rad = nullptr, *var_x = nullptr, *var_y = nullptr, *cov_xy = nullptr;
};
// clang-format off
template <class F>
void for_each_column(ExternalTable& t, F&& f) {
  f("x_m", t.x_m);      f("y_m", t.y_m);      f("heading_rad", t.heading_rad);
  f("var_x", t.var_x);  f("var_y", t.var_y);  f("cov_xy", t.cov_xy);
}
// clang-format on

struct Frame {
  Arena arena;
  // intake
  int64_t sequence = -1;
  FrameKind kind = FrameKind::kScans;
  int64_t first_stamp_ns = 0, stamp_ns = 0;
  uint32_t sensor_mask = 0, flags = 0;
  EgoWindow ego;
  SensorPart sensors[kMaxSensors];
  ExternalTable external;
  int32_t external_reference = OVT_REFERENCE_MAP;
  uint32_t stale_mask = 0;    // sensors silent for more than 1.5 periods
  uint32_t suspect_mask = 0;  // sources of which a stamp was refused: bit s of sensor s, OVT_SUSPECT_...
  bool restart = false;       // the clock jumped: tracks of before mean nothing
  bool failed = false;        // detect threw: nothing is known of this frame, the tracks only predict
  // detect
  MemberTable members;
  FrameClusterTable merged;
  SeamScratch seam;
  int32_t* kept = nullptr;  // rows of merged that pass the gates
  int32_t kept_count = 0, candidate_count = 0;
  DetectionTable detections;
  float *fit_x_m = nullptr, *fit_y_m = nullptr;  // points of one candidate
  int32_t fit_capacity = 0;
  int32_t merged_overflow = 0, candidate_overflow = 0;
  int32_t gated_points = 0, gated_size = 0, gated_map = 0;
  double ego_off_map_m = 0;  // how far the ego pose lies outside of the track
  bool map_holds = false;    // there is one, and the ego pose is not beyond its margin: gate and pose may ask it
  // track
  MeasurementTable measurements;
  TrackTable tracks;                  // states at their own stamps, as the tracker left them
  std::byte* track_states = nullptr;  // the same in the tracker's own form, row by row: paths start from these
  int32_t reference = OVT_REFERENCE_VEHICLE;
  int64_t tracks_ns = 0;   // the tracks' own time: stamp_ns, or the newest where this frame is late
  int32_t refiltered = 0;  // iterations run again for it
  int32_t lost_rows = 0;   // detections or pushed rows that the tracker was not given
  bool ego_known = false;
  EgoState ego_state;  // at stamp_ns
  StageSpans spans;
  std::atomic<int64_t> started_ns{0};  // steady clock, start of the first segmentation
  std::atomic<int64_t> closed_ns{0};   // steady clock, nothing more came for it; 0: it is open
  bool stall_counted = false;          // intake's
  int64_t pushed_ns = 0;               // steady clock, push of its last scan
  int64_t latency_ns = -1;             // from there to its tracks
  // graph
  std::atomic<int32_t> pending{0};      // segmentations under way, plus one while the frame is open
  std::atomic<uint64_t> references{0};  // see frame_pool.h
};

struct FrameSizes {
  const SensorModel* sensors = nullptr;
  const int32_t* point_capacity = nullptr;  // per sensor
  int32_t sensor_count = 0;
  int32_t cluster_capacity = 0, candidate_capacity = 0, track_capacity = 0, external_capacity = 0;
  std::size_t track_state_bytes = 0;  // of one track
  int32_t merge_columns = 1;
  bool keep_images = true;
  const Method* method = &kPaper;
};

// Carves every table of a frame from one block.
[[nodiscard]] bool build_frame(Frame& frame, const FrameSizes& sizes, const Allocator& allocator);

// Ready for the next sweep; keeps the memory.
void reset_frame(Frame& frame) noexcept;

}  // namespace overtake
