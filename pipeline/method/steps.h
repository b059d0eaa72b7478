// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// The steps: each kernel of a segmentation, bound once to the columns it reads and writes. What a kernel does stands in
// its header; which steps run, and in which order, a method says (pipeline/method/paper.cpp).
//
// OVT_STEP(kernel, stage, parameters, OVT_READS(...), OVT_WRITES(...), OVT_SCRATCH(...)) { what it runs on a Segment s
// }
#pragma once

#include <algorithm>

#include "pipeline/method/count_reasons.h"
#include "pipeline/method/step.h"

namespace overtake::step {

using enum Column;

#define OVT_READS(...) columns(__VA_ARGS__)
#define OVT_WRITES(...) columns(__VA_ARGS__)
#define OVT_SCRATCH(...) columns(__VA_ARGS__)
#define OVT_STEP(name, stage, params, reads, writes, scratch)                                           \
  inline void run_##name(Segment& s) noexcept;                                                          \
  inline constexpr Step name = {#name, OVT_STAGE_##stage, reads, writes, scratch, params, &run_##name}; \
  inline void run_##name(Segment& s) noexcept

OVT_STEP(project_points, PROJECT, "", OVT_READS(scan, layer_sums),
         OVT_WRITES(point_range_m, point_elevation_rad, point_column, point_reason, layer_sums), OVT_SCRATCH()) {
  s.kernels.project_points(s.sensor, s.part.scan, s.part.points, s.scratch.layer_sums);
}

OVT_STEP(rank_layers, PROJECT, "", OVT_READS(layer_sums), OVT_WRITES(layer_sums, row_of_layer, row_count),
         OVT_SCRATCH(layer_order)) {
  s.part.row_count =
      s.kernels.rank_layers(s.sensor.rows, s.scratch.layer_sums, s.scratch.row_of_layer, s.scratch.layer_order);
}

OVT_STEP(scatter_points, PROJECT, "",
         OVT_READS(scan, row_of_layer, point_range_m, point_elevation_rad, point_column, point_reason),
         OVT_WRITES(range_m, elevation_rad, pixel_point, point_pixel, point_lost, point_reason), OVT_SCRATCH()) {
  s.kernels.scatter_points(s.part.scan, s.scratch.row_of_layer, s.part.points, s.part.images);
}

OVT_STEP(fill_gaps, GAPS, "gaps", OVT_READS(range_m, elevation_rad), OVT_WRITES(range_filled_m, elevation_filled_rad),
         OVT_SCRATCH()) {
  const RangeImages& m = s.part.images;
  s.kernels.fill_gaps(s.params.fill_gaps, m.range_m, m.elevation_rad, m.range_filled_m, m.elevation_filled_rad);
}

OVT_STEP(angle_image, ANGLE, "angle", OVT_READS(range_filled_m, elevation_filled_rad), OVT_WRITES(angle_rad),
         OVT_SCRATCH()) {
  const RangeImages& m = s.part.images;
  s.kernels.angle_image(s.params.angle_image, m.range_filled_m, m.elevation_filled_rad, m.angle_rad);
}

OVT_STEP(smooth_sg, SMOOTH, "smooth", OVT_READS(row_count, angle_rad), OVT_WRITES(angle_smooth_rad), OVT_SCRATCH()) {
  const RangeImages& m = s.part.images;
  s.kernels.smooth_sg(s.params.smooth_sg, std::max(s.part.row_count - 1, 0), m.angle_rad, m.angle_smooth_rad);
}

OVT_STEP(mark_ground, GROUND, "ground", OVT_READS(row_count, angle_smooth_rad, range_filled_m, pixel_point),
         OVT_WRITES(nonground), OVT_SCRATCH()) {
  const RangeImages& m = s.part.images;
  s.kernels.mark_ground(s.params.mark_ground, s.part.row_count, m.angle_smooth_rad, m.range_filled_m, m.pixel_point,
                        m.nonground);
}

OVT_STEP(repair_range, REPAIR, "repair", OVT_READS(range_filled_m, elevation_filled_rad, nonground),
         OVT_WRITES(range_repaired_m, elevation_repaired_rad, nonground_repaired), OVT_SCRATCH()) {
  const RangeImages& m = s.part.images;
  s.kernels.repair_range(s.params.repair_range, m.range_filled_m, m.elevation_filled_rad, m.nonground,
                         m.range_repaired_m, m.elevation_repaired_rad, m.nonground_repaired);
}

OVT_STEP(link_pixels, LINK, "cluster", OVT_READS(range_repaired_m, elevation_repaired_rad, nonground_repaired),
         OVT_WRITES(link_right, link_down), OVT_SCRATCH()) {
  const RangeImages& m = s.part.images;
  s.kernels.link_pixels(s.params.link_pixels, m.range_repaired_m, m.elevation_repaired_rad, m.nonground_repaired,
                        m.link_right, m.link_down);
}

OVT_STEP(label_bfs, LABEL, "", OVT_READS(range_filled_m, nonground_repaired, link_right, link_down),
         OVT_WRITES(labels, label_count), OVT_SCRATCH(queue)) {
  const RangeImages& m = s.part.images;
  s.part.label_count = s.kernels.label_bfs(s.sensor.wraps, m.range_filled_m, m.nonground_repaired, m.link_right,
                                           m.link_down, m.labels, s.scratch.queue);
}

OVT_STEP(label_points, LABEL, "label",
         OVT_READS(point_range_m, point_pixel, point_lost, point_reason, range_m, range_repaired_m, pixel_point,
                   labels),
         OVT_WRITES(point_label, point_reason), OVT_SCRATCH()) {
  s.kernels.label_points(s.params.label_points, s.part.images, s.part.points);
}

OVT_STEP(build_clusters, CLUSTERS, "", OVT_READS(scan, point_label, point_range_m, label_count),
         OVT_WRITES(clusters, cluster_points, row_of_label, cluster_overflow), OVT_SCRATCH(cursor, order)) {
  s.part.cluster_overflow = s.kernels.build_clusters(s.sensor.T_vehicle_sensor, s.part.scan, s.part.points,
                                                     s.part.label_count, s.part.clusters, s.part.cluster_points,
                                                     s.part.row_of_label, s.scratch.cursor, s.scratch.order);
}

// No kernel: a tally of what became of the points.
OVT_STEP(count_reasons, CLUSTERS, "", OVT_READS(point_reason), OVT_WRITES(reason_count), OVT_SCRATCH()) {
  overtake::count_reasons(s.part.points, s.part.reason_count);
}

#undef OVT_READS
#undef OVT_WRITES
#undef OVT_SCRATCH

}  // namespace overtake::step
