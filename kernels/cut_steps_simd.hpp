// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// Section 7a: cuts links between an object and what stands behind it, on words of 64 columns. Most groups have no step:
// they read two rows.
#pragma once

#include "core/math.h"
#include "kernels/cut_steps.h"
#include "kernels/simd.h"

namespace overtake::simd {

template <class A>
void cut_steps(Plane<const float> range_filled_m, Plane<const float> range_repaired_m, const float* bound_per_m,
               const float* last_bound_per_m, BitPlane link_down) noexcept {
  constexpr uint64_t kGroup = (uint64_t(1) << kSize<A>)-1;
  static_assert(kRayColumns % kSize<A> == 0);
  const Float<A> least(kCutStep_m), share(kCutStepShare), bound_share(kCutBoundShare), below(kCutStepBelow), none(0.0f),
      half(0.5f);
  const Float<A> before(1.0f - kBoundSlack), behind(1.0f + kBoundSlack);
  const Float<A> of_ray(1.0f / kRayColumns);
  for (int32_t r = 0; r + 1 < range_repaired_m.rows; ++r) {
    const float *own_m = range_repaired_m.row(r), *lower_m = range_repaired_m.row(r + 1);
    const float* next_m = r + 2 < range_filled_m.rows ? range_filled_m.row(r + 2) : nullptr;
    uint64_t* const down = link_down.row(r);
    for (int32_t w = 0; w < link_down.words_per_row; ++w) {
      const uint64_t links = down[w];
      uint64_t cuts = 0;
      if (links == 0) continue;
      for (int32_t shift = 0; shift < 64; shift += kSize<A>) {
        const uint64_t group = (links >> shift) & kGroup;
        if (group == 0) continue;
        const int32_t c = 64 * w + shift;
        const Float<A> far_m = Float<A>::load(own_m + c), near_m = Float<A>::load(lower_m + c);
        const Float<A> step_m = far_m - near_m;
        const Mask<A> is_step = step_m > max_of(least, bound_share * near_m);
        if ((is_step.bits() & group) == 0) continue;
        const Float<A> under_m = next_m ? Float<A>::load(next_m + c) : none;
        const Mask<A> is_top =
            (step_m > share * near_m) & (under_m > none) & (abs_of(near_m - under_m) < below * step_m);
        const Float<A> weight = (to_float(Int<A>::count_from(c % kRayColumns)) + half) * of_ray;
        const auto is_across = [&](const float* of_rays) {
          const float* const ray = of_rays + c / kRayColumns;
          const Float<A> per_m = Float<A>(ray[0]) + weight * Float<A>(ray[1] - ray[0]);
          return (near_m * per_m < behind) & (far_m * per_m > before);
        };
        const Mask<A> is_cut = is_top | is_across(bound_per_m) | is_across(last_bound_per_m);
        cuts |= uint64_t((is_step & is_cut).bits()) << shift;
      }
      down[w] = links & ~cuts;
    }
  }
}

}  // namespace overtake::simd
