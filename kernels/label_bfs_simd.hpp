// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// Section 7: connected components from runs of linked pixels and union-find, on words of 64 columns.
//
//   nonground    # # # . # #      A run begins where a pixel has no link to its left. Runs are numbered by their first
//   link_right   # . . . # .      pixels, row by row. A link down joins the runs of its two pixels. The run of a pixel
//   run          0 0 1 . 2 2      follows from the number of runs that begin up to it: a count of bits.
//
// The root of a set is its lowest run, which holds the cluster's first pixel. So numbering the roots in order numbers
// the clusters as the reference does. A parent is never higher than its run, so one pass turns parents into labels.
#pragma once

#include "core/point_table.h"
#include "kernels/label_bfs.h"
#include "kernels/simd.h"

namespace overtake::simd {

// One row of the image as bits, read word by word from the left.
struct RunRow {
  const uint64_t *nonground, *right;
  int32_t runs = 0;    // runs that began before the current word
  uint64_t carry = 0;  // bit 0: the last pixel of the previous word has a link to its right
  uint64_t bits = 0, links = 0, starts = 0;

  OVT_INLINE RunRow(ConstBitPlane nonground_bits, ConstBitPlane link_right, int32_t r, int32_t first_run)
      : nonground(nonground_bits.row(r)), right(link_right.row(r)), runs(first_run) {}
  OVT_INLINE void read(int32_t w) {
    bits = nonground[w];
    links = right[w] & bits;
    starts = bits & ~((links << 1) | carry);
  }
  OVT_INLINE void leave() {
    carry = links >> 63;
    runs += count_bits(starts);
  }
  // Run of the pixel at bit b.
  OVT_INLINE int32_t run_at(int32_t b) const { return runs + count_bits(starts & (~uint64_t(0) >> (63 - b))) - 1; }
};

// Most runs are at most two steps below their root. The first two steps have no branch.
OVT_INLINE int32_t find_root(int32_t* parent, int32_t run) {
  run = parent[parent[run]];
  while (parent[run] != run) {
    parent[run] = parent[parent[run]];
    run = parent[run];
  }
  return run;
}

OVT_INLINE void join_runs(int32_t* parent, int32_t a, int32_t b) {
  const int32_t root_a = find_root(parent, a), root_b = find_root(parent, b);
  const int32_t low = root_a < root_b ? root_a : root_b, high = root_a < root_b ? root_b : root_a;
  parent[a] = parent[b] = low;
  parent[high] = low;
}

template <class A>
void label_bfs_write(Plane<const float> range_filled_m, ConstBitPlane nonground, ConstBitPlane link_right,
                     const int32_t* label_of_run, int32_t run_count, Plane<int32_t> labels) {
  const Float<A> zero(0.0f);
  const Int<A> ground(kLabelGround), none(kLabelNone);
  constexpr uint64_t kGroup = (uint64_t(1) << kSize<A>)-1;
  int32_t first_run = 0;
  for (int32_t r = 0; r < labels.rows; ++r) {
    RunRow row(nonground, link_right, r, first_run);
    for (int32_t w = 0; w < nonground.words_per_row; ++w) {
      row.read(w);
      const int32_t begin = 64 * w, end = begin + 64 < labels.cols ? begin + 64 : labels.cols;
      if (row.bits == 0) {
        for (int32_t c = begin; c < end; c += kSize<A>)
          select(Float<A>::load(range_filled_m.row(r) + c) > zero, ground, none).store(labels.row(r) + c);
        row.carry = 0;
        continue;
      }
      int32_t runs = row.runs;
      for (int32_t c = begin; c < end; c += kSize<A>) {
        const int32_t shift = c - begin;
        Int<A> label = select(Float<A>::load(range_filled_m.row(r) + c) > zero, ground, none);
        const uint32_t bits = uint32_t((row.bits >> shift) & kGroup), starts = uint32_t((row.starts >> shift) & kGroup);
        // The run of lane 0, if any, and the runs that begin in later lanes.
        const int32_t first = runs + int32_t(starts & 1) - 1;
        Int<A> table;
        if (first >= 0 && first + kSize<A> <= run_count) {
          table = Int<A>::load(label_of_run + first);
        } else {
          int32_t copy[kSize<A>];
          for (int32_t i = 0; i < kSize<A>; ++i)
            copy[i] = first + i >= 0 && first + i < run_count ? label_of_run[first + i] : kLabelNone;
          table = Int<A>::load(copy);
        }
        label = select(Mask<A>::from_bits(bits), permute(table, count_starts<A>(starts)), label);
        runs += count_bits(starts);
        label.store(labels.row(r) + c);
      }
      row.leave();
    }
    first_run = row.runs;
  }
}

// Writes the parent of each run: a run of its set that is not higher. Returns the number of runs.
template <class A>
OVT_INLINE int32_t find_runs(bool wraps, ConstBitPlane nonground_repaired, ConstBitPlane link_right,
                             ConstBitPlane link_down, int32_t* parent) {
  const int32_t rows = nonground_repaired.rows, cols = nonground_repaired.cols;
  const int32_t words_per_row = nonground_repaired.words_per_row;
  int32_t run_count = 0, first_above = 0;
  for (int32_t r = 0; r < rows; ++r) {
    const int32_t first_run = run_count;
    RunRow own(nonground_repaired, link_right, r, first_run);
    RunRow above(nonground_repaired, link_right, r > 0 ? r - 1 : r, first_above);
    const uint64_t* down = link_down.row(r > 0 ? r - 1 : r);
    uint64_t carry = 0;
    for (int32_t w = 0; w < words_per_row; ++w) {
      own.read(w);
      for (const int32_t end = own.runs + count_bits(own.starts); run_count < end; ++run_count)
        parent[run_count] = run_count;
      if (r > 0) {
        above.read(w);
        const uint64_t joined = down[w] & own.bits & above.bits;
        // A link is redundant when its neighbour joins the same two runs.
        const uint64_t same = joined & own.links & above.links;
        uint64_t fresh = joined & ~((same << 1) | carry);
        carry = same >> 63;
        for (; fresh != 0; fresh &= fresh - 1) {
          const int32_t b = lowest_bit(fresh);
          join_runs(parent, above.run_at(b), own.run_at(b));
        }
        above.leave();
      }
      own.leave();
    }
    if (wraps && cols > 1 && link_right.test(r, cols - 1) && nonground_repaired.test(r, cols - 1) &&
        nonground_repaired.test(r, 0))
      join_runs(parent, first_run, run_count - 1);
    first_above = first_run;
  }
  return run_count;
}

// Turns parents into labels. Returns the number of clusters.
OVT_INLINE int32_t number_runs(int32_t run_count, int32_t* parent) {
  int32_t cluster_count = 0;
  for (int32_t run = 0; run < run_count; ++run) {
    const int32_t above = parent[run], label_above = parent[above];
    const bool is_root = above == run;
    cluster_count += is_root;
    parent[run] = is_root ? cluster_count : label_above;
  }
  return cluster_count;
}

template <class A>
int32_t label_bfs(bool wraps, Plane<const float> range_filled_m, ConstBitPlane nonground_repaired,
                  ConstBitPlane link_right, ConstBitPlane link_down, Plane<int32_t> labels, int32_t* queue) noexcept {
  int32_t* parent = queue;
  const int32_t run_count = find_runs<A>(wraps, nonground_repaired, link_right, link_down, parent);
  const int32_t cluster_count = number_runs(run_count, parent);
  label_bfs_write<A>(range_filled_m, nonground_repaired, link_right, parent, run_count, labels);
  return cluster_count;
}

}  // namespace overtake::simd
