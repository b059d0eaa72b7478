// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
#include "pipeline/segment_scratch.h"

namespace overtake {

bool build_scratch(SegmentScratch& scratch, const FrameSizes& sizes, const Allocator& allocator) {
  scratch.plan = plan_segment(sizes);
  return scratch.arena.build(allocator, [&](Carver& carver) {
    scratch.layer_sums.touched = carver.take<int32_t>(kLayerIds);
    scratch.layer_sums.point_count = carver.take<int32_t>(kLayerIds);
    scratch.layer_sums.elevation_sum = carver.take<int64_t>(kLayerIds);
    scratch.block = carver.take<char>(scratch.plan.bytes);
  });
}

}  // namespace overtake
