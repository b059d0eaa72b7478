// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// End of stage 7: every input point gathers its pixel. The repaired range is asked for only where a vector holds a
// cluster's point.
#pragma once

#include "core/math.h"
#include "kernels/label_points.h"
#include "kernels/simd.h"

namespace overtake::simd {

template <class A>
void label_points(const LabelPointsParams& params, const RangeImages& images, PointTable& points) noexcept {
  const float *image_range = images.range_m.data, *repaired = images.range_repaired_m.data, *range_m = points.range_m;
  const int32_t *labels = images.labels.data, *pixels = points.pixel, count = points.count;
  int32_t* label_out = points.label;
  uint8_t* reason_out = points.reason;
  const Float<A> zero(0.0f), loser_limit(params.loser_limit_m), own_limit(params.own_limit_m);
  const auto is = [](Reason reason) __attribute__((always_inline)) { return Int<A>(int32_t(reason)); };
  for (int32_t i = 0; i < count; i += kSize<A>) {
    const Int<A> pixel = Int<A>::load(pixels + i);
    const Mask<A> has = (pixel > Int<A>(-1)) & Mask<A>::first(count - i);
    const Int<A> at = select(has, pixel, Int<A>(0));
    const Float<A> pixel_range = gather(image_range, at);
    Int<A> label = gather(labels, at);
    const Mask<A> cluster = has & (label > Int<A>(kLabelGround));
    if (cluster.any()) {
      // A repaired pixel says nothing about its own return, unless that lies where the repair is.
      const Mask<A> far = ~(abs_of(pixel_range - gather(repaired, at)) < own_limit);
      label = select(cluster & far, Int<A>(kLabelGround), label);
    }
    // Zero for the winner itself.
    const Float<A> behind = Float<A>::load(range_m + i) - pixel_range;
    const Mask<A> near = abs_of(behind) <= loser_limit;
    select(has & near, label, Int<A>(kLabelNone)).store(label_out + i);
    const Int<A> lost = select(behind < zero, is(Reason::kDust), is(Reason::kSecondReturn));
    const Int<A> reason = select(near, is(Reason::kLabelled), lost);
    store_bytes(select(has, reason, load_bytes<A>(reason_out + i)), reason_out + i);
  }
}

}  // namespace overtake::simd
