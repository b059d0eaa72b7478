// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
#include "pipeline/method/mark_own_body.h"

#include "pipeline/own_body.h"

namespace overtake {

void mark_own_body(const OwnBodyParams& own, const ClusterTable& clusters, const ClusterPointTable& cluster_points,
                   PointTable& points) noexcept {
  for (int32_t row = 0; row < clusters.count; ++row) {
    if (!is_own_body(own, clusters, row)) continue;
    const int32_t begin = clusters.point_begin[row], end = begin + clusters.point_count[row];
    for (int32_t k = begin; k < end; ++k) {
      const int32_t point = cluster_points.point[k];
      points.label[point] = kLabelNone;
      points.reason[point] = uint8_t(Reason::kOwnBody);
    }
  }
}

}  // namespace overtake
