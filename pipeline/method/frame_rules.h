// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// The rules over a frame, each bound once to the columns that it reads of the sensors' segmentations. pipeline/stages.h
// describes their functions.
#pragma once

#include "pipeline/method/method.h"
#include "pipeline/stages.h"

namespace overtake::rule {

using enum Column;

inline constexpr FrameRule merge_seams = {
    .name = "merge_seams",
    .stage = OVT_STAGE_MERGE,
    .reads = columns(scan, point_label, pixel_point, clusters, row_of_label, label_count),
    .params = "merge",
    .run = &merge_frame};

inline constexpr FrameRule find_ego_on_map = {.name = "find_ego_on_map",
                                              .stage = OVT_STAGE_GATE,
                                              .reads = columns(),
                                              .params = "gate.ego_margin_m gate.map_margin_m",
                                              .run = &overtake::find_ego_on_map,
                                              .without_scans = true};

inline constexpr FrameRule keep_car_sized = {.name = "keep_car_sized",
                                             .stage = OVT_STAGE_GATE,
                                             .reads = columns(),
                                             .params = "gate.min_points gate.slack vehicle.length_m",
                                             .run = &overtake::keep_car_sized};

inline constexpr FrameRule keep_on_circuit = {.name = "keep_on_circuit",
                                              .stage = OVT_STAGE_GATE,
                                              .reads = columns(),
                                              .params = "gate.map_margin_m vehicle.width_m",
                                              .run = &overtake::keep_on_circuit};

inline constexpr FrameRule keep_nearest = {
    .name = "keep_nearest", .stage = OVT_STAGE_GATE, .reads = columns(), .params = "", .run = &overtake::keep_nearest};

// The track stage corrects the ego heading if the method has this rule.
inline constexpr FrameRule measure_walls = {.name = "measure_walls",
                                            .stage = OVT_STAGE_GATE,
                                            .reads = columns(scan, clusters, cluster_points),
                                            .params = "ego_heading",
                                            .run = &overtake::measure_walls};

inline constexpr FrameRule pose_by_two_headings = {.name = "pose_by_two_headings",
                                                   .stage = OVT_STAGE_POSE,
                                                   .reads = columns(clusters, cluster_points),
                                                   .params = "vehicle pose.margin_m pose.min_var_points",
                                                   .run = &pose_frame};

// ---- preset best ----------------------------------------------------------------------------------------------------

constexpr FrameRule in_stage(FrameRule rule, int32_t stage) {
  rule.stage = stage;
  return rule;
}

// The track stage looks for gaps that last if the method has this rule.
inline constexpr FrameRule find_view_gaps = {.name = "find_view_gaps",
                                             .stage = OVT_STAGE_MERGE,
                                             .reads = columns(pixel_point, clusters, cluster_points, reason_count),
                                             .params = "",
                                             .run = &overtake::find_view_gaps};

// In the stage of the rules that place clusters on the circuit, because it runs before them.
inline constexpr FrameRule find_ego_on_map_first = in_stage(find_ego_on_map, OVT_STAGE_MERGE);

inline constexpr FrameRule locate_clusters = {
    .name = "locate_clusters",
    .stage = OVT_STAGE_MERGE,
    .reads = columns(scan, clusters, cluster_points, pixel_point, point_pixel, ground_light),
    .params = "vehicle.length_m gate.slack smoke.dark_share",
    .run = &overtake::locate_clusters,
    .uses_places = true};

inline constexpr FrameRule join_shards = {
    .name = "join_shards",
    .stage = OVT_STAGE_MERGE,
    .reads = columns(scan, clusters, cluster_points, row_of_label, label_count, pixel_point, point_pixel, height_m),
    .params =
        "join vehicle gate.height_m gate.lowest_m gate.top_m gate.own_back_m "
        "gate.own_front_m gate.own_side_m",
    .run = &overtake::join_shards,
    .uses_places = true};

inline constexpr FrameRule keep_car_shaped = {
    .name = "keep_car_shaped",
    .stage = OVT_STAGE_GATE,
    .reads = columns(scan, clusters, cluster_points, pixel_point, point_pixel, height_m),
    .params =
        "gate.min_points gate.slack gate.width_slack_m gate.height_m "
        "gate.lowest_m gate.top_m gate.own_back_m gate.own_front_m "
        "gate.own_side_m vehicle pose.min_var_points",
    .run = &overtake::keep_car_shaped,
    .uses_places = true};

inline constexpr FrameRule keep_inside_bounds = {
    .name = "keep_inside_bounds",
    .stage = OVT_STAGE_GATE,
    .reads = columns(scan, clusters, cluster_points, pixel_point, point_pixel, point_label, height_m, ground_light),
    .params = "gate.inside_m gate.slack gate.width_slack_m vehicle pose.front_length_m",
    .run = &overtake::keep_inside_bounds,
    .uses_places = true};

inline constexpr FrameRule keep_off_walls = {
    .name = "keep_off_walls",
    .stage = OVT_STAGE_GATE,
    .reads = columns(clusters, cluster_points, pixel_point, point_pixel, height_m),
    .params = "gate.wall_m ego_heading.wall_length_m vehicle.width_m class.debris_m",
    .run = &overtake::keep_off_walls,
    .uses_places = true};

inline constexpr FrameRule keep_in_range = {
    .name = "keep_in_range",
    .stage = OVT_STAGE_GATE,
    .reads = columns(),
    .params = "gate.range_m gate.free_range_m gate.slack gate.width_slack_m vehicle pose.front_length_m",
    .run = &overtake::keep_in_range,
    .uses_places = true};

inline constexpr FrameRule keep_solid = {
    .name = "keep_solid",
    .stage = OVT_STAGE_GATE,
    .reads = columns(scan, clusters, cluster_points, pixel_point, point_pixel, point_label, height_m, ground_light),
    .params = "gate.min_points smoke.dark_share vehicle.length_m",
    .run = &overtake::keep_solid,
    .uses_places = true};

inline constexpr FrameRule list_faint = {
    .name = "list_faint",
    .stage = OVT_STAGE_GATE,
    .reads = columns(scan, clusters, cluster_points, pixel_point, point_pixel, height_m),
    .params =
        "gate.min_points gate.slack gate.width_slack_m gate.height_m "
        "gate.lowest_m gate.top_m gate.inside_m gate.range_m gate.free_range_m vehicle "
        "pose.min_var_points pose.front_length_m",
    .run = &overtake::list_faint,
    .uses_places = true};

inline constexpr FrameRule pose_by_view = {
    .name = "pose_by_view",
    .stage = OVT_STAGE_POSE,
    .reads = columns(scan, clusters, cluster_points, pixel_point, point_pixel, point_label, point_reason, height_m),
    .params = "vehicle pose class",
    .run = &overtake::pose_by_view,
    .uses_places = true};

}  // namespace overtake::rule
