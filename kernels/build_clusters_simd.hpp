// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// Clusters from labels.
//   1  Packs the points of clusters: most of a scan is ground.
//   2  Handles groups of equal labels within a vector: with a counter per point, each point would wait for the last.
//   3  Transforms the points of a cluster to the vehicle frame and sums them up in one pass, in the order of
//      core/reduce.h. Clusters of a few points (two in three): the points across the clusters' borders, then the sums
//      as scalars.
#pragma once

#include <limits>

#include "core/math.h"
#include "core/plane.h"
#include "core/reduce.h"
#include "kernels/build_clusters.h"
#include "kernels/near_rows.h"
#include "kernels/simd.h"
#include "kernels/transform_point.h"

namespace overtake::simd {

// Packs the points of clusters, in input order: their rows and labels go to two columns with room for all points (a
// whole number of vectors). Returns the number of packed points.
template <class A>
OVT_INLINE int32_t pack_points(const int32_t* labels, int32_t count, int32_t* index, int32_t* label) {
  int32_t held = 0;
  for (int32_t i = 0; i < count; i += kSize<A>) {
    const Int<A> own = Int<A>::load(labels + i);
    const Mask<A> in = (own > Int<A>(kLabelGround)) & Mask<A>::first(count - i);
    const uint32_t bits = in.bits();
    if (bits == 0) continue;
    store_packed(in, Int<A>::count_from(i), index + held);
    store_packed(in, own, label + held);
    held += count_bits(bits);
  }
  return held;
}

// Calls f(first, count) for each whole vector of the packed points, and at last for the rest.
template <class A, class F>
OVT_INLINE void for_each_packed(int32_t held, F&& f) {
  int32_t k = 0;
  for (; k + kSize<A> <= held; k += kSize<A>) f(k, kSize<A>);
  if (k < held) f(k, held - k);
}

// Calls f(label, mask) for each label among the first `count` lanes. ISAs with short vectors go point by point.
template <class A, class F>
OVT_INLINE void for_each_label(const int32_t* label, int32_t count, F&& f) {
  const Int<A> all = Int<A>::load(label);
  for (uint32_t rest = Mask<A>::first(count).bits(); rest != 0;) {
    const int32_t own = label[lowest_bit(rest)];
    const uint32_t same = (all == Int<A>(own)).bits() & rest;
    f(own, same);
    rest &= ~same;
  }
}

// Bounds and sum of up to four values, with the result that the sixteen lanes would give.
struct FewValues {
  static constexpr int32_t kMost = 4;
  float v[kMost];

  OVT_INLINE FewValues(const float* values, int32_t count, float rest) {
    for (int32_t k = 0; k < 4; ++k) v[k] = k < count ? values[k < count ? k : 0] : rest;
  }
  OVT_INLINE float sum() const { return ((0.0f + v[0]) + (0.0f + v[2])) + ((0.0f + v[1]) + (0.0f + v[3])); }
  OVT_INLINE float low() const { return min_of(min_of(v[0], v[2]), min_of(v[1], v[3])); }
  OVT_INLINE float high() const { return max_of(max_of(v[0], v[2]), max_of(v[1], v[3])); }
};

// Bounds and sum of one axis, in the lanes of core/reduce.h.
template <class A>
struct LaneBounds {
  static constexpr int32_t kGroups = kLanes / kSize<A>;
  static constexpr float kInfinity = std::numeric_limits<float>::infinity();
  Float<A> low[kGroups], high[kGroups], sum[kGroups];

