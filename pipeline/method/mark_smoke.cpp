// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
#include "pipeline/method/mark_smoke.h"

#include <bit>

namespace overtake {

void mark_smoke(ConstBitPlane smoke, Plane<const int32_t> pixel_point, PointTable& points) noexcept {
  const auto mark = [&](int32_t i) {
    if (Reason(points.reason[i]) != Reason::kLabelled) return;
    points.label[i] = kLabelNone;
    points.reason[i] = uint8_t(Reason::kSmoke);
  };
  bool any = false;
  for (int32_t r = 0; r < smoke.rows; ++r)
    for (int32_t w = 0; w < smoke.words_per_row; ++w)
      for (uint64_t left = smoke.row(r)[w]; left != 0; left &= left - 1) {
        const int32_t point = pixel_point.row(r)[64 * w + std::countr_zero(left)];
        any = true;
        if (point != kNoPoint) mark(point);
      }
  if (!any) return;
  for (int32_t i = 0; i < points.count; ++i) {
    if (points.lost[i] == 0 || points.pixel[i] < 0) continue;
    if (smoke.test(points.pixel[i] / pixel_point.stride, points.pixel[i] % pixel_point.stride)) mark(i);
  }
}

}  // namespace overtake
