// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "core/cluster_table.h"
#include "pipeline/params.h"

namespace overtake {

// Whether all points of a merged cluster are on the own car. A car that touches it has points beyond this box.
inline bool is_own_body(const CarGateParams& params, const FrameClusterTable& merged, int32_t row) noexcept {
  return merged.min_x_m[row] >= 0.0f - params.own_back_m && merged.max_x_m[row] <= params.own_front_m &&
         merged.min_y_m[row] >= 0.0f - params.own_side_m && merged.max_y_m[row] <= params.own_side_m;
}

}  // namespace overtake
