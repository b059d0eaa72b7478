// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// Section 7b: labels, after weak links are cut. Whether a cluster is cut depends on its runs alone
// (label_bfs_simd.hpp), so labels are written once, at the end. Few clusters are cut: only their runs are joined anew.
#pragma once

#include "kernels/cut_links_run.h"
#include "kernels/label_bfs_simd.hpp"
#include "kernels/label_cut.h"

namespace overtake::simd {

// The ends of each run.
template <class A>
OVT_INLINE void measure_runs(bool wraps, Plane<const float> range_m, ConstBitPlane nonground, ConstBitPlane link_right,
                             LabelExtent* extents) {
  const auto turn = [&](LabelExtent& run) OVT_INLINED {
    const TurnedColumns turned = turn_columns(wraps, range_m.cols, run.first_col, run.last_col);
    run.first_turned = turned.first, run.last_turned = turned.last;
  };
  int32_t begun = 0;
  for (int32_t r = 0; r < range_m.rows; ++r) {
    const float* range = range_m.row(r);
    int32_t ended = begun;
    uint64_t carry = 0;
    for (int32_t w = 0; w < nonground.words_per_row; ++w) {
      const uint64_t bits = nonground.row(r)[w], links = link_right.row(r)[w] & bits;
      for (uint64_t starts = bits & ~(links << 1 | carry); starts != 0; starts &= starts - 1) {
        const int32_t c = 64 * w + lowest_bit(starts);
        extents[begun++] = {range[c], range[c], c, c, 0, 0, r, c};
      }
      // A run that goes on past the edge, where columns wrap, has no end here, but its columns end.
      for (uint64_t ends = bits & ~links; ends != 0; ends &= ends - 1) {
        const int32_t c = 64 * w + lowest_bit(ends);
        LabelExtent& run = extents[ended++];
        run.near_m = min_of(run.near_m, range[c]);
        run.far_m = max_of(run.far_m, range[c]);
        run.last_col = c;
        turn(run);
      }
      carry = links >> 63;
    }
    if (ended < begun) {
      extents[ended].last_col = range_m.cols - 1;
      turn(extents[ended]);
    }
  }
}

// near_m of the root's extents, where its cluster is to be cut: negative, as no range is, and tells why.
OVT_INLINE float mark_of(TwoCars cluster) { return -float(int32_t(cluster)); }
OVT_INLINE TwoCars cluster_of(float mark) { return TwoCars(int32_t(-mark)); }

// Turns parents into roots, and joins the ends of the runs of each root. Returns whether any cluster is to be cut: the
// extents of its root then have a mark.
OVT_INLINE bool join_extents(const CutLinksParams& params, int32_t run_count, int32_t* parent, LabelExtent* extents) {
  for (int32_t run = 0; run < run_count; ++run) {  // a root joins itself, which changes nothing
    const int32_t root = parent[run] = parent[parent[run]];
    const LabelExtent own = extents[run];
    LabelExtent& all = extents[root];
    all.near_m = min_of(all.near_m, own.near_m);
    all.far_m = max_of(all.far_m, own.far_m);
    all.first_col = own.first_col < all.first_col ? own.first_col : all.first_col;
    all.last_col = own.last_col > all.last_col ? own.last_col : all.last_col;
    all.first_turned = own.first_turned < all.first_turned ? own.first_turned : all.first_turned;
    all.last_turned = own.last_turned > all.last_turned ? own.last_turned : all.last_turned;
  }
  bool any = false;
  for (int32_t run = 0; run < run_count; ++run) {
    if (parent[run] != run) continue;
    const TwoCars cluster = may_be_two_cars(params, extents[run]);
    if (cluster == TwoCars::kNo) continue;
    extents[run].near_m = mark_of(cluster);
    any = true;
  }
  return any;
}

// Walks over splits, which are in the order of their pixels: a new run begins behind a column of a run.
struct SplitWalk {
  const LabelExtent* at;  // row: the run, col: the column
  int32_t count, passed = 0;
  OVT_INLINE int32_t pass(int32_t run, int32_t c) {  // splits before the pixel of a run
    while (passed < count && (at[passed].row < run || (at[passed].row == run && at[passed].col < c))) ++passed;
    return passed;
  }
};

// Parents after the cut: a new run has a number of its own, so the runs behind it count on. Runs of clusters that were
// cut begin anew and join along the links that are left; other runs keep their root. Returns the number of runs.
OVT_INLINE int32_t join_cut_runs(ConstBitPlane nonground, ConstBitPlane link_down, int32_t run_count,
                                 const LabelExtent* splits, int32_t split_count, int32_t* parent,
                                 LabelExtent* extents) {
  // last_col: the run's new number.
  SplitWalk before{splits, split_count};
  for (int32_t run = 0; run < run_count; ++run) extents[run].last_col = run + before.pass(run, -1);
  for (int32_t run = run_count - 1, end = run_count + split_count; run >= 0; --run) {
    const int32_t root = parent[run], number = extents[run].last_col;
    for (int32_t part = number + 1; part < end; ++part) parent[part] = part;
    end = number;
    parent[number] = extents[root].near_m < 0.0f ? number : extents[root].last_col;
    if (extents[root].near_m < 0.0f) extents[run].far_m = -1.0f;
  }
  // A link down joins two runs of one cluster. Pixels come in order, so those below them do, too.
  SplitWalk own{splits, split_count}, of_below{splits, split_count};
  int32_t below = 0;
  for (int32_t run = 0; run < run_count; ++run) {
    const int32_t r = extents[run].row;
    if (extents[run].far_m >= 0.0f || r + 1 == nonground.rows) continue;
    const int32_t last = run + 1 < run_count && extents[run + 1].row == r ? extents[run + 1].col : nonground.cols;
    for (int32_t c = extents[run].col; c < last && nonground.test(r, c); ++c) {
      if (!link_down.test(r, c) || !nonground.test(r + 1, c)) continue;
      while (below + 1 < run_count &&
             (extents[below + 1].row <= r || (extents[below + 1].row == r + 1 && extents[below + 1].col <= c)))
        ++below;
      join_runs(parent, run + own.pass(run, c), below + of_below.pass(below, c));
    }
  }
  return run_count + split_count;
}

// As cut_run, on words of 64 columns. Calls splits(column) for each link to the right of a column that it cuts.
template <class A, class F>
OVT_INLINE int32_t cut_words(const CutLinksParams& params, const CutSteps& steps, Plane<const float> range_m,
                             Plane<const float> elevation_rad, int32_t r, int32_t c, BitPlane right, BitPlane down,
                             F&& splits) {
  const Float<A> tan_threshold(params.tan_threshold), sin_pitch(params.sin_pitch), cos_pitch(params.cos_pitch);
  const Float<A> step_right(steps.right_m), step_down(steps.down_m), upright(kHalfPiF);
  constexpr uint64_t kGroup = (uint64_t(1) << kSize<A>)-1;
  const float* const own_m = range_m.row(r);
  int32_t cuts = 0;
  for (int32_t first = c & 63, w = c >> 6; w < right.words_per_row; ++w, first = 0) {
    // The run goes on behind a link.
    const uint64_t links = right.row(r)[w] >> first, run = ~links == 0 ? links : (links ^ (links + 1)) << first;
    const int32_t last_col = range_m.cols - 1 - 64 * w;  // its link leads to the first column: apart from the others
    if (last_col < 64 && (right.row(r)[w] & run) >> last_col != 0 &&
        is_weak_right(params, steps.right_m, range_m, r, range_m.cols - 1)) {
      right.row(r)[w] &= ~(uint64_t(1) << last_col);
      ++cuts;
    }
    const uint64_t of_right = right.row(r)[w] & run & (last_col < 64 ? ~(uint64_t(1) << last_col) : ~uint64_t(0));
    const uint64_t of_down = down.row(r)[w] & run;
    uint64_t weak_right = 0, weak_down = 0;
    for (int32_t shift = first & ~(kSize<A> - 1); shift < 64; shift += kSize<A>) {
      if ((((of_right | of_down) >> shift) & kGroup) == 0) continue;
      const int32_t at = 64 * w + shift;
      const Float<A> own = Float<A>::load(own_m + at);
      const Float<A> next = Float<A>::load(own_m + at + 1);
      const Mask<A> stays =
          pixels_join(own, next, sin_pitch, cos_pitch, tan_threshold) | (abs_of(own - next) < step_right);
      weak_right |= uint64_t((~stays).bits()) << shift;
      if (((of_down >> shift) & kGroup) == 0) continue;
      const Float<A> below = Float<A>::load(range_m.row(r + 1) + at);
      const Mask<A> is_step = ~(abs_of(own - below) < step_down);
      if (((of_down >> shift) & is_step.bits()) == 0) continue;
      const Float<A> alpha =
          abs_of(Float<A>::load(elevation_rad.row(r) + at) - Float<A>::load(elevation_rad.row(r + 1) + at));
      Float<A> sin_alpha, cos_alpha;
      sin_cos_small_of(min_of(alpha, upright), sin_alpha, cos_alpha);
      const Mask<A> joins_down = pixels_join(own, below, sin_alpha, cos_alpha, tan_threshold);
      weak_down |= uint64_t((is_step & ~joins_down).bits()) << shift;
    }
    weak_right &= of_right, weak_down &= of_down;
    right.row(r)[w] &= ~weak_right;
    down.row(r)[w] &= ~weak_down;
    cuts += count_bits(weak_right) + count_bits(weak_down);
    for (; weak_right != 0; weak_right &= weak_right - 1) splits(64 * w + lowest_bit(weak_right));
    if ((run & of_right) >> 63 == 0) break;
  }
  return cuts;
}

template <class A>
int32_t label_cut(const CutLinksParams& params, bool wraps, Plane<const float> range_filled_m,
                  Plane<const float> range_repaired_m, Plane<const float> elevation_repaired_rad,
                  ConstBitPlane nonground_repaired, BitPlane link_right, BitPlane link_down, Plane<int32_t> labels,
                  int32_t* queue, LabelExtent* extents) noexcept {
  int32_t* parent = queue;
  int32_t run_count = find_runs<A>(wraps, nonground_repaired, link_right, link_down, parent);
  measure_runs<A>(wraps, range_repaired_m, nonground_repaired, link_right, extents);
  if (join_extents(params, run_count, parent, extents)) {
    int32_t cuts = 0, split_count = 0;
    LabelExtent* const splits = extents + run_count;
    for (int32_t run = 0; run < run_count; ++run) {
      const float mark = extents[parent[run]].near_m;
      if (mark >= 0.0f) continue;
      const int32_t r = extents[run].row;
      const CutSteps steps = steps_of(params, cluster_of(mark));
      int32_t at = run;
      cuts += cut_words<A>(params, steps, range_repaired_m, elevation_repaired_rad, r, extents[run].col, link_right,
                           link_down, [&](int32_t c) OVT_INLINED {
                             if (!nonground_repaired.test(r, c) || !nonground_repaired.test(r, c + 1)) return;
                             while (at + 1 < run_count && extents[at + 1].row == r && extents[at + 1].col <= c) ++at;
                             splits[split_count++] = {0.0f, 0.0f, 0, 0, 0, 0, at, c};
                           });
    }
    if (cuts > 0)
      run_count = wraps ? find_runs<A>(wraps, nonground_repaired, link_right, link_down, parent)
                        : join_cut_runs(nonground_repaired, link_down, run_count, splits, split_count, parent, extents);
  }
  const int32_t cluster_count = number_runs(run_count, parent);
  label_bfs_write<A>(range_filled_m, nonground_repaired, link_right, parent, run_count, labels);
  return cluster_count;
}

}  // namespace overtake::simd
