// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
#include "pipeline/stages.h"

#include <algorithm>

#include "pipeline/cluster_places.h"
#include "pipeline/early_segment.h"
#include "pipeline/method/step_parts.h"

namespace overtake {

namespace {

// Runs a step, in parts if it may be cut and workers are spare.
void run_step(const StageContext& context, const Step& step, Segment& segment, int32_t thread) noexcept {
  const int32_t parts = step.cut.by == Cut::kNone || !context.spare ? 1 : context.spare->count_parts();
  if (parts == 1) return step.run(*context.kernels, segment);
  context.spare->run(thread, parts, [&](int32_t part) { run_part(*context.kernels, step, segment, part, parts); });
  if (step.cut.join) context.spare->run(thread, parts, [&](int32_t part) { step.cut.join(segment, part, parts); });
}

}  // namespace

void segment_scan(const StageContext& context, int32_t sensor, SensorPart& part, int32_t thread) noexcept {
  SegmentViews views = bind_views(context.sensors[sensor], part, context.scratch[thread]);
  Segment segment = {context.sensors[sensor], context.segment[sensor], part, views};
  std::size_t done = 0;
  if (part.early) {  // the producer ran the first steps
    done = std::size_t(part.early->steps);
    show_columns(part.early->columns & ~part.kept_columns, part.early->views, views);
    views.points.count = part.scan.count;
  }
  StageClock clock(part.spans, {-1, part.stamp_ns, sensor});
  clock.run(context.method->segment.subspan(done), [&](const Step& step) { run_step(context, step, segment, thread); });
  clock.total(OVT_STAGE_SEGMENT);
  part.kept.points.count = views.points.count;
  give_early(part);
}

void merge_frame(const StageContext& context, Frame& frame) noexcept {
  SeamSide sides[kMaxSensors];
  list_sides(context, frame, sides);
  frame.merged_overflow = context.kernels->merge_seams(context.detect.merge_seams, sides, context.sensor_count,
                                                       frame.members, frame.merged, frame.seam);
  number_labels(context, frame);
}

void number_labels(const StageContext& context, Frame& frame) noexcept {
  int32_t member = 0;
  for (int32_t s = 0; s < context.sensor_count; ++s) {
    SensorPart& part = frame.sensors[s];
    if (!part.present) continue;
    for (int32_t label = 0; label <= part.label_count; ++label) {
      const int32_t row = part.row_of_label[label];
      part.cluster_of_label[label] = row < 0 ? -1 : frame.members.merged[member + row];
    }
    member += part.clusters.count;
  }
}

// One decision for the whole frame. Clusters have different stamps: if the pose jumps between them, a gate that decides
// by each cluster's own pose would silently drop the clusters of one side. Checks the poses at the stamps of scans and
// clusters, and every pose between them.
void find_ego_on_map(const StageContext& context, Frame& frame) noexcept {
  constexpr double kNowhere_m = 1e9;
  frame.ego_off_map_m = 0.0;
  frame.uses_map = context.map != nullptr;
  if (!context.map) return;
  int64_t first_ns = frame.first_stamp_ns, last_ns = frame.stamp_ns;
  for (int32_t i = 0; i < frame.merged.count; ++i) {
    first_ns = std::min(first_ns, frame.merged.stamp_ns[i]);
    last_ns = std::max(last_ns, frame.merged.stamp_ns[i]);
  }
  double off_m = 0.0;
  int32_t hint = -1;
  const auto ask = [&](const EgoPose& pose) {
    off_m = std::max(off_m, context.map->measure_outside(pose.x_m, pose.y_m, &hint));
  };
  EgoState ego;
  for (const int64_t stamp_ns : {first_ns, frame.stamp_ns, last_ns})
    if (frame.ego.at(stamp_ns, ego)) ask(ego.pose);
  for (int32_t i = 0; i < frame.ego.count; ++i)
    if (const EgoPose& pose = frame.ego.poses[i]; pose.stamp_ns > first_ns && pose.stamp_ns < last_ns) ask(pose);
  frame.ego_off_map_m = std::min(off_m, kNowhere_m);
  frame.uses_map = off_m <= context.detect.ego_margin_m;
}

int64_t find_pose_time(const StageContext& context, const Frame& frame, int32_t sensor, int64_t stamp_ns) noexcept {
  const SensorModel& model = context.sensors[sensor];
  return model.is_compensated ? later_ns(frame.sensors[sensor].stamp_ns, model.compensated_to_ns) : stamp_ns;
}

void keep_car_sized(const StageContext& context, Frame& frame) noexcept {
  const FrameClusterTable& merged = frame.merged;
  const GateClustersParams& by_size = context.detect.gate_clusters;
  frame.kept_count = context.kernels->gate_clusters(by_size, merged, frame.kept);
  frame.candidate_count = frame.kept_count;
  frame.gated_points = 0;
  for (int32_t i = 0; i < merged.count; ++i) frame.gated_points += merged.point_count[i] < by_size.min_points;
  frame.gated_size = merged.count - frame.gated_points - frame.kept_count;
}

void keep_on_circuit(const StageContext& context, Frame& frame) noexcept {
  const FrameClusterTable& merged = frame.merged;
  // The map gate is active while the ego pose is known, fresh and on the map. The gate transforms each centroid to the
  // map with the ego pose at its cluster's stamp. The last segment is the hint of the next projection: neighbours in
  // the table are mostly neighbours on the circuit.
  const double outside_m = find_outside(context, frame), map_margin_m = context.detect.map_margin_m;
  const double margin = outside_m > 0.0 ? std::max(map_margin_m, outside_m) : map_margin_m;
  EgoState ego;
  const auto is_on_circuit = [&](int32_t row, MapProjection& place) {
    const int64_t pose_ns = find_pose_time(context, frame, merged.main_sensor[row], merged.stamp_ns[row]);
    if (!frame.uses_map || !frame.ego.at(pose_ns, ego) || ego.age_ns > kEgoFreshNs) return true;
    double x, y;
    ego.to_map(double(merged.center_x_m[row]), double(merged.center_y_m[row]), double(merged.center_z_m[row]), x, y);
    place = context.map->project(x, y, place.segment);
    const bool within = place.d_m <= place.width_left_m + margin && place.d_m >= -place.width_right_m - margin;
    return within && (margin > 0 || place.inside);
  };
  MapProjection place{};
  place.segment = -1;
  int32_t count = 0;
  for (int32_t i = 0; i < frame.kept_count; ++i)
    if (is_on_circuit(frame.kept[i], place)) frame.kept[count++] = frame.kept[i];
  frame.gated_map = frame.kept_count - count;
  frame.kept_count = count;
}

// Beyond the capacity the nearest stay, in table order.
void keep_nearest(const StageContext& context, Frame& frame) noexcept {
  int32_t* const kept = frame.kept;
  const float* const nearest_m = frame.merged.nearest_m;
  const int32_t count = std::min(frame.kept_count, context.candidate_capacity);
  frame.candidate_overflow = frame.kept_count - count;
  if (frame.candidate_overflow > 0) {
    std::nth_element(kept, kept + count, kept + frame.kept_count, [&](int32_t a, int32_t b) {
      return nearest_m[a] != nearest_m[b] ? nearest_m[a] < nearest_m[b] : a < b;
    });
    std::sort(kept, kept + count);
  }
  frame.kept_count = count;
}

void pose_frame(const StageContext& context, Frame& frame) noexcept {
  DetectionTable& out = frame.detections;
  out.count = frame.kept_count;
  int32_t hint = -1;
  for (int32_t i = 0; i < out.count; ++i) {
    const int32_t row = frame.kept[i];
    const ClusterReference reference = find_reference(context, frame, row, hint);
    out.map_s_m[i] = reference.on_map ? float(reference.place.s_m) : 0.0f;
    out.map_d_m[i] = reference.on_map ? float(reference.place.d_m) : 0.0f;
    const RectangleFit fit = fit_cluster(context, frame, row, float(reference.heading_rad));
    write_pose(frame, i, row, fit);
  }
}

void detect_frame(const StageContext& context, Frame& frame) noexcept {
  if (frame.kind != FrameKind::kScans) {
    for (const FrameRule& rule : context.method->frame)
      if (rule.without_scans) rule.run(context, frame);
    return;
  }
  StageClock clock(frame.spans, {frame.sequence, frame.stamp_ns, -1});
  clock.run(context.method->frame, [&](const FrameRule& rule) { rule.run(context, frame); });
}

}  // namespace overtake
