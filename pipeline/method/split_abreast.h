// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "core/cluster_table.h"
#include "core/plane.h"
#include "core/point_table.h"

namespace overtake {

struct SplitAbreastParams {
  float strip_m;            // width of the strip, at least; 0: nothing is split
  float length_m, width_m;  // of a car
  float pitch_rad;          // between two columns
};

// Two cars side by side, with less than a metre between them and seen at an angle, are one cluster: the near one hides
// where the far one ends. Splits near clusters that are no single car, whatever its heading, and that an empty strip
// divides into two parts each of which may be one: the part to the left of the strip gets a label of its own, the next
// after label_count, up to the number of pixels.
//   reads    clusters cluster_points; points pixel lost
//   writes   points label; labels, of pixels with a point of such a part (repaired pixels keep the cluster's label)
//   returns  the number of labels. If it is larger than label_count, the clusters are to be built anew
int32_t split_abreast(const SplitAbreastParams& params, const ClusterTable& clusters,
                      const ClusterPointTable& cluster_points, int32_t label_count, PointTable& points,
                      Plane<int32_t> labels) noexcept;

}  // namespace overtake
