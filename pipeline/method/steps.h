// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// The steps: each kernel of a segmentation, bound once to the columns it reads and writes. The kernel's header
// describes the kernel. A method lists the steps that run, in their order (pipeline/method/paper.cpp).
//
//   OVT_STEP(kernel, stage, parameters, arguments...);
//       the arguments in the kernel's order, each with its use: in, out, ... (step_arguments.h). With by_columns, the
//       step may be cut into parts
//   OVT_ROW_STEP(kernel, stage, parameters, halo, arguments...): its rows depend on few others (Step::halo)
//   OVT_STEP_BY_HAND(name, stage, parameters, cut, OVT_READS(...), OVT_WRITES(...), OVT_SCRATCH(...)) { call }
//   OVT_ROW_STEP_BY_HAND(name, stage, parameters, halo, cut, OVT_READS(...), ...) { call }
//       for kernels that take whole tables and use some of their columns; in the call, k: KernelTable, s: Segment
//
// tests/test_steps.cpp checks that each step reads and writes only the columns that it declares.
#pragma once

#include <algorithm>

#include "core/table.h"
#include "pipeline/method/count_reasons.h"
#include "pipeline/method/mark_own_body.h"
#include "pipeline/method/mark_smoke.h"
#include "pipeline/method/split_abreast.h"
#include "pipeline/method/split_walls.h"
#include "pipeline/method/step.h"
#include "pipeline/method/step_arguments.h"
#include "pipeline/method/step_parts.h"
#include "pipeline/road/sample_road.h"

