// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// End of stage 7: every input point gets its pixel's label, or says why not.
#pragma once

#include "core/point_table.h"
#include "core/range_image.h"

namespace overtake {

// The label a pixel gives: its own return takes the pixel's label when |r - r_repaired| < own_limit_m, else (a repaired
// ground pixel whose return is elsewhere) ground. A point that lost its pixel takes the same when its range is within
// loser_limit_m of the winner's; else none: nearer is kDust, farther kSecondReturn.
//   reads    points range_m pixel lost; images range_m range_repaired_m pixel_point labels
//   writes   points label; reason of those that lost their pixel (a winner's is kLabelled already)
//   cost     a pass over pixels, a store a cluster's point     agrees  exactly on every ISA
struct LabelPointsParams {
  float own_limit_m, loser_limit_m;
};
namespace ref {
void label_points(const LabelPointsParams& params, const RangeImages& images, PointTable& points) noexcept;
}

}  // namespace overtake
