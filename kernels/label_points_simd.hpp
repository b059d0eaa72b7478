// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// End of stage 7: every input point gets its pixel's label. Most points are ground and hold their pixel; their labels
// are ground already. The first pass lists those that lost their pixel (a few percent), which are looked up in vectors:
// whether one of them is near its winner cannot be predicted, so no branch depends on it. A pass over the pixels then
// labels the points that hold a cluster's pixel. The range of a pixel with a point is that of the filled image, too,
// which the steps before have read.
#pragma once

#include "core/math.h"
#include "kernels/label_points.h"
#include "kernels/simd.h"

namespace overtake::simd {

// Labels and reasons of `count` points that lost their pixels. The list has room for whole vectors.
template <class A>
OVT_INLINE void label_losers(const LabelPointsParams& params, const RangeImages& images, PointTable& points,
                             int32_t* losers, int32_t count) {
  int32_t* const labels = points.label;  // local: the stores of bytes could change the table
  uint8_t* const reasons = points.reason;
  const Float<A> zero(0.0f), own_limit(params.own_limit_m), loser_limit(params.loser_limit_m);
  const Int<A> ground(kLabelGround), none(kLabelNone), labelled{int32_t(Reason::kLabelled)};
  const Int<A> dust{int32_t(Reason::kDust)}, second{int32_t(Reason::kSecondReturn)};
  for (int32_t k = 0; k < count; ++k) {  // of a scan in pieces these columns are in no near cache
    __builtin_prefetch(points.pixel + losers[k]);
    __builtin_prefetch(points.range_m + losers[k]);
  }
  for (int32_t k = count; k % kSize<A> != 0; ++k) losers[k] = losers[0];
  for (int32_t k = 0; k < count; k += kSize<A>) {
    const Int<A> index = Int<A>::load(losers + k), pixel = gather(points.pixel, index);
    const Float<A> winner_m = gather(images.range_filled_m.data, pixel);
    const Float<A> behind = gather(points.range_m, index) - winner_m;
    const Int<A> of_pixel = gather(images.labels.data, pixel);
    // The return of a repaired pixel belongs to the cluster only if it lies where the repair is.
    const Mask<A> here = abs_of(winner_m - gather(images.range_repaired_m.data, pixel)) < own_limit;
    const Mask<A> near = abs_of(behind) <= loser_limit;
    const Int<A> label = select((of_pixel > ground) & ~here, ground, of_pixel);
    int32_t label_of[kSize<A>], reason_of[kSize<A>];
    select(near, label, none).store(label_of);
    select(near, labelled, select(behind < zero, dust, second)).store(reason_of);
    for (int32_t l = 0; l < kSize<A>; ++l) {
      labels[losers[k + l]] = label_of[l];
      reasons[losers[k + l]] = uint8_t(reason_of[l]);
    }
  }
}

template <class A>
void label_points(const LabelPointsParams& params, const RangeImages& images, PointTable& points) noexcept {
  const int32_t count = points.count;
  int32_t* labels = points.label;
  const uint8_t* lost = points.lost;
  const Int<A> ground(kLabelGround);
  constexpr int32_t kBlock = 2048;
  for (int32_t begin = 0; begin < count; begin += kBlock) {
    int32_t losers[kBlock + kSize<A>], found = 0;
    const int32_t end = begin + kBlock < count ? begin + kBlock : count;
    for (int32_t i = begin; i < end; i += kSize<A>) {
      const Mask<A> loses = (load_bytes<A>(lost + i) > Int<A>(0)) & Mask<A>::first(end - i);
      store_packed(loses, Int<A>::count_from(i), losers + found);
      found += count_bits(loses.bits());
    }
    if (found > 0) label_losers<A>(params, images, points, losers, found);
  }

  // Buffers (point, label) pairs and stores them once per row: scattered stores run faster apart from the wide loads.
  constexpr int32_t kRoom = 1024;
  int32_t point[kRoom + kSize<A>], label[kRoom + kSize<A>];
  const Float<A> own_limit(params.own_limit_m);
  const auto tell = [&](int32_t held) OVT_INLINED {
    for (int32_t k = 0; k < held; ++k) {
      labels[point[k]] = label[k];
      keep_scalar();
    }
  };
  for (int32_t r = 0; r < images.labels.rows; ++r) {
    const int32_t *own_labels = images.labels.row(r), *winners = images.pixel_point.row(r);
    const float *own = images.range_filled_m.row(r), *repaired = images.range_repaired_m.row(r);
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
