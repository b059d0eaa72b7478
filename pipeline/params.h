// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// The C API's parameters, and the parameters of the stages that follow from them.
#pragma once

#include <string>

#include "kernels/kernel_table.h"
#include "pipeline/ego_heading.h"
#include "pipeline/overtake.h"
#include "pipeline/track/heading_filter.h"
#include "pipeline/track/tracker_params.h"

namespace overtake {

// Parameters of one sensor's segmentation, as the kernels take them.
struct SegmentParams {
  FillGapsParams fill_gaps;
  AngleImageParams angle_image;
  SmoothSgParams smooth_sg;
  MarkGroundParams mark_ground;
  RepairRangeParams repair_range;
  LinkPixelsParams link_pixels;
  LabelPointsParams label_points;
};

// Parameters of the stages over a whole frame.
struct DetectParams {
  MergeSeamsParams merge_seams;
  GateClustersParams gate_clusters;
  FitRectangleParams fit_rectangle;
  double map_margin_m = 0;
  double ego_margin_m = 0;  // not less than map_margin_m
  double vehicle_width_m = 0;
  WallParams walls;
  HeadingFilterParams ego_heading;
};

// "" if every value is within its limits and they are consistent; else the error, starting with the text name.
std::string find_bad_param(const ovt_params& params);

SegmentParams make_segment_params(const ovt_params& params, const SensorModel& sensor) noexcept;
DetectParams make_detect_params(const ovt_params& params) noexcept;
TrackerParams make_tracker_params(const ovt_params& params, int32_t track_capacity,
                                  int32_t detection_capacity) noexcept;

}  // namespace overtake
