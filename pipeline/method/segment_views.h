// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// Views of a segmentation's columns; null for a column that does not exist. During a segmentation, the Segment has
// views of all columns of the method. Afterwards the frame has views of the columns in its own memory
// (SegmentPlan::kept).
#pragma once

#include "core/point_table.h"
#include "core/range_image.h"
#include "core/road_surface.h"
#include "kernels/cut_links.h"
#include "kernels/project_points.h"

namespace overtake {

// What a part of a step that is cut by points writes, until the parts are joined (step_parts.h). The first part writes
// to the segmentation's own columns.
struct PartViews {
  LayerSums layer_sums;
  RangeImages images;  // range_m elevation_rad pixel_point
};

struct SegmentViews {
  PointTable points;
  RangeImages images;
  LayerSums layer_sums;
  RoadSurface road_surface;
  PartViews* parts = nullptr;  // one for each part; null: no step is cut
  int32_t *row_of_layer = nullptr, *layer_order = nullptr;
  int32_t *queue = nullptr, *cursor = nullptr, *order = nullptr;
  LabelExtent* label_extent = nullptr;
};

}  // namespace overtake
