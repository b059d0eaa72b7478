// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// Section 7 of kernels/README.md: connected components of the linked pixels.
#pragma once

#include "core/plane.h"

namespace overtake {

// Breadth-first search over the links. Clusters are numbered 1, 2, ... by their first pixel in row-major order,
// whatever algorithm finds them.
//   reads    nonground_repaired link_right link_down; range_filled_m (a pixel with range and no cluster is ground)
//   writes   labels, every pixel: kLabelNone, kLabelGround, 1, 2, ...
//   returns  the number of clusters               scratch  queue[rows * cols]
//   cost     each link once                       agrees  exactly on every ISA
namespace ref {
int32_t label_bfs(bool wraps, Plane<const float> range_filled_m, ConstBitPlane nonground_repaired,
                  ConstBitPlane link_right, ConstBitPlane link_down, Plane<int32_t> labels, int32_t* queue) noexcept;
}

}  // namespace overtake
