// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// The tables of one cluster, of label 1, by its points in the vehicle frame. The rows of the scan are in another order
// than the cluster's, every third point lost its pixel, and every seventh has none.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <vector>

#include "core/cluster_table.h"
#include "core/point_table.h"
#include "tests/support/images.h"

namespace overtake::test {

class OneCluster {
 public:
  void add(float x_m, float y_m, float height_m = 0.5f) {
    x_.push_back(x_m), y_.push_back(y_m), heights_.push_back(height_m);
  }
  std::size_t size() const { return x_.size(); }

  // Fills the tables, and calls step(clusters, cluster_points, heights, points, labels).
  template <class F>
  int32_t run(F&& step) {
    const std::size_t n = size();
    const int32_t count = int32_t(n), begin = 0, one = 1;
    std::vector<int32_t> point(n);
    label_.assign(n, 1), pixel_.assign(n, 0), lost_.assign(n, 0);
    labels_ = OwnedPlane<int32_t>(1, 2 * count);
    labels_.fill(1);
    OwnedPlane<float> heights(1, 2 * count);
    for (std::size_t k = 0; k < n; ++k) {
      const std::size_t i = n - 1 - k;
      point[k] = int32_t(i);
      pixel_[i] = has_own_pixel(k) ? 2 * int32_t(k) : -1;
      lost_[i] = k % 3 == 0 && pixel_[i] >= 0;
      if (pixel_[i] >= 0) heights.at(0, pixel_[i]) = heights_[k];
    }
    heights.view().row(0)[-1] = 0.5f;  // of no pixel
    const int32_t before = labels_.view().row(0)[-1];
    float low_x = *std::min_element(x_.begin(), x_.end()), high_x = *std::max_element(x_.begin(), x_.end());
    float low_y = *std::min_element(y_.begin(), y_.end()), high_y = *std::max_element(y_.begin(), y_.end());
    float nearest_m = INFINITY;
    for (std::size_t k = 0; k < n; ++k) nearest_m = std::min(nearest_m, std::hypot(x_[k], y_[k]));
    int32_t label_of_row = one, begin_of_row = begin, count_of_row = count;
    ClusterTable clusters;
    clusters.count = clusters.capacity = 1;
    clusters.label = &label_of_row, clusters.point_begin = &begin_of_row, clusters.point_count = &count_of_row;
    clusters.min_x_m = &low_x, clusters.max_x_m = &high_x, clusters.min_y_m = &low_y, clusters.max_y_m = &high_y;
    clusters.nearest_m = &nearest_m;
    ClusterPointTable members;
    members.count = members.capacity = count;
    members.x_m = x_.data(), members.y_m = y_.data(), members.point = point.data();
    PointTable points;
    points.count = points.capacity = count;
    points.label = label_.data(), points.pixel = pixel_.data(), points.lost = lost_.data();
    const int32_t labels = step(clusters, members, Plane<const float>(heights), points, labels_.view());
    return labels_.view().row(0)[-1] == before ? labels : -1;
  }
  int32_t pixel_count() const { return 2 * int32_t(size()); }  // the most labels

  static bool has_own_pixel(std::size_t k) { return k % 7 != 6; }
  // The label of a point; -1 where its pixel has another one, or of a point that lost its pixel not the cluster's own.
  int32_t label_of(std::size_t k) {
    const std::size_t i = size() - 1 - k;
    if (pixel_[i] < 0) return label_[i];
    return labels_.at(0, pixel_[i]) == (lost_[i] ? 1 : label_[i]) ? label_[i] : -1;
  }

 private:
  std::vector<float> x_, y_, heights_;
  std::vector<int32_t> label_, pixel_;
  std::vector<uint8_t> lost_;
  OwnedPlane<int32_t> labels_ = OwnedPlane<int32_t>(1, 1);
};

}  // namespace overtake::test
