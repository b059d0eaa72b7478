// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// End of stage 7: every input point gets its pixel's label. Most points are ground and hold their pixel, so the first
// pass labels all as ground, except those that lost their pixel (a few percent), which are looked up one by one. A pass
// over the pixels then labels the points that hold a cluster's pixel.
#pragma once

#include "core/math.h"
#include "kernels/label_points.h"
#include "kernels/simd.h"

namespace overtake::simd {

// The return of a repaired pixel belongs to the cluster only if it lies where the repair is.
OVT_INLINE int32_t label_of_pixel(const RangeImages& images, float own_limit_m, int32_t pixel) {
  const int32_t label = images.labels.data[pixel];
  const bool here = abs_of(images.range_m.data[pixel] - images.range_repaired_m.data[pixel]) < own_limit_m;
  return label > kLabelGround && !here ? kLabelGround : label;
}

template <class A>
void label_points(const LabelPointsParams& params, const RangeImages& images, PointTable& points) noexcept {
  const int32_t *pixels = points.pixel, count = points.count;
  const float *range_m = points.range_m, *image_range = images.range_m.data;
  int32_t* labels = points.label;
  uint8_t* reasons = points.reason;
  const uint8_t* lost = points.lost;
  const Int<A> ground(kLabelGround), none(kLabelNone);
  for (int32_t i = 0; i < count; i += kSize<A>) {
    select(Int<A>::load(pixels + i) > Int<A>(-1), ground, none).store(labels + i);
    const Mask<A> losers = (load_bytes<A>(lost + i) > Int<A>(0)) & Mask<A>::first(count - i);
    for (uint32_t bits = losers.bits(); bits != 0; bits &= bits - 1) {
      const int32_t l = i + lowest_bit(bits), pixel = pixels[l];
      const float behind = range_m[l] - image_range[pixel];
      const bool near = abs_of(behind) <= params.loser_limit_m;
      labels[l] = near ? label_of_pixel(images, params.own_limit_m, pixel) : kLabelNone;
      reasons[l] = uint8_t(near ? Reason::kLabelled : behind < 0.0f ? Reason::kDust : Reason::kSecondReturn);
    }
  }

  // Buffers (point, label) pairs and stores them once per row: scattered stores run faster apart from the wide loads.
  constexpr int32_t kRoom = 1024;
  int32_t point[kRoom + kSize<A>], label[kRoom + kSize<A>];
  const Float<A> own_limit(params.own_limit_m);
  const auto tell = [&](int32_t held) OVT_INLINED {
    for (int32_t k = 0; k < held; ++k) labels[point[k]] = label[k];
  };
  for (int32_t r = 0; r < images.labels.rows; ++r) {
    const int32_t *own_labels = images.labels.row(r), *winners = images.pixel_point.row(r);
    const float *own = images.range_m.row(r), *repaired = images.range_repaired_m.row(r);
    int32_t held = 0;
    for (int32_t c = 0; c < images.labels.cols; c += kSize<A>) {
      const Int<A> own_label = Int<A>::load(own_labels + c);
      const Mask<A> cluster = (own_label > ground) & Mask<A>::first(images.labels.cols - c);
      if (!cluster.any()) continue;
      const Int<A> winner = Int<A>::load(winners + c);
      const Mask<A> here = abs_of(Float<A>::load(own + c) - Float<A>::load(repaired + c)) < own_limit;
      const Mask<A> told = cluster & here & (winner > Int<A>(kNoPoint));
      store_packed(told, winner, point + held);
      store_packed(told, own_label, label + held);
      held += count_bits(told.bits());
      if (held < kRoom) continue;
      tell(held);
      held = 0;
    }
    tell(held);
  }
}

}  // namespace overtake::simd
