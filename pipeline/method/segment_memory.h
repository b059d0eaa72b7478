// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// The memory plan of a method's segmentation. A column that a frame rule or a reader needs lies in the frame. Every
// other column is alive from the first step that writes it to the last step that uses it, and lies in the scratch of
// the thread that segments. Columns that are never alive together share memory there, so the scratch fits that thread's
// cache.
//
//     step      0   1   2   3   4   5          block
//     a         w---r                          [ a ][ d    ]     d reuses the memory of a
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
struct RangeImages;
struct SegmentViews;
struct SensorPart;

struct SegmentPlan {
  Columns kept = 0;                         // in the frame
  Columns shared = 0;                       // in the scratch; the method does not have a column that is in neither set
  int32_t first[kColumnCount] = {};         // step that writes a shared column first
  int32_t last[kColumnCount] = {};          // step that uses it last
  std::size_t offset[kColumnCount] = {};    // of a shared column in the block
  std::size_t bytes_of[kColumnCount] = {};  // with the largest sensor
  std::size_t bytes = 0;                    // of the block
};

// The columns in planned memory (every extent but `own`) that a method's steps write.
Columns find_columns(const Method& method) noexcept;

SegmentPlan plan_segment(const FrameSizes& sizes) noexcept;

// Takes separate memory for each of the columns.
void carve_columns(Carver& carver, Columns which, const SensorModel& sensor, int32_t point_capacity,
                   SegmentViews& views);

// Exchanges the columns' memory.
void swap_columns(Columns which, SegmentViews& a, SegmentViews& b) noexcept;
// Lets `to` show the columns of `from`.
void show_columns(Columns which, SegmentViews& from, SegmentViews& to) noexcept;

// The images of a part of a step that is cut by points.
void carve_part(Carver& carver, const SensorModel& sensor, RangeImages& images);

// The views of one segmentation, in the sensor's shape: kept columns in the frame, shared columns in the scratch's
// block. Valid until the next segmentation with this scratch.
SegmentViews bind_views(const SensorModel& sensor, SensorPart& part, SegmentScratch& scratch) noexcept;

}  // namespace overtake
