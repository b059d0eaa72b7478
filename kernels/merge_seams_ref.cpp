// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// Merging across sensors: list the members, join them over the seams, number the results, copy, sum up. Almost all
// clusters touch no seam; these are copied column by column, in runs of neighbours. Only joined clusters are copied
// member by member.
#include <algorithm>
#include <bit>
#include <cstring>
#include <limits>

#include "core/math.h"
#include "kernels/merge_seams.h"
#include "kernels/transform_point.h"

namespace overtake {
namespace {

__extension__ typedef __int128 Int128;

// The root of a set is its smallest member.
int32_t find_root(int32_t* parent, int32_t m) {
  while (parent[m] != m) m = parent[m] = parent[parent[m]];
  return m;
}

void join(int32_t* parent, int32_t a, int32_t b) {
  a = find_root(parent, a);
  b = find_root(parent, b);
  parent[std::max(a, b)] = std::min(a, b);
}

bool is_joined(int32_t* parent, int32_t a, int32_t b) { return find_root(parent, a) == find_root(parent, b); }

// Lists one member per cluster, sensor by sensor. member_begin[s]: the member of sensor s's cluster 0; the last entry
// is the count.
void list_members(const SeamSide* sides, int32_t sensor_count, MemberTable& members, int32_t* parent,
                  int32_t* member_begin) {
  int32_t begin = 0;
  for (int32_t s = 0; s < sensor_count; ++s) {
    member_begin[s] = begin;
    const int32_t clusters = sides[s].present ? sides[s].clusters->count : 0;
    OVT_CHECK(begin + clusters <= members.capacity);
    for (int32_t c = 0; c < clusters; ++c) members.sensor[begin + c] = s;
    for (int32_t c = 0; c < clusters; ++c) members.cluster[begin + c] = c;
    for (int32_t c = 0; c < clusters; ++c) parent[begin + c] = begin + c;
    begin += clusters;
  }
  members.count = member_begin[sensor_count] = begin;
}

// Copies the clusters' points in columns [first, last), in the vehicle frame, to side k of the scratch; returns their
// count. First it lists them, without a branch on what it reads: these columns of a frame's sensors are in no near
// cache, and so the reads overlap.
int32_t collect_columns(const SeamSide& side, int32_t member_begin, int32_t first, int32_t last, SeamScratch& scratch,
                        int32_t k) {
  const Plane<int32_t>& pixel_point = side.images->pixel_point;
  OVT_CHECK(pixel_point.rows * (last - first) <= scratch.capacity);
  int32_t* const list = scratch.member[k];  // rows of the scan's points, then members
  int32_t held = 0, count = 0;
  for (int32_t r = 0; r < pixel_point.rows; ++r)
    for (int32_t c = first; c < last; ++c) {
      const int32_t i = list[held] = pixel_point.at(r, c);
      held += i != kNoPoint;
    }
  for (int32_t n = 0; n < held; ++n) {
    const int32_t i = list[count] = list[n], label = side.points->label[i];  // a repaired pixel may have another label
    count += side.row_of_label[std::max(label, 0)] >= 0;                     // entry 0 is -1
  }
  const Transform T = side.sensor->T_vehicle_sensor;
  for (int32_t n = 0; n < count; ++n) {
    const int32_t i = list[n];
    transform_point(T, side.scan->x_m[i], side.scan->y_m[i], side.scan->z_m[i], scratch.x_m[k][n], scratch.y_m[k][n],
                    scratch.z_m[k][n]);
    list[n] = member_begin + side.row_of_label[side.points->label[i]];
  }
  return count;
}

// kRowAlign neighbours on one side of a seam. They lie near each other, and far from most blocks of the other side. The
// distance of two boxes uses the operations of near_bits, and rounding is monotonic: no two points of the blocks are
// computed nearer than their boxes, so skipping blocks is exact.
struct SeamBlock {
  float low[3], high[3];
  int32_t only;             // the member of all points, -1: there are several
  uint32_t run[kRowAlign];  // of each point: the bits of its neighbours with the same member, from the point on
};
constexpr int32_t kBlocks = 64;  // of one side, at a time

SeamBlock make_block(const SeamScratch& scratch, int32_t k, int32_t begin, int32_t end) {
  SeamBlock block;
  const float* const column[3] = {scratch.x_m[k], scratch.y_m[k], scratch.z_m[k]};
  for (int32_t axis = 0; axis < 3; ++axis) {
    block.low[axis] = block.high[axis] = column[axis][begin];
    for (int32_t i = begin + 1; i < end; ++i) {
      block.low[axis] = min_of(block.low[axis], column[axis][i]);
      block.high[axis] = max_of(block.high[axis], column[axis][i]);
    }
  }
  const int32_t* const member = scratch.member[k] + begin;
  const int32_t count = end - begin;
  uint32_t run = 0;
  for (int32_t i = count - 1; i >= 0; --i) {
    if (i + 1 < count && member[i] != member[i + 1]) run = 0;
    block.run[i] = run |= 1u << i;
  }
  block.only = run == (1u << count) - 1u ? member[0] : -1;
  return block;
}

float box_distance2(const SeamBlock& a, const SeamBlock& b) {
  float apart[3];
  for (int32_t axis = 0; axis < 3; ++axis)
    apart[axis] = max_of(max_of(b.low[axis] - a.high[axis], a.low[axis] - b.high[axis]), 0.0f);
  return (apart[0] * apart[0] + apart[1] * apart[1]) + apart[2] * apart[2];
}

// Eq. 4: the last K columns of the left sensor against the first K of the right one.
void join_over_seam(NearBitsFn* near_bits, const MergeSeamsParams& params, const SeamSide* sides,
                    const int32_t* member_begin, int32_t left, int32_t right, SeamScratch& scratch) {
  const int32_t left_cols = sides[left].images->pixel_point.cols;
  const int32_t right_cols = sides[right].images->pixel_point.cols;
  const int32_t left_count =
      collect_columns(sides[left], member_begin[left], std::max(left_cols - params.columns, 0), left_cols, scratch, 0);
  const int32_t right_count =
      collect_columns(sides[right], member_begin[right], 0, std::min(params.columns, right_cols), scratch, 1);
  const float limit = params.distance_m * params.distance_m;
  const float* const near_to[3] = {scratch.x_m[1], scratch.y_m[1], scratch.z_m[1]};
  for (int32_t first = 0; first < right_count; first += kRowAlign * kBlocks) {
    const int32_t end = std::min(first + kRowAlign * kBlocks, right_count);
    SeamBlock blocks[kBlocks];
    for (int32_t begin = first; begin < end; begin += kRowAlign)
      blocks[(begin - first) / kRowAlign] = make_block(scratch, 1, begin, std::min(begin + kRowAlign, end));
    for (int32_t a_begin = 0; a_begin < left_count; a_begin += kRowAlign) {
      const int32_t a_end = std::min(a_begin + kRowAlign, left_count);
      const SeamBlock of_left = make_block(scratch, 0, a_begin, a_end);
      for (int32_t begin = first; begin < end; begin += kRowAlign) {
        const SeamBlock& of_right = blocks[(begin - first) / kRowAlign];
        if (!(box_distance2(of_left, of_right) < limit)) continue;
        const uint32_t used = end - begin < kRowAlign ? (1u << (end - begin)) - 1u : ~0u;
        for (int32_t a = a_begin; a < a_end; ++a) {
          const int32_t member = scratch.member[0][a];
          if (of_right.only >= 0 && is_joined(scratch.parent, member, of_right.only)) {
            if (of_left.only >= 0) break;
            continue;
          }
          const float place[3] = {scratch.x_m[0][a], scratch.y_m[0][a], scratch.z_m[0][a]};
          uint32_t bits = near_bits(near_to, begin, place, limit) & used;
          while (bits != 0) {
            const int32_t near = __builtin_ctz(bits);
            join(scratch.parent, member, scratch.member[1][begin + near]);
            bits &= ~of_right.run[near];
          }
        }
      }
    }
  }
}

// Writes the first `capacity` of the roots, in member order, into scratch.order: those of a set with a member of
// kLeastPoints or more before the others, of both sorts the nearest.
void choose_roots(const SeamSide* sides, MemberTable& members, int32_t capacity, SeamScratch& scratch) {
  // Until the rows are known, members.merged holds the bits of the set's smallest range, which is not negative, so they
  // sort like the ranges; and the sign bit where a member has enough points.
  constexpr uint32_t kEnough = uint32_t(1) << 31;
  for (int32_t m = 0; m < members.count; ++m) {
    const float nearest = sides[members.sensor[m]].clusters->nearest_m[members.cluster[m]];
    const int32_t bits = std::bit_cast<int32_t>(nearest);
    const int32_t root = find_root(scratch.parent, m);
    members.merged[m] = bits;
    members.merged[root] = std::min(members.merged[root], bits);  // the root comes first
  }
  for (int32_t m = 0; m < members.count; ++m) {
    int32_t& of_root = members.merged[find_root(scratch.parent, m)];
    if (sides[members.sensor[m]].clusters->point_count[members.cluster[m]] >= kLeastPoints)
      of_root = int32_t(uint32_t(of_root) | kEnough);
  }
  // A heap with the worst root on top needs room for `capacity` entries only. No two roots compare equal, so the result
  // does not depend on the heap's order.
  const auto nearer = [&](int32_t a, int32_t b) {
    const uint32_t key_a = uint32_t(members.merged[a]) ^ kEnough, key_b = uint32_t(members.merged[b]) ^ kEnough;
    return key_a != key_b ? key_a < key_b : a < b;
  };
  int32_t* const order = scratch.order;
  int32_t rows = 0;
  for (int32_t m = 0; m < members.count; ++m) {
    if (scratch.parent[m] != m) continue;
    if (rows == capacity) {
      if (rows == 0 || !nearer(m, order[0])) continue;
      std::pop_heap(order, order + rows--, nearer);
    }
    order[rows++] = m;
    std::push_heap(order, order + rows, nearer);
  }
  std::sort(order, order + rows);
}

// Writes members.merged: a root's row, -1 for a root without room and for non-roots. Returns the number without room.
int32_t number_rows(const SeamSide* sides, MemberTable& members, FrameClusterTable& merged, SeamScratch& scratch) {
  const int32_t* const parent = scratch.parent;
  int32_t found = 0;
  for (int32_t m = 0; m < members.count; ++m) {
    const bool root = parent[m] == m;
    members.merged[m] = root ? found : -1;
    found += root;
  }
  merged.count = std::min(found, merged.capacity);
  if (found > merged.capacity) {
    choose_roots(sides, members, merged.capacity, scratch);
    for (int32_t m = 0; m < members.count; ++m) members.merged[m] = -1;
    for (int32_t row = 0; row < merged.count; ++row) members.merged[scratch.order[row]] = row;
  }
  return found - merged.count;
}

// Floor of the quotient, divisor > 0. A 128-bit division costs fifty times a 64-bit one.
template <class Int>
Int floor_divide(Int dividend, int32_t divisor) {
  return dividend / divisor - (dividend % divisor < 0 ? 1 : 0);
}

// Floor of the mean of the points' stamps, from the sum of their differences to one stamp. The sum is small for
// sensible stamps, and 128 bits hold it for all stamps and any number of points.
int64_t mean_stamp(int64_t base_ns, Int128 difference_sum, int32_t point_count) {
  const auto small = int64_t(difference_sum);
  const Int128 mean = base_ns + (small == difference_sum ? Int128(floor_divide(small, point_count))
                                                         : floor_divide(difference_sum, point_count));
  constexpr Int128 kLow = std::numeric_limits<int64_t>::min(), kHigh = std::numeric_limits<int64_t>::max();
  return int64_t(std::clamp(mean, kLow, kHigh));
}

// The same for the points of one cluster, whose sum fits 52 bits for sensible stamps. The rounded quotient lies between
// the integers on both sides of the exact one, so it is the floor or one more.
int64_t mean_stamp(int64_t base_ns, int64_t offset_sum, int32_t point_count) {
  constexpr int64_t kExact = int64_t(1) << 52;
  if (offset_sum < -kExact || offset_sum > kExact) return mean_stamp(base_ns, Int128(offset_sum), point_count);
  int64_t mean = int64_t(double(offset_sum) / double(point_count)), stamp = 0;
  mean -= mean * point_count > offset_sum;
  if (!__builtin_add_overflow(base_ns, mean, &stamp)) return stamp;
  return mean < 0 ? std::numeric_limits<int64_t>::min() : std::numeric_limits<int64_t>::max();
}

// Copies `count` clusters of sensor s, from cluster `first`, to the rows from `row`. None of them is joined yet.
void copy_run(const SeamSide& side, int32_t s, int32_t member, int32_t first, int32_t count, FrameClusterTable& merged,
              int32_t row) {
  const ClusterTable& from = *side.clusters;
  const auto copy = [&](auto* to, const auto* column) {
    std::memcpy(to + row, column + first, std::size_t(count) * sizeof *to);
  };
  copy(merged.point_count, from.point_count);
  copy(merged.min_x_m, from.min_x_m), copy(merged.min_y_m, from.min_y_m), copy(merged.min_z_m, from.min_z_m);
  copy(merged.max_x_m, from.max_x_m), copy(merged.max_y_m, from.max_y_m), copy(merged.max_z_m, from.max_z_m);
  copy(merged.nearest_m, from.nearest_m);

  const int32_t* OVT_RESTRICT const points = from.point_count + first;
  const auto divide = [&](float* OVT_RESTRICT center, const float* OVT_RESTRICT sum) {
    for (int32_t i = 0; i < count; ++i) center[i] = (0.0f + sum[i]) / float(points[i]);
  };
  divide(merged.center_x_m + row, from.sum_x_m + first);
  divide(merged.center_y_m + row, from.sum_y_m + first);
  divide(merged.center_z_m + row, from.sum_z_m + first);

  int64_t* OVT_RESTRICT const stamp = merged.stamp_ns + row;
  for (int32_t i = 0; i < count; ++i) stamp[i] = mean_stamp(side.stamp_ns, from.sum_offset_ns[first + i], points[i]);
  std::fill_n(merged.sensor_mask + row, count, 1 << s);
  std::fill_n(merged.main_sensor + row, count, s);
  for (int32_t i = 0; i < count; ++i) merged.first_member[row + i] = member + i;
}

// Copies all roots that have a row, in runs of neighbours.
void copy_roots(const SeamSide* sides, int32_t sensor_count, const int32_t* member_begin, MemberTable& members,
                FrameClusterTable& merged) {
  const int32_t* const row_of = members.merged;
  std::fill_n(members.next_member, members.count, -1);
  for (int32_t s = 0; s < sensor_count; ++s) {
    const int32_t end = member_begin[s + 1];
    for (int32_t m = member_begin[s]; m < end;) {
      const int32_t first = m++;
      if (row_of[first] < 0) continue;
      while (m < end && row_of[m] >= 0) ++m;  // rows are given in member order, so these rows are neighbours, too
      copy_run(sides[s], s, first, first - member_begin[s], m - first, merged, row_of[first]);
    }
  }
}

// Calls f(member) for each member that is not a root, last first. They are few, so blocks of 16 roots are skipped at
// once.
template <class F>
void for_each_joined(const int32_t* parent, int32_t count, F&& f) {
  constexpr int32_t kBlock = 16;
  for (int32_t begin = (count - 1) / kBlock * kBlock; begin >= 0; begin -= kBlock) {
    if (begin + kBlock <= count) {
      int32_t joined = 0;
      for (int32_t k = 0; k < kBlock; ++k) joined |= parent[begin + k] ^ (begin + k);
      if (joined == 0) continue;
    }
    for (int32_t m = std::min(begin + kBlock, count) - 1; m >= begin; --m)
      if (parent[m] != m) f(m);
  }
}

// Chains the members of each set in member order, from its root, and sums up each set that has a row.
void sum_up_joined(const SeamSide* sides, MemberTable& members, FrameClusterTable& merged, int32_t* parent) {
  for_each_joined(parent, members.count, [&](int32_t m) {
    const int32_t root = parent[m] = find_root(parent, m), row = members.merged[root];
    members.merged[m] = row;
    if (row < 0) return;
    members.next_member[m] = members.next_member[root];
    members.next_member[root] = m;
  });
  for_each_joined(parent, members.count, [&](int32_t m) {
    const int32_t root = parent[m], row = members.merged[root];
    if (row >= 0 && members.next_member[root] == m) sum_up_members(sides, members, merged, row);  // once per set
  });
}

}  // namespace

void sum_up_members(const SeamSide* sides, const MemberTable& members, FrameClusterTable& merged,
                    int32_t row) noexcept {
  constexpr float kInfinity = std::numeric_limits<float>::infinity();
  float low[3] = {kInfinity, kInfinity, kInfinity}, high[3] = {-kInfinity, -kInfinity, -kInfinity};
  float sum[3] = {0, 0, 0}, nearest = kInfinity;
  int32_t points_of_sensor[kMaxSensors] = {}, point_count = 0, mask = 0;
  const int64_t base_ns = sides[members.sensor[merged.first_member[row]]].stamp_ns;
  Int128 difference_sum = 0;
  for (int32_t m = merged.first_member[row]; m >= 0; m = members.next_member[m]) {
    const int32_t s = members.sensor[m], c = members.cluster[m];
    const ClusterTable& from = *sides[s].clusters;
    const float from_low[3] = {from.min_x_m[c], from.min_y_m[c], from.min_z_m[c]};
    const float from_high[3] = {from.max_x_m[c], from.max_y_m[c], from.max_z_m[c]};
    const float from_sum[3] = {from.sum_x_m[c], from.sum_y_m[c], from.sum_z_m[c]};
    for (int32_t a = 0; a < 3; ++a) {
      low[a] = min_of(low[a], from_low[a]);
      high[a] = max_of(high[a], from_high[a]);
      sum[a] = sum[a] + from_sum[a];
    }
    nearest = min_of(nearest, from.nearest_m[c]);
    points_of_sensor[s] += from.point_count[c];
    point_count += from.point_count[c];
    mask |= 1 << s;
    difference_sum += (Int128(sides[s].stamp_ns) - base_ns) * from.point_count[c] + from.sum_offset_ns[c];
  }
  const float count = float(point_count);
  merged.point_count[row] = point_count;
  merged.min_x_m[row] = low[0], merged.min_y_m[row] = low[1], merged.min_z_m[row] = low[2];
  merged.max_x_m[row] = high[0], merged.max_y_m[row] = high[1], merged.max_z_m[row] = high[2];
  merged.center_x_m[row] = sum[0] / count;
  merged.center_y_m[row] = sum[1] / count;
  merged.center_z_m[row] = sum[2] / count;
  merged.stamp_ns[row] = mean_stamp(base_ns, difference_sum, point_count);
  merged.sensor_mask[row] = mask;
  int32_t main_sensor = members.sensor[merged.first_member[row]];
  if ((mask & (mask - 1)) != 0)  // ties: the lower sensor
    main_sensor = int32_t(std::max_element(points_of_sensor, points_of_sensor + kMaxSensors) - points_of_sensor);
  merged.main_sensor[row] = main_sensor;
  merged.nearest_m[row] = nearest;
}

int32_t merge_seams_by(NearBitsFn* near_bits, const MergeSeamsParams& params, const SeamSide* sides,
                       int32_t sensor_count, MemberTable& members, FrameClusterTable& merged,
                       SeamScratch& scratch) noexcept {
  OVT_CHECK(sensor_count >= 0 && sensor_count <= kMaxSensors);
  int32_t member_begin[kMaxSensors + 1] = {};
  list_members(sides, sensor_count, members, scratch.parent, member_begin);

  // Neighbours are defined by the whole rig: the two neighbours of a missing sensor do not become neighbours.
  SensorModel sensors[kMaxSensors];
  for (int32_t s = 0; s < sensor_count; ++s) sensors[s] = *sides[s].sensor;
  int32_t left[kMaxSensors] = {}, right[kMaxSensors] = {};
  const int32_t seams = find_seams(sensors, sensor_count, left, right);
  for (int32_t i = 0; i < seams; ++i)
    if (sides[left[i]].present && sides[right[i]].present)
      join_over_seam(near_bits, params, sides, member_begin, left[i], right[i], scratch);

  const int32_t overflow = number_rows(sides, members, merged, scratch);
  copy_roots(sides, sensor_count, member_begin, members, merged);
  sum_up_joined(sides, members, merged, scratch.parent);
  return overflow;
}

namespace ref {

uint32_t near_bits(const float* const column[3], int32_t begin, const float place[3], float limit) {
  int32_t near[kRowAlign], any = 0;  // most points are near no other
  for (int32_t k = 0; k < kRowAlign; ++k) {
    const int32_t i = begin + k;
    const float dx = place[0] - column[0][i], dy = place[1] - column[1][i], dz = place[2] - column[2][i];
    any |= near[k] = (dx * dx + dy * dy) + dz * dz < limit;
  }
  uint32_t bits = 0;
  if (any)
    for (int32_t k = 0; k < kRowAlign; ++k) bits |= uint32_t(near[k]) << k;
  return bits;
}

int32_t merge_seams(const MergeSeamsParams& params, const SeamSide* sides, int32_t sensor_count, MemberTable& members,
                    FrameClusterTable& merged, SeamScratch& scratch) noexcept {
  return merge_seams_by(&near_bits, params, sides, sensor_count, members, merged, scratch);
}

}  // namespace ref
}  // namespace overtake
