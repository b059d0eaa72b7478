// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// End of stage 7: every input point gets its pixel's label, or a reason for having none.
#include "kernels/label_points.h"

#include <cmath>

#include "core/check.h"

namespace overtake::ref {
namespace {

// A repaired pixel connects its neighbours. Its own return belongs to the cluster only if it lies where the repair is.
int32_t label_of_pixel(const LabelPointsParams& params, const RangeImages& images, int32_t pixel) {
  const int32_t label = images.labels.data[pixel];
  if (label <= kLabelGround) return label;
  const float off_m = std::fabs(images.range_filled_m.data[pixel] - images.range_repaired_m.data[pixel]);
  return off_m < params.own_limit_m ? label : kLabelGround;
}

}  // namespace

void label_points(const LabelPointsParams& params, const RangeImages& images, PointTable& points) noexcept {
  for (int32_t i = 0; i < points.count; ++i) {
    const int32_t pixel = points.pixel[i];
    if (pixel < 0) continue;  // project_points or scatter_points set its reason
    OVT_CHECK(images.pixel_point.data[pixel] != kNoPoint);

    const float behind_m = points.lost[i] ? points.range_m[i] - images.range_filled_m.data[pixel] : 0.0f;
    if (std::fabs(behind_m) <= params.loser_limit_m) {
      points.label[i] = label_of_pixel(params, images, pixel);
      points.reason[i] = uint8_t(Reason::kLabelled);
    } else {
      points.label[i] = kLabelNone;
      points.reason[i] = uint8_t(behind_m < 0.0f ? Reason::kDust : Reason::kSecondReturn);
    }
  }
}

}  // namespace overtake::ref
