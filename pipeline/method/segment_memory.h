// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// Where the columns of a method's segmentation lie. A column that a frame rule or a reader asks for lies in the frame.
// Every other one is alive from the first step that writes it to the last step that uses it, and lies in the scratch of
// the thread that segments, which fits that thread's cache: columns that are never alive together share memory there.
//
//     step      0   1   2   3   4   5          block
//     a         w---r                          [ a ][ d    ]     d begins where a has ended
//     b             w-------r                  [ b         ]
//     d                     w-------r
#pragma once

#include <cstddef>

#include "core/arena.h"
#include "core/sensor_model.h"
#include "pipeline/method/segment_columns.h"

namespace overtake {

struct FrameSizes;
struct Method;
struct SegmentScratch;
struct SegmentViews;
struct SensorPart;

struct SegmentPlan {
  Columns kept = 0;                         // in the frame
  Columns shared = 0;                       // in the scratch; what is in neither the method does not have
  int32_t first[kColumnCount] = {};         // step that writes a shared column first
  int32_t last[kColumnCount] = {};          // step that uses it last
  std::size_t offset[kColumnCount] = {};    // of a shared column in the block
  std::size_t bytes_of[kColumnCount] = {};  // with the largest sensor
  std::size_t bytes = 0;                    // of the block
};

// The columns that a method's steps write, in one of the extents with planned memory.
Columns find_columns(const Method& method) noexcept;

SegmentPlan plan_segment(const FrameSizes& sizes) noexcept;

// Memory of its own for each of the columns.
void carve_columns(Carver& carver, Columns which, const SensorModel& sensor, int32_t point_capacity,
                   SegmentViews& views);

// The views of one segmentation: the kept columns where the frame has them, the shared ones in the scratch's block, in
// the sensor's shape. Valid until the scratch serves another segmentation.
SegmentViews bind_views(const SensorModel& sensor, SensorPart& part, const SegmentScratch& scratch) noexcept;

}  // namespace overtake
