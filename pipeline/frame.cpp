// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
#include "pipeline/frame.h"

#include <algorithm>

#include "pipeline/early_segment.h"
#include "pipeline/method/method.h"
#include "pipeline/method/segment_memory.h"
#include "pipeline/scan_builder.h"

namespace overtake {
namespace {

void carve_sensor(Carver& carver, SensorPart& part, const SensorModel& sensor, int32_t point_capacity,
                  int32_t cluster_capacity, Columns kept) {
  carve_table(carver, part.scan, scan_rows(point_capacity));
  part.kept.points.capacity = round_up(point_capacity, kRowAlign);
  carve_columns(carver, kept, sensor, point_capacity, part.kept);
  part.kept_columns = kept;
  carve_table(carver, part.clusters, cluster_capacity);
  carve_table(carver, part.cluster_points, point_capacity + kRowAlign);            // build_clusters.h
  const std::size_t pixels = std::size_t(sensor.rows) * std::size_t(sensor.cols);  // upper limit of the labels
  part.row_of_label = carver.take<int32_t>(pixels + 1);
  part.cluster_of_label = carver.take<int32_t>(pixels + 1);
}

bool uses_places(const Method& method) {
  return std::any_of(method.frame.begin(), method.frame.end(), [](const FrameRule& rule) { return rule.uses_places; });
}

}  // namespace

bool build_frame(Frame& frame, const FrameSizes& sizes, const Allocator& allocator) {
  int32_t points = 0, seam_points = 0;
  for (int32_t s = 0; s < sizes.sensor_count; ++s) {
    points += sizes.point_capacity[s];
    seam_points = std::max(seam_points, sizes.sensors[s].rows * std::min(sizes.merge_columns, sizes.sensors[s].cols));
  }
  const int32_t clusters = round_up(sizes.cluster_capacity, kRowAlign);  // as carve_table rounds the tables
  const int32_t members = clusters * std::max(sizes.sensor_count, 1);
  const int32_t measurements = std::max(sizes.candidate_capacity, sizes.external_capacity);
  const SegmentPlan plan = plan_segment(sizes);
  return frame.arena.build(allocator, [&](Carver& carver) {
    for (int32_t s = 0; s < sizes.sensor_count; ++s)
      carve_sensor(carver, frame.sensors[s], sizes.sensors[s], sizes.point_capacity[s], clusters, plan.kept);
    carve_table(carver, frame.external, sizes.external_capacity);
    carve_table(carver, frame.members, members);
    carve_table(carver, frame.merged, clusters);
    for (int32_t side = 0; side < 2; ++side) {
      frame.seam.x_m[side] = carver.take<float>(std::size_t(round_up(seam_points, kRowAlign)));
      frame.seam.y_m[side] = carver.take<float>(std::size_t(round_up(seam_points, kRowAlign)));
      frame.seam.z_m[side] = carver.take<float>(std::size_t(round_up(seam_points, kRowAlign)));
      frame.seam.member[side] = carver.take<int32_t>(std::size_t(round_up(seam_points, kRowAlign)));
    }
    frame.seam.parent = carver.take<int32_t>(std::size_t(members));
    frame.seam.order = carver.take<int32_t>(std::size_t(members));
    frame.seam.capacity = seam_points;
    frame.kept = carver.take<int32_t>(std::size_t(members));
    carve_table(carver, frame.detections, sizes.candidate_capacity);
    if (uses_places(*sizes.method)) {
      carve_table(carver, frame.places, clusters);
      carve_table(carver, frame.views, sizes.candidate_capacity);
    }
    frame.fit_capacity = round_up(points, kRowAlign);
    frame.fit_x_m = carver.take<float>(std::size_t(frame.fit_capacity) + kRowAlign);
    frame.fit_y_m = carver.take<float>(std::size_t(frame.fit_capacity) + kRowAlign);
    carve_table(carver, frame.measurements, measurements);
    carve_table(carver, frame.tracks, sizes.track_capacity);
    frame.track_states = carver.take<std::byte>(std::size_t(sizes.track_capacity) * sizes.track_state_bytes);
  });
}

void reset_frame(Frame& frame) noexcept {
  frame.sensor_mask = 0;
  frame.flags = 0;
  frame.stale_mask = frame.suspect_mask = frame.incomplete_mask = 0;
  frame.restart = frame.failed = false;
  frame.refiltered = 0;
  frame.kind = FrameKind::kScans;
  for (SensorPart& part : frame.sensors) {
    part.present = part.failed = false;
    if (part.early) give_early(part);  // its segmentation threw
    part.road.has_pose = false;
    part.clusters.count = part.cluster_points.count = part.label_count = part.row_count = part.cluster_overflow = 0;
    part.kept.points.count = 0;
    std::fill(std::begin(part.reason_count), std::end(part.reason_count), 0);
    part.ground_light = {};
    part.spans.reset();
  }
  frame.external.count = 0;
  frame.members.count = frame.merged.count = frame.detections.count = frame.measurements.count = 0;
  frame.tracks.count = 0;
  frame.kept_count = frame.faint_count = frame.candidate_count = frame.merged_overflow = frame.candidate_overflow = 0;
  frame.places.count = frame.views.count = 0;
  frame.gated_points = frame.gated_size = frame.gated_map = frame.gated_own = frame.gated_range = frame.lost_rows = 0;
  frame.values_ignored = 0;
  frame.ego_off_map_m = 0;
  frame.uses_map = false;
  std::fill(std::begin(frame.walls), std::end(frame.walls), WallHeading());
  for (int32_t s = 0; s < kMaxSensors; ++s) frame.gaps[s] = frame.blocked[s] = {};
  frame.ego_heading = {};
  frame.ego_known = false;
  frame.ego.count = 0;
  frame.spans.reset();
  frame.started_ns.store(0, std::memory_order_relaxed);
  frame.closed_ns.store(0, std::memory_order_relaxed);
  frame.stall_counted = false;
  frame.pushed_ns = 0;
  frame.latency_ns = -1;
}

}  // namespace overtake
