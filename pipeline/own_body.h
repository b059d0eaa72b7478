// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "core/cluster_table.h"
#include "pipeline/params.h"

namespace overtake {

// Whether all points of a cluster are on the own car: a row of a ClusterTable, or of a FrameClusterTable. A car that
// touches it has points beyond this box.
template <class Table>
bool is_own_body(const OwnBodyParams& own, const Table& clusters, int32_t row) noexcept {
  return clusters.min_x_m[row] >= 0.0f - own.back_m && clusters.max_x_m[row] <= own.front_m &&
         clusters.min_y_m[row] >= 0.0f - own.side_m && clusters.max_y_m[row] <= own.side_m;
}

}  // namespace overtake
