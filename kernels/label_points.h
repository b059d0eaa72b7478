// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// End of stage 7: every input point gets its pixel's label, or a reason for having none.
#pragma once

#include "core/point_table.h"
#include "core/range_image.h"

namespace overtake {

// Label of a pixel's winner: the pixel's label when |r - r_repaired| < own_limit_m, else ground (a repaired pixel whose
// own return is elsewhere). A point that lost its pixel takes the same label when its range is within loser_limit_m of
// the winner's; else it gets none: a nearer one is kDust, a farther one kSecondReturn.
//   reads    points range_m pixel lost label (as scatter_points leaves it: ground, or none without a pixel);
//            images range_filled_m range_repaired_m pixel_point labels
//   writes   points label; reason of those that lost their pixel (a winner's is kLabelled already)
//   cost     one pass over pixels, one store per cluster point     agrees  exactly on every ISA
struct LabelPointsParams {
  float own_limit_m, loser_limit_m;
};
namespace ref {
void label_points(const LabelPointsParams& params, const RangeImages& images, PointTable& points) noexcept;
}

}  // namespace overtake
