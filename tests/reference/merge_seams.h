// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// Merging across sensors (eq. 4), written from the method: compares all pairs, uses no order but the published one, and
// no code of the kernels. Tests compare the kernel with it.
#pragma once

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <vector>

#include "kernels/merge_seams.h"

namespace overtake::reference {

struct MergedCluster {
  std::vector<int32_t> members;  // in member order
  int32_t point_count = 0, sensor_mask = 0, main_sensor = 0;
  float low[3], high[3], center[3], nearest_m = std::numeric_limits<float>::infinity();
  int32_t most_points = 0;  // of one member
  int64_t stamp_ns = 0;
};

struct Merged {
  std::vector<MergedCluster> rows;
  std::vector<int32_t> merged_of_member;
  int32_t overflow = 0;
  bool is_decided = true;  // false: a pair of points is so close to the limit that rounding decides
};

// Sensors with an edge, clockwise by the azimuth of their images' middle.
inline std::vector<int32_t> order_sensors(const std::vector<SeamSide>& sides) {
  std::vector<std::pair<double, int32_t>> found;
  for (std::size_t s = 0; s < sides.size(); ++s) {
    const SensorModel& m = *sides[s].sensor;
    if (m.wraps) continue;
    const double middle = double(m.mounting_yaw_rad) + double(m.azimuth_left_rad) - m.cols * double(m.pitch_rad) / 2;
    found.emplace_back(-std::remainder(middle, 2 * M_PI), int32_t(s));
  }
  std::stable_sort(found.begin(), found.end(), [](const auto& a, const auto& b) { return a.first < b.first; });
  std::vector<int32_t> order;
  for (const auto& [azimuth, sensor] : found) order.push_back(sensor);
  return order;
}

struct SeamPoint {
  double at[3];
  int32_t member;
};

// Winners of pixels in the columns [first, last) whose cluster has a row.
inline std::vector<SeamPoint> list_points(const SeamSide& side, int32_t member_begin, int32_t first, int32_t last) {
  std::vector<SeamPoint> points;
  const Transform& T = side.sensor->T_vehicle_sensor;
  for (int32_t r = 0; r < side.images->pixel_point.rows; ++r)
    for (int32_t c = std::max(first, 0); c < std::min(last, side.images->pixel_point.cols); ++c) {
      const int32_t i = side.images->pixel_point.at(r, c);
      if (i < 0 || side.points->label[i] < 1 || side.row_of_label[side.points->label[i]] < 0) continue;
      const double p[3] = {side.scan->x_m[i], side.scan->y_m[i], side.scan->z_m[i]};
      SeamPoint out{{}, member_begin + side.row_of_label[side.points->label[i]]};
      for (int a = 0; a < 3; ++a)
        out.at[a] = T.r[3 * a] * p[0] + T.r[3 * a + 1] * p[1] + T.r[3 * a + 2] * p[2] + double(T.t[a]);
      points.push_back(out);
    }
  return points;
}

inline Merged merge_seams(const MergeSeamsParams& params, const std::vector<SeamSide>& sides, int32_t capacity) {
  struct Member {
    int32_t sensor, cluster;
  };
  std::vector<Member> members;
  std::vector<int32_t> begin;
  for (std::size_t s = 0; s < sides.size(); ++s) {
    begin.push_back(int32_t(members.size()));
    for (int32_t c = 0; sides[s].present && c < sides[s].clusters->count; ++c) members.push_back({int32_t(s), c});
  }

  Merged out;
  std::vector<int32_t> set(members.size());  // the lowest member of each member's set
  std::iota(set.begin(), set.end(), 0);
  const auto join = [&set](int32_t a, int32_t b) {
    const int32_t from = std::max(set[std::size_t(a)], set[std::size_t(b)]);
    const int32_t to = std::min(set[std::size_t(a)], set[std::size_t(b)]);
    std::replace(set.begin(), set.end(), from, to);
  };
  const std::vector<int32_t> order = order_sensors(sides);
  for (std::size_t i = 0; order.size() >= 2 && i < order.size(); ++i) {
    const auto l = std::size_t(order[i]), r = std::size_t(order[(i + 1) % order.size()]);
    if (!sides[l].present || !sides[r].present) continue;
    const int32_t cols = sides[l].images->pixel_point.cols;
    for (const SeamPoint& a : list_points(sides[l], begin[l], cols - params.columns, cols))
      for (const SeamPoint& b : list_points(sides[r], begin[r], 0, params.columns)) {
        const double d =
            std::sqrt(std::pow(a.at[0] - b.at[0], 2) + std::pow(a.at[1] - b.at[1], 2) + std::pow(a.at[2] - b.at[2], 2));
        if (std::fabs(d - double(params.distance_m)) < 1e-4) out.is_decided = false;
        if (d < double(params.distance_m)) join(a.member, b.member);
      }
  }

  std::vector<MergedCluster> rows;
  for (std::size_t root = 0; root < members.size(); ++root) {
    if (set[root] != int32_t(root)) continue;
    MergedCluster row;
    std::fill_n(row.low, 3, std::numeric_limits<float>::infinity());
    std::fill_n(row.high, 3, -std::numeric_limits<float>::infinity());
    float sum[3] = {0, 0, 0};
    std::vector<int32_t> points_of_sensor(sides.size(), 0);
    long double stamp_sum = 0;  // relative to the first member's stamp: exact for all stamps in tests
    const int64_t base_ns = sides[std::size_t(members[root].sensor)].stamp_ns;
    for (std::size_t m = root; m < members.size(); ++m) {
      if (set[m] != int32_t(root)) continue;
      const auto s = std::size_t(members[m].sensor);
      const int32_t c = members[m].cluster;
      const ClusterTable& t = *sides[s].clusters;
      const float* lows[3] = {t.min_x_m, t.min_y_m, t.min_z_m};
      const float* highs[3] = {t.max_x_m, t.max_y_m, t.max_z_m};
      const float* sums[3] = {t.sum_x_m, t.sum_y_m, t.sum_z_m};
      for (int a = 0; a < 3; ++a) {
        row.low[a] = std::min(row.low[a], lows[a][c]);
        row.high[a] = std::max(row.high[a], highs[a][c]);
        sum[a] += sums[a][c];
      }
      row.members.push_back(int32_t(m));
      row.point_count += t.point_count[c];
      row.sensor_mask |= 1 << s;
      row.nearest_m = std::min(row.nearest_m, t.nearest_m[c]);
      row.most_points = std::max(row.most_points, t.point_count[c]);
      points_of_sensor[s] += t.point_count[c];
      stamp_sum += static_cast<long double>(sides[s].stamp_ns - base_ns) * t.point_count[c] + t.sum_offset_ns[c];
    }
    for (int a = 0; a < 3; ++a) row.center[a] = sum[a] / float(row.point_count);
    row.stamp_ns = base_ns + int64_t(std::floor(stamp_sum / row.point_count));
    row.main_sensor =
        int32_t(std::max_element(points_of_sensor.begin(), points_of_sensor.end()) - points_of_sensor.begin());
    rows.push_back(row);
  }

  // Keeps those of a member of three points and more first, then the nearest, in the order of their first members.
  std::vector<std::size_t> nearest(rows.size());
  std::iota(nearest.begin(), nearest.end(), std::size_t(0));
  std::stable_sort(nearest.begin(), nearest.end(), [&rows](std::size_t a, std::size_t b) {
    const bool few_a = rows[a].most_points < 3, few_b = rows[b].most_points < 3;
    return few_a != few_b ? few_b : rows[a].nearest_m < rows[b].nearest_m;
  });
  nearest.resize(std::min(nearest.size(), std::size_t(capacity)));
  std::sort(nearest.begin(), nearest.end());
  out.overflow = int32_t(rows.size() - nearest.size());
  out.merged_of_member.assign(members.size(), -1);
  for (const std::size_t i : nearest) {
    for (const int32_t m : rows[i].members) out.merged_of_member[std::size_t(m)] = int32_t(out.rows.size());
    out.rows.push_back(rows[i]);
  }
  return out;
}

}  // namespace overtake::reference
