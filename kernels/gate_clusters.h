// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// Section 9 of kernels/README.md, first half: selects clusters by vehicle size. (The map gate needs the ego pose:
// pipeline/stages.)
#pragma once

#include "core/cluster_table.h"

namespace overtake {

// Keeps clusters of at least min_points whose longest extent (x, y or z of the bounds in the vehicle frame) is at most
// max_extent_m. Does not change the clusters: writes the rows that pass, in order.
//   reads    merged point_count min_* max_*     writes  kept[merged.count]      returns  how many
//   agrees   exactly on every ISA
struct GateClustersParams {
  int32_t min_points;
  float max_extent_m;
};
namespace ref {
int32_t gate_clusters(const GateClustersParams& params, const FrameClusterTable& merged, int32_t* kept) noexcept;
}

}  // namespace overtake
