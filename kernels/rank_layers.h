// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// Section 1 of kernels/README.md: assigns layers to image rows.
#pragma once

#include "kernels/project_points.h"

namespace overtake {

// Row = rank of the layer when the layers present are sorted by mean elevation of this scan, top first (ties: layer
// id). With more layers than rows, those with the fewest points are dropped (ties: the larger layer id).
//   reads    sums               writes   row_of_layer[kLayerIds], only at the touched ids: row, or -1 if dropped;
//                                        clears the touched sums for the next scan, touched_count stays
//   returns  rows in use        scratch  layer_order[kLayerIds]
//   agrees   exactly on every ISA
namespace ref {
int32_t rank_layers(int32_t rows, LayerSums& sums, int32_t* row_of_layer, int32_t* layer_order) noexcept;
}

}  // namespace overtake