namespace overtake::step {

using enum Column;
using namespace argument;

#define OVT_READS(...) columns(__VA_ARGS__)
#define OVT_WRITES(...) columns(__VA_ARGS__)
#define OVT_SCRATCH(...) columns(__VA_ARGS__)
#define OVT_STEP(name, stage, params, ...) OVT_ROW_STEP(name, stage, params, nullptr, __VA_ARGS__)
#define OVT_STEP_BY_HAND(name, stage, params, cut, reads, writes, scratch) \
  OVT_ROW_STEP_BY_HAND(name, stage, params, nullptr, cut, reads, writes, scratch)
#define OVT_ROW_STEP(name, stage, params, halo, ...)                                                  \
  inline void run_##name(const KernelTable& k, Segment& s) noexcept { call(k.name, s, __VA_ARGS__); } \
  inline constexpr Step name = {#name,                                                                \
                                OVT_STAGE_##stage,                                                    \
                                reads_of(__VA_ARGS__),                                                \
                                writes_of(__VA_ARGS__),                                               \
                                scratch_of(__VA_ARGS__),                                              \
                                params,                                                               \
                                &run_##name,                                                          \
                                halo,                                                                 \
                                cut_of(__VA_ARGS__)}
#define OVT_ROW_STEP_BY_HAND(name, stage, params, halo, cut, reads, writes, scratch)                               \
  inline void run_##name(const KernelTable& k, Segment& s) noexcept;                                               \
  inline constexpr Step name = {#name, OVT_STAGE_##stage, reads, writes, scratch, params, &run_##name, halo, cut}; \
  inline void run_##name([[maybe_unused]] const KernelTable& k, Segment& s) noexcept

OVT_STEP_BY_HAND(project_points, PROJECT, "", (Cut{Cut::kPoints, &join_layer_sums}), OVT_READS(scan, layer_sums),
                 OVT_WRITES(point_range_m, point_elevation_rad, point_column, point_reason, layer_sums),
                 OVT_SCRATCH()) {
  const ScanTable scan = rows_of(s.part.scan, s.points);
  PointTable points = rows_from(s.views.points, s.points.first);
  k.project_points(s.sensor, scan, points, s.views.layer_sums);
  s.views.points.count = s.part.scan.count;
}

OVT_STEP(rank_layers, PROJECT, "", result<row_count>, sensor<&SensorModel::rows>, inout<layer_sums>, out<row_of_layer>,
         scratch<layer_order>);

OVT_STEP_BY_HAND(scatter_points, PROJECT, "", (Cut{Cut::kPoints, &join_winners}),
                 OVT_READS(scan, row_of_layer, point_range_m, point_elevation_rad, point_column, point_reason),
                 OVT_WRITES(range_m, elevation_rad, pixel_point, point_pixel, point_lost, point_label, point_reason),
                 OVT_SCRATCH()) {
  const ScanTable scan = rows_of(s.part.scan, s.points);
  PointTable points = rows_of(s.views.points, s.points);
  k.scatter_points(scan, s.views.row_of_layer, points, s.views.images);
}

OVT_ROW_STEP(fill_gaps, GAPS, "gaps", (rows_around<1, 1>), params<&SegmentParams::fill_gaps>, in<range_m>,
             in<elevation_rad>, out<range_filled_m>, out<elevation_filled_rad>, by_columns);
OVT_ROW_STEP(angle_image, ANGLE, "angle", (rows_around<0, 1>), params<&SegmentParams::angle_image>, in<range_filled_m>,
             in<elevation_filled_rad>, out<angle_rad>, by_columns);

// By hand: there are row_count - 1 pairs of rows.
constexpr Halo smooth_halo(const SegmentParams& params) noexcept {
  return {params.smooth_sg.half_window, params.smooth_sg.half_window};
}
OVT_ROW_STEP_BY_HAND(smooth_sg, SMOOTH, "smooth", smooth_halo, kByColumns, OVT_READS(row_count, angle_rad),
                     OVT_WRITES(angle_smooth_rad), OVT_SCRATCH()) {
  const RangeImages& m = s.views.images;
  k.smooth_sg(s.params.smooth_sg, std::max(s.part.row_count - 1, 0), m.angle_rad, m.angle_smooth_rad, s.columns);
}

// A pixel without an angle asks whether its column has a return in any lower row: most have one in the next row.
constexpr Halo ground_halo(const SegmentParams&) noexcept { return {0, 1, true}; }
OVT_ROW_STEP(mark_ground, GROUND, "ground", ground_halo, params<&SegmentParams::mark_ground>, in<row_count>,
             in<angle_smooth_rad>, in<range_filled_m>, in<pixel_point>, out<nonground>, by_columns);
// Not a kernel: samples the road surface for running_ground.
OVT_STEP_BY_HAND(sample_road, GROUND, "running_ground", kByColumns,
                 OVT_READS(road, range_filled_m, elevation_filled_rad),
                 OVT_WRITES(road_offset_m, road_slope, road_level_slope, road_known_m, road_bound_per_m,
                            road_last_bound_per_m),
                 OVT_SCRATCH()) {
  const RangeImages& m = s.views.images;
  overtake::sample_road(k, s.params.running_ground, s.part.road, s.sensor, m.range_filled_m, m.elevation_filled_rad,
                        s.views.road_surface, s.columns);
}
OVT_STEP_BY_HAND(running_ground, GROUND, "running_ground", kByColumns,
                 OVT_READS(road_offset_m, road_slope, road_level_slope, road_known_m, range_filled_m,
                           elevation_filled_rad),
                 OVT_WRITES(height_m, nonground), OVT_SCRATCH(steep)) {
  const RangeImages& m = s.views.images;
  k.running_ground(s.params.running_ground, s.views.road_surface, m.range_filled_m, m.elevation_filled_rad, m.height_m,
                   m.nonground, m.steep, s.columns);
}
OVT_STEP(mark_islands, GROUND, "", sensor<&SensorModel::wraps>, sensor<&SensorModel::pitch_rad>, in<range_filled_m>,
         in<height_m>, inout<nonground>);
// Not a kernel: how bright the ground is.
OVT_STEP_BY_HAND(find_ground_light, GROUND, "", kWhole, OVT_READS(scan, range_filled_m, pixel_point, nonground),
                 OVT_WRITES(ground_light), OVT_SCRATCH()) {
  const RangeImages& m = s.views.images;
  s.part.ground_light = overtake::find_ground_light(s.part.scan, m.range_filled_m, m.pixel_point, m.nonground);
}
OVT_STEP(drop_smoke, GROUND, "smoke", params<&SegmentParams::drop_smoke>, in<scan>, in<ground_light>, in<point_pixel>,
         in<range_filled_m>, in<pixel_point>, inout<nonground>, scratch<considered>, scratch<steep>, out<smoke>);
OVT_STEP(keep_above_road, GROUND, "", sensor<&SensorModel::T_vehicle_sensor>, in<range_filled_m>,
         in<elevation_filled_rad>, out<range_repaired_m>, out<elevation_repaired_rad>, out<nonground_repaired>);
OVT_ROW_STEP(repair_range, REPAIR, "repair", (rows_around<0, 0>), params<&SegmentParams::repair_range>,
             in<range_filled_m>, in<elevation_filled_rad>, in<nonground>, out<range_repaired_m>,
             out<elevation_repaired_rad>, out<nonground_repaired>, by_columns);
OVT_ROW_STEP(link_pixels, LINK, "cluster", (rows_around<0, 1>), params<&SegmentParams::link_pixels>,
             in<range_repaired_m>, in<elevation_repaired_rad>, in<nonground_repaired>, out<link_right>, out<link_down>,
             by_columns);
OVT_STEP(cut_steps, LINK, "", in<range_filled_m>, in<range_repaired_m>, in<road_bound_per_m>, in<road_last_bound_per_m>,
         inout<link_down>);
OVT_STEP(label_bfs, LABEL, "", result<label_count>, sensor<&SensorModel::wraps>, in<range_filled_m>,
         in<nonground_repaired>, in<link_right>, in<link_down>, out<labels>, scratch<queue>);

OVT_STEP(label_cut, LABEL, "cut", result<label_count>, params<&SegmentParams::cut_links>, sensor<&SensorModel::wraps>,
         in<range_filled_m>, in<range_repaired_m>, in<elevation_repaired_rad>, in<nonground_repaired>,
         inout<link_right>, inout<link_down>, out<labels>, scratch<queue>, scratch<label_extent>);

OVT_STEP_BY_HAND(label_points, LABEL, "label", kWhole,
                 OVT_READS(point_range_m, point_pixel, point_lost, point_label, point_reason, range_filled_m,
                           range_repaired_m, pixel_point, labels),
                 OVT_WRITES(point_label, point_reason), OVT_SCRATCH()) {
  k.label_points(s.params.label_points, s.views.images, s.views.points);
}

// Not a kernel: gives the points in pixels of smoke their reason.
OVT_STEP_BY_HAND(mark_smoke, LABEL, "", kWhole,
                 OVT_READS(smoke, pixel_point, point_pixel, point_lost, point_reason, point_label),
                 OVT_WRITES(point_label, point_reason), OVT_SCRATCH()) {
  overtake::mark_smoke(s.views.images.smoke, s.views.images.pixel_point, s.views.points);
}

OVT_STEP_BY_HAND(build_clusters, CLUSTERS, "", kWhole, OVT_READS(scan, point_label, point_range_m, label_count),
                 OVT_WRITES(clusters, cluster_points, row_of_label, cluster_overflow), OVT_SCRATCH(cursor, order)) {
  s.part.cluster_overflow =
      k.build_clusters(s.sensor.T_vehicle_sensor, s.part.scan, s.views.points, s.part.label_count, s.part.clusters,
                       s.part.cluster_points, s.part.row_of_label, s.views.cursor, s.views.order);
}

// Not kernels: divide a cluster that is two cars side by side, or a wall and a car.
OVT_STEP_BY_HAND(split_clusters, CLUSTERS, "cut.strip_m cut.wall_m", kWhole,
                 OVT_READS(scan, point_range_m, point_pixel, point_lost, point_label, height_m, labels, label_count,
                           clusters, cluster_points),
                 OVT_WRITES(point_label, labels, label_count, clusters, cluster_points, row_of_label, cluster_overflow),
                 OVT_SCRATCH(cursor, order)) {
  const RangeImages& m = s.views.images;
  const int32_t before = s.part.label_count;
  s.part.label_count = overtake::split_abreast(s.params.split_abreast, s.part.clusters, s.part.cluster_points,
                                               s.part.label_count, s.views.points, m.labels);
  const int32_t divided = s.part.label_count;
  if (divided > before) run_build_clusters(k, s);
  s.part.label_count = overtake::split_walls(s.params.split_walls, s.part.clusters, s.part.cluster_points, m.height_m,
                                             s.part.label_count, s.views.points, m.labels);
  if (s.part.label_count > divided) run_build_clusters(k, s);
}

// Not a kernel: points on the own car are no obstacles.
OVT_STEP_BY_HAND(mark_own_body, CLUSTERS, "gate.own_back_m gate.own_front_m gate.own_side_m", kWhole,
                 OVT_READS(clusters, cluster_points, point_label, point_reason), OVT_WRITES(point_label, point_reason),
                 OVT_SCRATCH()) {
  overtake::mark_own_body(s.params.own_body, s.part.clusters, s.part.cluster_points, s.views.points);
}

// Not a kernel: counts the points of each reason.
OVT_STEP_BY_HAND(count_reasons, CLUSTERS, "", kWhole, OVT_READS(point_reason), OVT_WRITES(reason_count),
                 OVT_SCRATCH()) {
  overtake::count_reasons(s.views.points, s.part.reason_count);
}

#undef OVT_READS
#undef OVT_WRITES
#undef OVT_SCRATCH

// The step that calls each kernel, in the order of kernels.def; null: no segmentation calls it.
inline constexpr const Step* kOfKernel[] = {
#define OVT_STEP_OF_step(name) &name,
#define OVT_STEP_OF_other(name) nullptr,
#define OVT_KERNEL(name, form, caller) OVT_STEP_OF_##caller(name)
#include "kernels/kernels.def"
#undef OVT_KERNEL
#undef OVT_STEP_OF_step
#undef OVT_STEP_OF_other
};

}  // namespace overtake::step
