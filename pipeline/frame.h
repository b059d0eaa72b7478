// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// The scans of all sensors at one time, and all results: tables per sensor and shared tables. A Frame is a reused slot
// of the pool; it allocates nothing after create. Each part has one writer:
//
//   intake     sequence, stamps, sensor_mask, kind, ego, external, sensors[s].scan, .present   (before the stages)
//   segment    sensors[s]: everything else, but cluster_of_label                               (a task per sensor)
//   detect     members, merged, cluster_of_label, smoke_limit, walls, gaps, kept, places, detections, views   (after
//              all segments)
//   track      measurements, tracks, track_states, reference, ego_known, ego_state, tracks_ns,   (frame after frame)
//              refiltered, lost_rows, values_ignored, ego_heading, blocked, views.ego_offset_rad (and adds to
//              views.var_x .. and to detections.heading_rad of psi_REF)
//
// Intake, detect, track and finish set bits of `flags`, one after the other.
#pragma once

#include <atomic>
#include <cstddef>
#include <cstdint>

#include "core/cluster_table.h"
#include "core/point_table.h"
#include "core/sensor_model.h"
#include "core/table.h"
#include "core/track_table.h"
#include "kernels/ground_light.h"
#include "kernels/kernel_table.h"
#include "pipeline/ego_buffer.h"
#include "pipeline/ego_heading.h"
#include "pipeline/method/segment_columns.h"
#include "pipeline/method/segment_views.h"
#include "pipeline/overtake.h"
#include "pipeline/road/road_data.h"
#include "pipeline/stage_clock.h"
#include "pipeline/track/measurement.h"
#include "pipeline/view_gaps.h"

namespace overtake {

struct EarlyColumns;
struct Method;
extern const Method kPaper;

// One sensor's part of a frame.
struct SensorPart {
  bool present = false;
  bool failed = false;  // its segmentation threw: then present is false
  int64_t stamp_ns = 0;
  ScanTable scan;
  RoadData road;                  // by the intake, if a step of the method reads it
  SegmentViews kept;              // the segmentation's columns for rules and readers, in this frame's memory
  Columns kept_columns = 0;       // columns of `kept`
  EarlyColumns* early = nullptr;  // until the segmentation ends, of a scan whose first steps its producer ran
  ClusterTable clusters;
  ClusterPointTable cluster_points;
  int32_t row_count = 0;  // layers found
  int32_t label_count = 0;
  int32_t cluster_overflow = 0;
  int32_t reason_count[kReasonCount] = {};  // points by reason
  GroundLight ground_light;                 // only with the step find_ground_light
  StageSpans spans;
  int32_t* row_of_label = nullptr;      // [label_count + 1] in clusters, -1 none
  int32_t* cluster_of_label = nullptr;  // the same in the frame's merged table; merge_frame writes it
};

enum class FrameKind : int32_t { kScans, kExternal, kPrediction };

// Detections pushed by the user, as input of the tracker.
struct ExternalTable {
  int32_t count = 0, capacity = 0;
  double *x_m = nullptr, *y_m = nullptr, *heading_rad = nullptr, *var_x = nullptr, *var_y = nullptr, *cov_xy = nullptr;
  double *length_m = nullptr, *width_m = nullptr, *height_m = nullptr, *score = nullptr;
};
// clang-format off
template <class F>
void for_each_column(ExternalTable& t, F&& f) {
  f("x_m", t.x_m);      f("y_m", t.y_m);      f("heading_rad", t.heading_rad);
  f("var_x", t.var_x);  f("var_y", t.var_y);  f("cov_xy", t.cov_xy);
  f("length_m", t.length_m);  f("width_m", t.width_m);  f("height_m", t.height_m);
  f("score", t.score);
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
  uint32_t stale_mask = 0;       // sensors silent for more than 1.5 periods
  uint32_t suspect_mask = 0;     // sources with a refused stamp: bit s for sensor s, OVT_SUSPECT_...
  uint32_t incomplete_mask = 0;  // sensors whose scan lacks points
  bool restart = false;          // the clock jumped: earlier tracks are invalid
  bool failed = false;           // detect threw: no detections, the tracks are only predicted
  // detect
  MemberTable members;
  FrameClusterTable merged;
  SeamScratch seam;
  int32_t* kept = nullptr;  // rows of merged that pass the gates; behind them the faint ones
  int32_t kept_count = 0, candidate_count = 0;
  int32_t faint_count = 0;               // rows behind those of `kept`, `detections` and `views`, for the tracker only
  ClusterPlaceTable places;              // of the rows of merged; no memory unless a rule of the method uses it
  GroundLight smoke_limit[kMaxSensors];  // dark_share of its ground: darker points may be smoke; 0: it sees none
  DetectionTable detections;
  DetectionViewTable views;                      // by detection; no memory either
  float *fit_x_m = nullptr, *fit_y_m = nullptr;  // points of one candidate
  int32_t fit_capacity = 0;
  int32_t merged_overflow = 0, candidate_overflow = 0;
  int32_t gated_points = 0, gated_size = 0, gated_map = 0, gated_own = 0, gated_range = 0;
  double ego_off_map_m = 0;        // distance of the ego pose outside of the circuit, 0 inside
  bool uses_map = false;           // a map exists and the ego pose is within its margin: gate and pose may use it
  WallHeading walls[kMaxSensors];  // by sensor
  ViewGaps gaps[kMaxSensors];      // of their scans
  // track
  MeasurementTable measurements;
  TrackTable tracks;                  // each state at its own stamp, from the tracker's snapshot
  std::byte* track_states = nullptr;  // the tracker's full states of these rows: paths start from them
  int32_t reference = OVT_REFERENCE_VEHICLE;
  int64_t tracks_ns = 0;       // time of the tracks: stamp_ns, or the newest stamp if this frame is older
  int32_t refiltered = 0;      // iterations that ran again for this frame
  int32_t lost_rows = 0;       // detections or pushed rows that did not reach the tracker
  int32_t values_ignored = 0;  // of pushed rows: given, but no car can have them
  bool ego_known = false;
  EgoState ego_state;             // at stamp_ns
  ViewGaps blocked[kMaxSensors];  // the gaps that last
  EgoHeading ego_heading;
  StageSpans spans;
  std::atomic<int64_t> started_ns{0};  // steady clock, start of the first segmentation
  std::atomic<int64_t> closed_ns{0};   // steady clock, the intake closed the frame; 0: it is open
  bool stall_counted = false;          // used by the intake only
  int64_t pushed_ns = 0;               // steady clock, push of its last scan
  int64_t latency_ns = -1;             // from pushed_ns to its tracks
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

// Clears the results of the last use; keeps the memory.
void reset_frame(Frame& frame) noexcept;

}  // namespace overtake
