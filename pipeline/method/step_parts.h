// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// A step in parts (Step::cut), which may run at the same time and in any order. When all have run, so do the parts of
// its join, if it has one. Then every column has the bytes of the step in one piece.
//
//   points     |---- part 0 ----|---- part 1 ----|---- part 2 --|     bounds: multiples of kPointSpan
//   columns    |---- part 0 ----|---- part 1 ----|---- part 2 --|     bounds: words of bits
#pragma once

#include "pipeline/method/step.h"

namespace overtake {

inline constexpr int32_t kMaxParts = 4;

// Runs one of `count` parts of a step. A part may be empty.
void run_part(const KernelTable& kernels, const Step& step, const Segment& whole, int32_t part, int32_t count) noexcept;

// Joins. The sums of layers are integers, so their order does not matter; the first part of the join adds all of them.
void join_layer_sums(Segment& whole, int32_t part, int32_t count) noexcept;
// The winners of the parts' pixels, by columns. The winner of a pixel is the largest by a total order
// (scatter_points.h), so it does not matter which points competed first.
void join_winners(Segment& whole, int32_t part, int32_t count) noexcept;

}  // namespace overtake