  OVT_INLINE LaneBounds() {
    for (int32_t g = 0; g < kGroups; ++g)
      low[g] = Float<A>(kInfinity), high[g] = Float<A>(-kInfinity), sum[g] = Float<A>(0.0f);
  }
  OVT_INLINE void add(int32_t g, Float<A> value) {
    low[g] = min_of(low[g], value);
    high[g] = max_of(high[g], value);
    sum[g] = sum[g] + value;
  }
  OVT_INLINE void add(int32_t g, Float<A> value, Mask<A> in) {
    low[g] = select(in, min_of(low[g], value), low[g]);
    high[g] = select(in, max_of(high[g], value), high[g]);
    sum[g] = add_where(in, sum[g], value);
  }
};

// Transforms the points of `count` rows of the table from `place` on, at most a vector of them, and stores them there.
// The vector may write over the rows behind, which are transformed later. Returns the points' rows in the scan;
// `at`: x, y, z.
template <class A>
OVT_INLINE NearRows<A> transform_rows(const Transform& T, const ScanTable& scan, ClusterPointTable& table,
                                      int32_t place, int32_t count, Float<A>* at) {
  const NearRows<A> from(table.point + place, Mask<A>::first(count), scan.capacity);
  transform_point(T, from.get(scan.x_m), from.get(scan.y_m), from.get(scan.z_m), at[0], at[1], at[2]);
  at[0].store(table.x_m + place);
  at[1].store(table.y_m + place);
  at[2].store(table.z_m + place);
  return from;
}

// Transforms the points of a cluster and sums them up, in one pass. The sum of the time offsets has two halves of 16
// bits so that a lane can hold them.
template <class A>
OVT_INLINE void sum_up_cluster(const Transform& T, const ScanTable& scan, const float* range_m,
                               ClusterPointTable& table, ClusterTable& clusters, int32_t row) {
  constexpr int32_t kMostVectors = 16384;
  const int32_t begin = clusters.point_begin[row], count = clusters.point_count[row];
  LaneBounds<A> bounds[3];
  Float<A> nearest(std::numeric_limits<float>::infinity());
  Int<A> time_low(0), time_high(0);
  int64_t offset = 0;
  int32_t vectors = 0;
  const auto add_times = [&] {
    int32_t lows[kSize<A>], highs[kSize<A>];
    time_low.store(lows);
    time_high.store(highs);
    for (int32_t l = 0; l < kSize<A>; ++l) offset += int64_t(lows[l]) + int64_t(highs[l]) * 65536;
    time_low = time_high = Int<A>(0);
    vectors = 0;
  };
  for (int32_t k = 0; k < count; k += kLanes)
    for (int32_t g = 0; g < LaneBounds<A>::kGroups; ++g) {
      const int32_t at = k + g * kSize<A>;
      if (at >= count) break;
      const bool is_whole = at + kSize<A> <= count;
      const int32_t held = is_whole ? kSize<A> : count - at;
      Float<A> axis[3];
      const NearRows<A> from = transform_rows<A>(T, scan, table, begin + at, held, axis);
      Int<A> time = from.get(scan.time_offset_ns);
      Float<A> range = from.get(range_m);
      if (is_whole) {
        for (int32_t a = 0; a < 3; ++a) bounds[a].add(g, axis[a]);
      } else {
        const Mask<A> in = Mask<A>::first(held);
        for (int32_t a = 0; a < 3; ++a) bounds[a].add(g, axis[a], in);
        time = select(in, time, Int<A>(0));
        range = select(in, range, nearest);
      }
      nearest = min_of(nearest, range);
      time_low = time_low + (time & Int<A>(0xffff));
      time_high = time_high + (time >> 16);
      if (++vectors == kMostVectors) add_times();
    }
  add_times();
  float* out_min[3] = {clusters.min_x_m, clusters.min_y_m, clusters.min_z_m};
  float* out_max[3] = {clusters.max_x_m, clusters.max_y_m, clusters.max_z_m};
  float* out_sum[3] = {clusters.sum_x_m, clusters.sum_y_m, clusters.sum_z_m};
  for (int32_t a = 0; a < 3; ++a) {
    out_min[a][row] = lane_min(bounds[a].low);
    out_max[a][row] = lane_max(bounds[a].high);
    out_sum[a][row] = lane_sum(bounds[a].sum);
  }
  clusters.sum_offset_ns[row] = offset;
  clusters.nearest_m[row] = any_lane_min(nearest);
}

// Sums up a cluster of at most FewValues::kMost points.
OVT_INLINE void sum_up_few(const ScanTable& scan, const float* range_m, const ClusterPointTable& from,
                           ClusterTable& clusters, int32_t row) {
  constexpr float kInfinity = std::numeric_limits<float>::infinity();
  const int32_t begin = clusters.point_begin[row], count = clusters.point_count[row];
  const float* axis[3] = {from.x_m + begin, from.y_m + begin, from.z_m + begin};
  float* out_min[3] = {clusters.min_x_m, clusters.min_y_m, clusters.min_z_m};
  float* out_max[3] = {clusters.max_x_m, clusters.max_y_m, clusters.max_z_m};
  float* out_sum[3] = {clusters.sum_x_m, clusters.sum_y_m, clusters.sum_z_m};
  for (int32_t a = 0; a < 3; ++a) {
    out_min[a][row] = FewValues(axis[a], count, kInfinity).low();
    out_max[a][row] = FewValues(axis[a], count, -kInfinity).high();
    out_sum[a][row] = FewValues(axis[a], count, 0.0f).sum();
  }
  int64_t offset = 0;
  float nearest = kInfinity;
  for (int32_t k = 0; k < count; ++k) {
    const int32_t i = from.point[begin + k];
    offset += scan.time_offset_ns[i];
    nearest = min_of(nearest, range_m[i]);
  }
  clusters.sum_offset_ns[row] = offset;
  clusters.nearest_m[row] = nearest;
}

template <class A>
int32_t build_clusters(const Transform& T_vehicle_sensor, const ScanTable& scan, const PointTable& points,
                       int32_t label_count, ClusterTable& clusters, ClusterPointTable& cluster_points,
                       int32_t* row_of_label, int32_t* cursor, int32_t* order) noexcept {
  for (int32_t label = 0; label <= label_count; ++label) cursor[label] = 0;
  // Temporary columns, in output columns that are written last.
  int32_t* packed_index = reinterpret_cast<int32_t*>(cluster_points.x_m);
  int32_t* packed_label = reinterpret_cast<int32_t*>(cluster_points.y_m);
  // The groups of equal labels of each vector, as lanes; the last group of a vector has kLastGroup. So the sort below
  // need not find them again, in a loop whose number of rounds cannot be predicted.
  constexpr int32_t kLastGroup = 1 << 30;
  int32_t* groups = reinterpret_cast<int32_t*>(cluster_points.z_m);
  int32_t group_count = 0;
  const int32_t held = pack_points<A>(points.label, scan.count, packed_index, packed_label);
  for_each_packed<A>(held, [&](int32_t first, int32_t n) OVT_INLINED {
    const int32_t* label = packed_label + first;
    if constexpr (kSize<A> == 4) {
      for (int32_t k = 0; k < n; ++k) ++cursor[label[k]];
    } else {
      for_each_label<A>(label, n, [&](int32_t own, uint32_t same) OVT_INLINED {
        cursor[own] += count_bits(same);
        groups[group_count++] = int32_t(same);
      });
      groups[group_count - 1] |= kLastGroup;
    }
  });
  int32_t found = 0;
  for (int32_t label = 1; label <= label_count; ++label) found += cursor[label] > 0;
  const bool all_fit = found <= clusters.capacity;
  if (!all_fit) {
    // Keeps the nearest. Until the rows are known, row_of_label holds the ranges' bits, which sort like the ranges.
    for (int32_t label = 0; label <= label_count; ++label) row_of_label[label] = std::numeric_limits<int32_t>::max();
    for (int32_t k = 0; k < held; ++k) {
      int32_t bits;
      __builtin_memcpy(&bits, points.range_m + packed_index[k], sizeof bits);
      int32_t& least = row_of_label[packed_label[k]];
      least = bits < least ? bits : least;
    }
  }
  ref::choose_labels(label_count, clusters.capacity, cursor, row_of_label, order);

  // From here on, cursor[label] is the place of the label's next point.
  clusters.count = all_fit ? found : clusters.capacity;
  for (int32_t label = 0; label <= label_count; ++label) row_of_label[label] = -1;
  int32_t begin = 0;
  for (int32_t row = 0; row < clusters.count; ++row) {
    const int32_t label = order[row], count = cursor[label];
    row_of_label[label] = row;
    clusters.label[row] = label;
    clusters.point_begin[row] = begin;
    clusters.point_count[row] = count;
    cursor[label] = begin;
    begin += count;
  }
  cluster_points.count = begin;
  OVT_CHECK(begin + kRowAlign <= cluster_points.capacity);

  int32_t* point_out = cluster_points.point;
  if constexpr (kSize<A> == 4) {
    for (int32_t k = 0; k < held; ++k)
      if (all_fit || row_of_label[packed_label[k]] >= 0) point_out[cursor[packed_label[k]]++] = packed_index[k];
  } else {
    for (int32_t g = 0, first = 0; g < group_count; ++g) {
      const uint32_t same = uint32_t(groups[g] & ~kLastGroup);
      const int32_t own = packed_label[first + lowest_bit(same)], *index = packed_index + first;
      first += groups[g] & kLastGroup ? kSize<A> : 0;
      if (!all_fit && row_of_label[own] < 0) continue;
      int32_t packed[kSize<A>];
      store_packed(Mask<A>::from_bits(same), Int<A>::load(index), packed);
      const int32_t count = count_bits(same);
      store_where(Mask<A>::first(count), Int<A>::load(packed), point_out + cursor[own]);
      cursor[own] += count;
    }
  }

  // Local copies: the compiler sees that no store changes them.
  const Transform T = T_vehicle_sensor;
  ScanTable from = scan;
  from.capacity = points.capacity < scan.capacity ? points.capacity : scan.capacity;  // NearRows reads columns of both
  ClusterPointTable to = cluster_points;
  const float* const range_m = points.range_m;
  for (int32_t row = 0; row < clusters.count;) {
    if (clusters.point_count[row] > FewValues::kMost) {
      sum_up_cluster<A>(T, from, range_m, to, clusters, row++);
      continue;
    }
    int32_t last = row;  // the small clusters that follow each other: first their points, across their borders
    while (last < clusters.count && clusters.point_count[last] <= FewValues::kMost) ++last;
    const int32_t end = clusters.point_begin[last - 1] + clusters.point_count[last - 1];
    for (int32_t k = clusters.point_begin[row]; k < end; k += kSize<A>) {
      Float<A> at[3];
      transform_rows<A>(T, from, to, k, end - k < kSize<A> ? end - k : kSize<A>, at);
    }
    for (; row < last; ++row) sum_up_few(from, range_m, to, clusters, row);
  }
  return found - clusters.count;
}

}  // namespace overtake::simd
