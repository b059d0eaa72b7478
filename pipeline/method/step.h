// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// A step binds one kernel to the columns it reads and writes. The segmentation, its times and probes, the memory plan,
// the agreement tests, the fuzzer and the benchmarks all run a kernel through its step.
#pragma once

#include <cstdint>
#include <span>

#include "pipeline/frame.h"
#include "pipeline/method/segment_columns.h"
#include "pipeline/params.h"

namespace overtake {

// The data of a running segmentation: views and constants; owns no memory.
struct Segment {
  const SensorModel& sensor;
  const SegmentParams& params;
  SensorPart& part;
  SegmentViews& views;
  ColumnSpan columns = {};  // of a step that is cut: what this part of it computes (step_parts.h)
  PointSpan points = {};
};

// The rows above and below that a row of a step's results depends on. The image may then be cut between rows: for a
// part of the image the step gives the same rows, but for the halo at an edge that is not the image's. part.row_count
// then counts the layers from the part's first row on; one more than the part's rows if others follow. is_guess: rows
// farther below seldom change a row's result, so the results are compared with those of the whole image.
struct Halo {
  int32_t above, below;
  bool is_guess = false;
};
template <int32_t kAbove, int32_t kBelow>
constexpr Halo rows_around(const SegmentParams&) noexcept {
  return {kAbove, kBelow};
}

// How a step may be cut into parts that run at the same time on several workers (step_parts.h), with the bytes of one
// part. A part reads all that the steps before wrote, so no halo is copied or computed twice.
//   columns   each part computes its own columns of the images
//   points    each part runs over its own points; what it sums up over them goes to memory of its own, and `join` adds
//             that to the first part's, again in `count` parts
struct Cut {
  enum By { kNone, kColumns, kPoints } by = kNone;
  void (*join)(Segment& whole, int32_t part, int32_t count) noexcept = nullptr;
};
inline constexpr Cut kWhole{}, kByColumns{Cut::kColumns};

struct Step {
  const char* name;  // of the kernel
  int32_t stage;     // ovt_stage: steps of one stage are neighbours and share its time
  Columns reads;     // also columns that it writes only in part
  Columns writes;
  Columns scratch;     // written; the contents are meaningless after the step
  const char* params;  // of ovt_params that it reads: groups and text names, separated by one space
  void (*run)(const KernelTable& kernels, Segment& s) noexcept;
  Halo (*halo)(const SegmentParams& params) noexcept = nullptr;  // null: needs the whole image
  Cut cut = kWhole;
};

// Whether each column that a step reads is `given` or written by an earlier step, and steps of one stage are
// neighbours.
constexpr bool is_chain(std::span<const Step> steps, Columns given) {
  uint64_t ended = 0;  // stages
  for (std::size_t i = 0; i < steps.size(); ++i) {
    if (steps[i].reads & ~given) return false;
    given |= steps[i].writes;
    if (i > 0 && steps[i].stage != steps[i - 1].stage) ended |= uint64_t(1) << steps[i - 1].stage;
    if (ended >> steps[i].stage & 1) return false;
  }
  return true;
}

// The columns that exist before the first step: the scan, the road as the intake knows it, and layer sums of zero.
inline constexpr Columns kGivenColumns = columns(Column::scan, Column::road, Column::layer_sums);

}  // namespace overtake
