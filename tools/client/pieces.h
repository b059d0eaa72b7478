// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// A part of a scan's points, for ovt_push_points.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>

#include "pipeline/overtake.h"

namespace overtake::cli {

// Points [first, last) of a scan, with their index.
inline ovt_points piece_of(const ovt_points& scan, int32_t first, int32_t last) {
  ovt_points piece = scan;
  piece.first = first;
  piece.count = last - first;
  for (ovt_column* column : {&piece.x, &piece.y, &piece.z, &piece.layer, &piece.intensity, &piece.time}) {
    if (column->type == OVT_NONE) continue;
    const std::size_t skipped = std::min(std::size_t(first) * column->stride, column->size_bytes);
    column->data = static_cast<const char*>(column->data) + skipped;
    column->size_bytes -= skipped;
  }
  return piece;
}

}  // namespace overtake::cli
