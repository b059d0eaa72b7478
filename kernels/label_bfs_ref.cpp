// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// Section 7: connected components of the linked pixels, by breadth-first search (paper IV-A).
#include "kernels/label_bfs.h"

#include "core/check.h"
#include "core/point_table.h"

namespace overtake::ref {
namespace {
constexpr int32_t kUnvisited = -2;
}

int32_t label_bfs(bool wraps, Plane<const float> range_filled_m, ConstBitPlane nonground_repaired,
                  ConstBitPlane link_right, ConstBitPlane link_down, Plane<int32_t> labels, int32_t* queue) noexcept {
  const int32_t rows = labels.rows, cols = labels.cols;
  for (int32_t r = 0; r < rows; ++r)
    for (int32_t c = 0; c < cols; ++c)
      labels.row(r)[c] = nonground_repaired.test(r, c)     ? kUnvisited
                         : range_filled_m.row(r)[c] > 0.0f ? kLabelGround
                                                           : kLabelNone;

  int32_t cluster_count = 0;
  for (int32_t r0 = 0; r0 < rows; ++r0)
    for (int32_t c0 = 0; c0 < cols; ++c0) {
      if (labels.row(r0)[c0] != kUnvisited) continue;
      const int32_t label = ++cluster_count;
      int32_t head = 0, tail = 0;
      auto reach = [&](int32_t r, int32_t c) {
        if (labels.row(r)[c] != kUnvisited) return;
        labels.row(r)[c] = label;
        queue[tail++] = r * cols + c;
      };

      reach(r0, c0);
      while (head < tail) {
        const int32_t r = queue[head] / cols, c = queue[head] % cols;
        ++head;
        // The left or upper pixel of a pair holds the link. If columns wrap, the neighbour past the edge is the row's
        // other end.
        const int32_t left = c > 0 ? c - 1 : wraps ? cols - 1 : -1;
        const int32_t right = c + 1 < cols ? c + 1 : wraps ? 0 : -1;
        if (right >= 0 && link_right.test(r, c)) reach(r, right);
        if (left >= 0 && link_right.test(r, left)) reach(r, left);
        if (r + 1 < rows && link_down.test(r, c)) reach(r + 1, c);
        if (r > 0 && link_down.test(r - 1, c)) reach(r - 1, c);
      }
    }
  return cluster_count;
}

}  // namespace overtake::ref
