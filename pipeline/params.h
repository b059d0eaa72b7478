// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// The C API's parameters, and the parameters of the stages that follow from them.
#pragma once

#include <string>

#include "kernels/kernel_table.h"
#include "pipeline/ego_heading.h"
#include "pipeline/method/split_abreast.h"
#include "pipeline/method/split_walls.h"
#include "pipeline/overtake.h"
#include "pipeline/track/heading_filter.h"
#include "pipeline/track/tracker_params.h"

namespace overtake {

// Box of the own car, from the vehicle's origin.
struct OwnBodyParams {
  float back_m, front_m, side_m;
};

// Parameters of one sensor's segmentation, as the kernels take them.
struct SegmentParams {
  FillGapsParams fill_gaps;
  AngleImageParams angle_image;
  SmoothSgParams smooth_sg;
  MarkGroundParams mark_ground;
  RunningGroundParams running_ground;
  DropSmokeParams drop_smoke;
  RepairRangeParams repair_range;
  LinkPixelsParams link_pixels;
  CutLinksParams cut_links;
  LabelPointsParams label_points;
  SplitAbreastParams split_abreast;
  SplitWallsParams split_walls;
  OwnBodyParams own_body;
};

// Limits of what can be one car, along psi_REF: of joined clusters, or of a candidate.
struct CarLimits {
  float length_m, width_m, height_m;
};

struct JoinShardsParams {
  float gap_m, bound_m;
  CarLimits limits;
};

struct CarGateParams {
  CarLimits limits;
  OwnBodyParams own;
  float inside_m;               // of a car's centre to the bounds, at least
  float range_m, free_range_m;  // to the origin, at most: with bounds of the circuit; without
  float lowest_m, top_m;        // of the lowest and the highest point, over the ground, at most
  float wall_m;                 // without a map, from a wall's line: a piece of the wall; 0: not gated
};

struct PoseByViewParams {
  float front_length_m;    // with at least this length the front end is seen
  float profile_points;    // of the profile of a race car; 0: not used
  double angle_sigma_rad;  // of the ego heading
  float debris_m;          // size of debris, at most
};

// Parameters of the stages over a whole frame.
struct DetectParams {
  MergeSeamsParams merge_seams;
  GateClustersParams gate_clusters;
  FitRectangleParams fit_rectangle;
  double map_margin_m = 0;
  double ego_margin_m = 0;  // not less than map_margin_m
  double vehicle_width_m = 0;
  JoinShardsParams join_shards;
  CarGateParams gate_cars;
  PoseByViewParams pose_by_view;
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
