// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// The stages as functions over a Frame. Stages that may run at the same time never write the same table.
#pragma once

#include "core/circuit_map.h"
#include "pipeline/car_profile.h"
#include "pipeline/frame.h"
#include "pipeline/method/method.h"
#include "pipeline/params.h"
#include "pipeline/segment_scratch.h"
#include "pipeline/spare_workers.h"
#include "pipeline/stage_clock.h"

namespace overtake {

// Points of a runner where a test can observe it, make it wait, or make it throw (not at kTake, on the intake).
// kSegment and kSegmented: before and after a scan's segmentation.
enum class HookPoint { kTake, kSegment, kSegmented, kDetect, kTrack, kFinish };
struct TestHook {
  void (*call)(void* user, HookPoint body, Frame& frame, int32_t sensor) = nullptr;  // sensor -1: the whole frame
  void* user = nullptr;
  void operator()(HookPoint body, Frame& frame, int32_t sensor = -1) const {
    if (call) call(user, body, frame, sensor);
  }
};

// Everything the stages read that outlives a frame; constant after create.
struct StageContext {
  const KernelTable* kernels = nullptr;
  const Method* method = &kPaper;
  int32_t sensor_count = 0;
  SensorModel sensors[kMaxSensors];
  SegmentParams segment[kMaxSensors];
  DetectParams detect;
  CarProfile rear{CarProfile::End::kRear}, front{CarProfile::End::kFront};
  int32_t candidate_capacity = 0;     // of a frame
  const CircuitMap* map = nullptr;    // null: none
  SegmentScratch* scratch = nullptr;  // one for each thread that segments
  SpareWorkers* spare = nullptr;      // take parts of steps; null: no step is cut
  TestHook hook;
};

// Range image segmentation of one sensor (paper IV-A): the method's steps.
//   reads  part.scan, part.road        writes  everything else of part but cluster_of_label; context.scratch[thread]
void segment_scan(const StageContext& context, int32_t sensor, SensorPart& part, int32_t thread) noexcept;

// Merge across sensors (eq. 4).   reads  sensors[*]   writes  members, merged, merged_overflow, seam, cluster_of_label
void merge_frame(const StageContext& context, Frame& frame) noexcept;

// The merged cluster of each label, for readers.   reads  members   writes  cluster_of_label
void number_labels(const StageContext& context, Frame& frame) noexcept;

// Of the ego pose that a place measured at stamp_ns belongs to: that stamp, or the time that the sensor's driver
// compensates to.
int64_t find_pose_time(const StageContext& context, const Frame& frame, int32_t sensor, int64_t stamp_ns) noexcept;

// Places the clusters that are, without smoke, no longer than a vehicle (cluster_places.h).
//   reads  merged, members, cluster points, scans, their ground's light, ego, uses_map   writes  smoke_limit, places
void locate_clusters(const StageContext& context, Frame& frame) noexcept;

// Joins the clusters of one car. Seeds by falling number of points: to a seed comes the nearest cluster (box gap on the
// axes of the seed's psi_REF at most gap_m) with which the box along psi_REF stays within the limits, and so on. A seed
// wider than a car stands across the circuit: its limits are turned by 90 deg. Only clusters that locate_clusters
// placed, near the circuit or on its apron (there only within 40 m, and no smoke), and not of the own car.
//   reads  merged, members, places, smoke_limit, scans, cluster points, their pixels and heights, ego, uses_map
//   writes  merged, members, places, merged.count, cluster_of_label
// A joined cluster takes the row order of its first member; its columns are those of its members as after merge_frame.
void join_shards(const StageContext& context, Frame& frame) noexcept;

// Decides whether this frame may use the map: not if an ego pose during the frame is outside of the circuit by more
// than the margin.   reads  ego, merged.stamp_ns   writes  ego_off_map_m, uses_map
void find_ego_on_map(const StageContext& context, Frame& frame) noexcept;

// Size gate (IV-B).   reads  merged   writes  kept, kept_count, candidate_count, gated_points, gated_size
void keep_car_sized(const StageContext& context, Frame& frame) noexcept;

// Map gate (IV-B).   reads  kept, merged, ego, uses_map, ego_off_map_m   writes  kept, kept_count, gated_map
void keep_on_circuit(const StageContext& context, Frame& frame) noexcept;

// Keeps the nearest, up to the capacity.   reads  kept, merged   writes  kept, kept_count, candidate_overflow
void keep_nearest(const StageContext& context, Frame& frame) noexcept;

// Gates of preset best. Number of points; own body; length and width along psi_REF, or, with enough points for psi_VAR,
// along any heading; height, and heights over the ground.
//   reads  merged, places, members, smoke_limit, scans, cluster points, their pixels and heights
//   writes  kept, kept_count, candidate_count, gated_points, gated_own, gated_size
void keep_car_shaped(const StageContext& context, Frame& frame) noexcept;

// The car's centre, by what is seen of it, inside the bounds; on the apron only what is a car beyond doubt. By the ego
// heading that the walls tell, where they contradict the published one.
//   reads  kept, merged, members, places, walls, smoke_limit, scans, cluster points, their pixels and heights, labels,
//          the ground's light, ego_off_map_m
//   writes  kept, kept_count, gated_map
void keep_inside_bounds(const StageContext& context, Frame& frame) noexcept;

// Only without a map: not a piece of a wall that the sensors see, and not behind one.
//   reads  kept, merged, members, places, smoke_limit, cluster points, their pixels and heights
//   writes  kept, kept_count, gated_map   scratch  places.group
void keep_off_walls(const StageContext& context, Frame& frame) noexcept;

// Range of the car's centre.   reads  kept, merged, places   writes  kept, kept_count, gated_range
void keep_in_range(const StageContext& context, Frame& frame) noexcept;

// Not what is left of smoke, no flat ground, and, where the bounds are not known, no sign.
//   reads  kept, merged, members, places, scans, cluster points, their pixels, heights, reasons and labels, the
//          ground's light
//   writes  kept, kept_count, candidate_count, gated_size
void keep_solid(const StageContext& context, Frame& frame) noexcept;

// Clusters with too few points for a detection that pass all other gates, far away and where the bounds are known: what
// a known car may show of itself. They lie behind the kept ones, and go to the tracker only.
//   reads  kept_count, merged, members, places, walls, smoke_limit, scans, cluster points, their pixels and heights,
//          ego_off_map_m
//   writes  kept behind kept_count, faint_count
void list_faint(const StageContext& context, Frame& frame) noexcept;

// Pose by the side that the sensor sees, with covariance, class and height. Leaves out the faint ones among smoke.
//   reads  kept, merged, members, places, smoke_limit, scans, cluster points, their pixels, heights, reasons and labels
//   writes  detections, views but ego_offset_rad, faint_count
void pose_by_view(const StageContext& context, Frame& frame) noexcept;

// Where no row of a sensor has a return (view_gaps.h).   reads  pixel_point, numbers of points   writes  gaps
void find_view_gaps(const StageContext& context, Frame& frame) noexcept;

// The ego heading by the walls. Takes the nearest point of each azimuth from the long clusters of each sensor, so that
// a fence behind the wall and points above it do not count, and fits each sensor's points (fit_walls).
//   reads  merged, members, cluster points, scans, ego, uses_map   writes  walls
void measure_walls(const StageContext& context, Frame& frame) noexcept;

// Two headings and the rectangle (eq. 5).   reads  kept, cluster points, ego, uses_map   writes  detections
void pose_frame(const StageContext& context, Frame& frame) noexcept;

// Runs the method's frame rules and times each stage.
void detect_frame(const StageContext& context, Frame& frame) noexcept;

}  // namespace overtake
