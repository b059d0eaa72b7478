// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "core/cluster_table.h"
#include "core/plane.h"
#include "core/point_table.h"

namespace overtake {

struct SplitWallsParams {
  float inside_m;           // in front of the wall, at least; 0: nothing is split
  float length_m, width_m;  // of a car
  float top_m;              // of a car over the ground, at most
};

// A car that touches a wall, or stands less than a metre from it and not along it, is one cluster with the wall. Splits
// clusters longer than a car: what stands in front of the wall's line, and is neither longer nor higher than a car nor
// flatter than half of one, gets a label of its own, the next after label_count, up to the number of pixels. The line
// is a parabola through the means of the low points of every two metres; at least three fifths of them lie on it.
//   reads    clusters cluster_points; points pixel lost; height_m
//   writes   points label; labels, of pixels with a point of such an object (repaired pixels keep the cluster's label)
//   returns  the number of labels. If it is larger than label_count, the clusters are to be built anew
int32_t split_walls(const SplitWallsParams& params, const ClusterTable& clusters,
                    const ClusterPointTable& cluster_points, Plane<const float> height_m, int32_t label_count,
                    PointTable& points, Plane<int32_t> labels) noexcept;

}  // namespace overtake
