// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// Section 7a: cuts links between an object and what stands behind it.
//
//          ___ r          One row passes over the car and hits the house behind it, the next one hits the roof. Rows
//      car    |           are up to some degrees apart, so the angle beta of the pair may exceed th_seg although the
//    r + 1 \  | house     step is several metres: a parked car, a tree and a house are one cluster.
//    r + 2 |  |
#include "kernels/cut_steps.h"

#include <algorithm>
#include <cmath>

namespace overtake::ref {

void cut_steps(Plane<const float> range_filled_m, Plane<const float> range_repaired_m, const float* bound_per_m,
               const float* last_bound_per_m, BitPlane link_down) noexcept {
  for (int32_t r = 0; r + 1 < range_repaired_m.rows; ++r)
    for (int32_t c = 0; c < range_repaired_m.cols; ++c) {
      if (!link_down.test(r, c)) continue;
      const float far_m = range_repaired_m.row(r)[c], near_m = range_repaired_m.row(r + 1)[c], step_m = far_m - near_m;
      if (!(step_m > std::max(kCutStep_m, kCutBoundShare * near_m))) continue;
      const float under_m = r + 2 < range_filled_m.rows ? range_filled_m.row(r + 2)[c] : 0.0f;
      const bool is_top =
          step_m > kCutStepShare * near_m && under_m > 0.0f && std::fabs(near_m - under_m) < kCutStepBelow * step_m;
      const float weight = (float(c % kRayColumns) + 0.5f) * (1.0f / kRayColumns);
      const auto is_across = [&](const float* of_rays) {
        const float* const ray = of_rays + c / kRayColumns;
        const float per_m = ray[0] + weight * (ray[1] - ray[0]);
        return near_m * per_m < 1.0f + kBoundSlack && far_m * per_m > 1.0f - kBoundSlack;
      };
      if (is_top || is_across(bound_per_m) || is_across(last_bound_per_m))
        link_down.row(r)[c >> 6] &= ~(uint64_t(1) << (c & 63));
    }
}

}  // namespace overtake::ref
