// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// What a thread needs while it segments a scan, whichever sensor's and frame's: one for each thread that may, so it
// stays in that thread's cache. Where a frame need not keep its images, they are here, too, five planes for nine:
//
//   stage       plane 0    plane 1              plane 2          plane 3             plane 4
//   scatter     range      elevation
//   gaps        |                               range filled     elevation filled
//   angle       |          angle                |                |
//   smooth      |          |                    |                |                   angle smooth
//   ground      |                               |                |                   |
//   repair      |          range repaired       |                |                   elevation repaired
//   link        |          |                    |                                    |
//   label       |          |                    |                labels
//   points      |          |                                     |
#pragma once

#include "pipeline/frame.h"

namespace overtake {

struct SegmentScratch {
  Arena arena;
  LayerSums layer_sums;                                           // all zero between scans
  int32_t *row_of_layer = nullptr, *layer_order = nullptr;        // [kLayerIds]
  int32_t *queue = nullptr, *cursor = nullptr, *order = nullptr;  // [pixels + 1] of the largest image
  // Null where frames keep their images.
  float* plane[5] = {};  // with lead and pad
  uint64_t* bits[4] = {};
  float *range_m = nullptr, *elevation_rad = nullptr;  // columns of PointTable
  int32_t *column = nullptr, *pixel = nullptr;
  uint8_t* lost = nullptr;
};

// False, with nothing kept, when the allocator has no memory.
[[nodiscard]] bool build_scratch(SegmentScratch& scratch, const FrameSizes& sizes, const Allocator& allocator);

// Points the part's images and columns that no later stage reads to the scratch; nothing where the frame keeps them.
void lend(const SegmentScratch& scratch, const SensorModel& sensor, SensorPart& part) noexcept;

}  // namespace overtake
