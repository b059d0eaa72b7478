// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// Section 7b: labels, after weak links are cut.
#include "kernels/label_cut.h"

#include "kernels/label_bfs.h"

namespace overtake::ref {

int32_t label_cut(const CutLinksParams& params, bool wraps, Plane<const float> range_filled_m,
                  Plane<const float> range_repaired_m, Plane<const float> elevation_repaired_rad,
                  ConstBitPlane nonground_repaired, BitPlane link_right, BitPlane link_down, Plane<int32_t> labels,
                  int32_t* queue, LabelExtent* extents) noexcept {
  const auto label = [&] {
    return label_bfs(wraps, range_filled_m, nonground_repaired, link_right, link_down, labels, queue);
  };
  const int32_t label_count = label();
  const int32_t cuts = cut_links(params, wraps, range_repaired_m, elevation_repaired_rad, nonground_repaired, labels,
                                 label_count, link_right, link_down, extents);
  return cuts > 0 ? label() : label_count;
}

}  // namespace overtake::ref
