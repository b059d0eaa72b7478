// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// Section 7b: labels, after weak links are cut. Whether a cluster is cut depends on its runs alone
// (label_bfs_simd.hpp), so labels are written once, at the end.
#pragma once

#include "kernels/cut_links_run.h"
#include "kernels/label_bfs_simd.hpp"
#include "kernels/label_cut.h"

namespace overtake::simd {

// The ends of each run.
template <class A>
OVT_INLINE void measure_runs(Plane<const float> range_m, ConstBitPlane nonground, ConstBitPlane link_right,
                             LabelExtent* extents) {
  int32_t begun = 0;
  for (int32_t r = 0; r < range_m.rows; ++r) {
    const float* range = range_m.row(r);
    int32_t ended = begun;
    uint64_t carry = 0;
    for (int32_t w = 0; w < nonground.words_per_row; ++w) {
      const uint64_t bits = nonground.row(r)[w], links = link_right.row(r)[w] & bits;
      for (uint64_t starts = bits & ~(links << 1 | carry); starts != 0; starts &= starts - 1) {
        const int32_t c = 64 * w + lowest_bit(starts);
        extents[begun++] = {range[c], range[c], c, c, r, c};
      }
      // A run that goes on past the edge, where columns wrap, has no end here.
      for (uint64_t ends = bits & ~links; ends != 0; ends &= ends - 1) {
        const int32_t c = 64 * w + lowest_bit(ends);
        LabelExtent& run = extents[ended++];
        run.near_m = min_of(run.near_m, range[c]);
        run.far_m = max_of(run.far_m, range[c]);
        run.last_col = c;
      }
      carry = links >> 63;
    }
  }
}

// Turns parents into roots, and joins the ends of the runs of each root. Returns whether any cluster is to be cut.
OVT_INLINE bool join_extents(const CutLinksParams& params, int32_t run_count, int32_t* parent, LabelExtent* extents) {
  for (int32_t run = 0; run < run_count; ++run) {
    if (parent[run] == run) continue;
    const int32_t root = parent[run] = parent[parent[run]];
    const LabelExtent& own = extents[run];
    LabelExtent& all = extents[root];
    all.near_m = min_of(all.near_m, own.near_m);
    all.far_m = max_of(all.far_m, own.far_m);
    all.first_col = own.first_col < all.first_col ? own.first_col : all.first_col;
    all.last_col = own.last_col > all.last_col ? own.last_col : all.last_col;
  }
  bool any = false;
  for (int32_t run = 0; run < run_count; ++run) any |= parent[run] == run && is_long(params, extents[run]);
  return any;
}

template <class A>
int32_t label_cut(const CutLinksParams& params, bool wraps, Plane<const float> range_filled_m,
                  Plane<const float> range_repaired_m, Plane<const float> elevation_repaired_rad,
                  ConstBitPlane nonground_repaired, BitPlane link_right, BitPlane link_down, Plane<int32_t> labels,
                  int32_t* queue, LabelExtent* extents) noexcept {
  int32_t* parent = queue;
  int32_t run_count = find_runs<A>(wraps, nonground_repaired, link_right, link_down, parent);
  measure_runs<A>(range_repaired_m, nonground_repaired, link_right, extents);
  if (join_extents(params, run_count, parent, extents)) {
    int32_t cuts = 0;
    for (int32_t run = 0; run < run_count; ++run)
      if (is_long(params, extents[parent[run]]))
        cuts += cut_run(params, range_repaired_m, elevation_repaired_rad, extents[run].row, extents[run].col,
                        link_right, link_down);
    if (cuts > 0) run_count = find_runs<A>(wraps, nonground_repaired, link_right, link_down, parent);
  }
  const int32_t cluster_count = number_runs(run_count, parent);
  label_bfs_write<A>(range_filled_m, nonground_repaired, link_right, parent, run_count, labels);
  return cluster_count;
}

}  // namespace overtake::simd
