// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// Section 7b of kernels/README.md: connected components of the linked pixels, after weak links are cut.
#pragma once

#include "kernels/cut_links.h"

namespace overtake {

// Labels as label_bfs; then cuts weak links by these labels (cut_links); if it cut any, labels anew.
//   reads    nonground_repaired link_right link_down (links only between two non-ground pixels); range_filled_m
//            range_repaired_m elevation_repaired_rad
//   writes   labels, every pixel: kLabelNone, kLabelGround, 1, 2, ...; clears bits of cut links
//   returns  the number of clusters
//   scratch  queue[rows * cols] extents[rows * cols + 1]
//   cost     as label_bfs; where links are cut, the runs of these clusters once more (all if columns wrap)
//   agrees   exactly on every ISA
namespace ref {
int32_t label_cut(const CutLinksParams& params, bool wraps, Plane<const float> range_filled_m,
                  Plane<const float> range_repaired_m, Plane<const float> elevation_repaired_rad,
                  ConstBitPlane nonground_repaired, BitPlane link_right, BitPlane link_down, Plane<int32_t> labels,
                  int32_t* queue, LabelExtent* extents) noexcept;
}

}  // namespace overtake
