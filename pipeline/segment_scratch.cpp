// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
#include "pipeline/segment_scratch.h"

#include <algorithm>

namespace overtake {

bool build_scratch(SegmentScratch& scratch, const FrameSizes& sizes, const Allocator& allocator, int32_t most_parts) {
  const auto take_sums = [](Carver& carver, LayerSums& sums) {
    sums.touched = carver.take<int32_t>(kLayerIds);
    sums.point_count = carver.take<int32_t>(kLayerIds);
    sums.elevation_sum = carver.take<int64_t>(kLayerIds);
  };
  scratch.plan = plan_segment(sizes);
  std::size_t part_bytes = 0;
  for (int32_t s = 0; s < sizes.sensor_count; ++s) {
    Carver carver;
    RangeImages images;
    carve_part(carver, sizes.sensors[s], images);
    part_bytes = std::max(part_bytes, carver.bytes());
  }
  scratch.parts = most_parts;
  return scratch.arena.build(allocator, [&](Carver& carver) {
    take_sums(carver, scratch.layer_sums);
    for (int32_t i = 1; i < most_parts; ++i) {
      take_sums(carver, scratch.part[i].layer_sums);
      scratch.part_block[i] = carver.take<char>(part_bytes);
    }
    scratch.block = carver.take<char>(scratch.plan.bytes);
  });
}

}  // namespace overtake
