// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// Section 1: assigns points to pixels, and selects the winner of each pixel.
#include "kernels/scatter_points.h"

#include "core/check.h"

namespace overtake::ref {

void scatter_points(const ScanTable& scan, const int32_t* row_of_layer, PointTable& points,
                    RangeImages& images) noexcept {
  const Plane<int32_t> winner = images.pixel_point;
  for (int32_t r = 0; r < winner.rows; ++r)
    for (int32_t c = 0; c < winner.cols; ++c) {
      images.range_m.row(r)[c] = kNoReturn;
      images.elevation_rad.row(r)[c] = 0.0f;
      winner.row(r)[c] = kNoPoint;
    }

  for (int32_t i = 0; i < points.count; ++i) {
    points.pixel[i] = -1;
    points.label[i] = kLabelNone;
    points.lost[i] = 0;
    if (Reason(points.reason[i]) != Reason::kLabelled) continue;
    const int32_t row = row_of_layer[scan.layer[i]];
    if (row < 0) {
      points.reason[i] = uint8_t(Reason::kLayerDropped);
      continue;
    }
    OVT_CHECK(row < winner.rows && points.column[i] >= 0 && points.column[i] < winner.cols);
    const int32_t pixel = row * winner.stride + points.column[i];
    points.pixel[i] = pixel;
    points.label[i] = kLabelGround;

    // The brightest point is the least likely dust. Ties: the nearest, then the first in input order.
    const int32_t old = winner.data[pixel];
    const bool wins = old == kNoPoint || scan.intensity[i] > scan.intensity[old] ||
                      (scan.intensity[i] == scan.intensity[old] && points.range_m[i] < points.range_m[old]);
    if (old != kNoPoint) points.lost[wins ? old : i] = 1;
    if (!wins) continue;
    winner.data[pixel] = i;
    images.range_m.data[pixel] = points.range_m[i];
    images.elevation_rad.data[pixel] = points.elevation_rad[i];
  }
}

}  // namespace overtake::ref
