// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// Clusters from labels: count, choose, give rows, sort the points into the rows, sum up.
#include <algorithm>
#include <bit>
#include <limits>

#include "core/math.h"
#include "core/plane.h"
#include "core/reduce.h"
#include "kernels/build_clusters.h"
#include "kernels/transform_point.h"

namespace overtake::ref {
namespace {

constexpr float kInfinity = std::numeric_limits<float>::infinity();

// Counts the points per label, and writes the bits of each label's smallest range into nearest_bits. Ranges are not
// negative, so their bits sort in the same order as the ranges.
void count_points(const ScanTable& scan, const PointTable& points, int32_t label_count, int32_t* point_count,
                  int32_t* nearest_bits) {
  for (int32_t label = 0; label <= label_count; ++label) {
    point_count[label] = 0;
    nearest_bits[label] = std::numeric_limits<int32_t>::max();
  }
  for (int32_t i = 0; i < scan.count; ++i) {
    const int32_t label = points.label[i];
    if (label < 1) continue;
    OVT_CHECK(label <= label_count && points.range_m[i] >= 0.0f);
    ++point_count[label];
    nearest_bits[label] = std::min(nearest_bits[label], std::bit_cast<int32_t>(points.range_m[i]));
  }
}

// Bounds and sums of one row from its span of points.
void sum_up(const ScanTable& scan, const PointTable& points, const ClusterPointTable& cluster_points,
            ClusterTable& clusters, int32_t row) {
  const int32_t begin = clusters.point_begin[row];
  const float* axis[3] = {cluster_points.x_m + begin, cluster_points.y_m + begin, cluster_points.z_m + begin};
  float* out_min[3] = {clusters.min_x_m, clusters.min_y_m, clusters.min_z_m};
  float* out_max[3] = {clusters.max_x_m, clusters.max_y_m, clusters.max_z_m};
  float* out_sum[3] = {clusters.sum_x_m, clusters.sum_y_m, clusters.sum_z_m};
  for (int32_t a = 0; a < 3; ++a) {
    const float* v = axis[a];
    Lanes<float> low(kInfinity), high(-kInfinity), sum(0.0f);
    for_each_in_lanes(clusters.point_count[row], [&](int32_t k, int32_t l) {
      low[l] = min_of(low[l], v[k]);
      high[l] = max_of(high[l], v[k]);
      sum[l] = sum[l] + v[k];
    });
    out_min[a][row] = lane_min(low);
    out_max[a][row] = lane_max(high);
    out_sum[a][row] = lane_sum(sum);
  }
  int64_t offset = 0;
  float nearest = kInfinity;
  for (int32_t k = 0; k < clusters.point_count[row]; ++k) {
    const int32_t i = cluster_points.point[begin + k];
    offset += scan.time_offset_ns[i];
    nearest = min_of(nearest, points.range_m[i]);
  }
  clusters.sum_offset_ns[row] = offset;
  clusters.nearest_m[row] = nearest;
}

}  // namespace

int32_t choose_labels(int32_t label_count, int32_t capacity, const int32_t* point_count, const int32_t* nearest_bits,
                      int32_t* order) noexcept {
  int32_t found = 0;
  for (int32_t label = 1; label <= label_count; ++label)
    if (point_count[label] > 0) order[found++] = label;
  if (found <= capacity) return found;
  // No two labels compare equal, so every algorithm chooses the same.
  std::nth_element(order, order + capacity, order + found, [&](int32_t a, int32_t b) {
    const bool few_a = point_count[a] < kLeastPoints, few_b = point_count[b] < kLeastPoints;
    if (few_a != few_b) return few_b;
    return nearest_bits[a] != nearest_bits[b] ? nearest_bits[a] < nearest_bits[b] : a < b;
  });
  std::sort(order, order + capacity);
  return found;
}

int32_t build_clusters(const Transform& T_vehicle_sensor, const ScanTable& scan, const PointTable& points,
                       int32_t label_count, ClusterTable& clusters, ClusterPointTable& cluster_points,
                       int32_t* row_of_label, int32_t* cursor, int32_t* order) noexcept {
  // Until the rows are known, cursor holds the point counts and row_of_label the bits of the ranges.
  count_points(scan, points, label_count, cursor, row_of_label);
  const int32_t found = choose_labels(label_count, clusters.capacity, cursor, row_of_label, order);
  clusters.count = std::min(found, clusters.capacity);

  for (int32_t label = 0; label <= label_count; ++label) row_of_label[label] = -1;
  int32_t begin = 0;
  for (int32_t row = 0; row < clusters.count; ++row) {
    const int32_t label = order[row];
    row_of_label[label] = row;
    clusters.label[row] = label;
    clusters.point_begin[row] = begin;
    clusters.point_count[row] = cursor[label];
    cursor[label] = begin;
    begin += clusters.point_count[row];
  }
  cluster_points.count = begin;
  OVT_CHECK(begin + kRowAlign <= cluster_points.capacity);

  for (int32_t i = 0; i < scan.count; ++i) {
    const int32_t label = points.label[i];
    if (label < 1 || row_of_label[label] < 0) continue;
    const int32_t at = cursor[label]++;
    transform_point(T_vehicle_sensor, scan.x_m[i], scan.y_m[i], scan.z_m[i], cluster_points.x_m[at],
                    cluster_points.y_m[at], cluster_points.z_m[at]);
    cluster_points.point[at] = i;
  }
  for (int32_t row = 0; row < clusters.count; ++row) sum_up(scan, points, cluster_points, clusters, row);
  return found - clusters.count;
}

}  // namespace overtake::ref
