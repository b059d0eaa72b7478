// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// Scratch memory for the segmentation of one scan, of any sensor and frame. Each thread that segments has one, so it
// stays in that thread's cache.
#pragma once

#include "pipeline/frame.h"
#include "pipeline/method/segment_memory.h"
#include "pipeline/method/step_parts.h"

namespace overtake {

struct SegmentScratch {
  Arena arena;
  SegmentPlan plan;
  char* block = nullptr;             // [plan.bytes]: the shared columns, see bind_views
  LayerSums layer_sums;              // all zero between scans
  int32_t parts = 1;                 // of a step that is cut, at most
  PartViews part[kMaxParts];         // their memory, but for the first one's; layer_sums: as above
  char* part_block[kMaxParts] = {};  // of the images
};

// False, with nothing kept, when the allocator has no memory.
// most_parts: of a step that is cut.
[[nodiscard]] bool build_scratch(SegmentScratch& scratch, const FrameSizes& sizes, const Allocator& allocator,
                                 int32_t most_parts = 1);

}  // namespace overtake
