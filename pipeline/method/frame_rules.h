// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// The rules over a frame, each bound once to what it reads of the sensors' segmentations. What they do stands in
// pipeline/stages.h.
#pragma once

#include "pipeline/method/method.h"
#include "pipeline/stages.h"

namespace overtake::rule {

using enum Column;

inline constexpr FrameRule merge_seams = {
    "merge_seams", OVT_STAGE_MERGE, columns(scan, point_label, pixel_point, clusters, row_of_label, label_count),
    columns(),     &merge_frame,    nullptr};

inline constexpr FrameRule keep_car_sized = {"keep_car_sized",          OVT_STAGE_GATE, columns(), columns(),
                                             &overtake::keep_car_sized, nullptr};

inline constexpr FrameRule keep_on_track = {"keep_on_track", OVT_STAGE_GATE,           columns(),
                                            columns(),       &overtake::keep_on_track, nullptr};

inline constexpr FrameRule keep_nearest = {"keep_nearest", OVT_STAGE_GATE,          columns(),
                                           columns(),      &overtake::keep_nearest, nullptr};

inline constexpr FrameRule pose_by_two_headings = {
    "pose_by_two_headings", OVT_STAGE_POSE, columns(clusters, cluster_points),
    columns(order),         &pose_frame,    &pose_clusters};

}  // namespace overtake::rule
