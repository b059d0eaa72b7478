// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "core/cluster_table.h"
#include "core/point_table.h"
#include "pipeline/params.h"

namespace overtake {

// Removes the labels of the points of clusters that lie on the own car: their reason becomes kOwnBody. The clusters
// stay, without labelled points.   reads  clusters cluster_points    writes  points label reason
void mark_own_body(const OwnBodyParams& own, const ClusterTable& clusters, const ClusterPointTable& cluster_points,
                   PointTable& points) noexcept;

}  // namespace overtake
