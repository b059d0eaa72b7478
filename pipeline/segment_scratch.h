// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// Scratch memory for the segmentation of one scan, of any sensor and frame. Each thread that segments has one, so it
// stays in that thread's cache.
#pragma once

#include "pipeline/frame.h"
#include "pipeline/method/segment_memory.h"

namespace overtake {

struct SegmentScratch {
  Arena arena;
  SegmentPlan plan;
  char* block = nullptr;  // [plan.bytes]: the shared columns, see bind_views
  LayerSums layer_sums;   // all zero between scans
};

// False, with nothing kept, when the allocator has no memory.
[[nodiscard]] bool build_scratch(SegmentScratch& scratch, const FrameSizes& sizes, const Allocator& allocator);

}  // namespace overtake
