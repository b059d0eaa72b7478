// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
#include "pipeline/method/split_walls.h"

#include <algorithm>
#include <cmath>

#include "core/math.h"

namespace overtake {
namespace {

constexpr float kWallLength = 1.5f;    // lengths of a car that a wall has at least
constexpr float kFarthest_m = 90.0f;   // of points
constexpr float kLow_m = 0.1f;         // over the ground; lower points may be the ground itself
constexpr int32_t kMostSamples = 512;  // of a wall; of one with more points, every n-th counts
constexpr int32_t kLeastSamples = 60;  // of a wall,
constexpr int32_t kLeastInFront = 2;   // and of what stands in front of it
constexpr int32_t kLeastPoints = 15;   // of an object in front of it
constexpr float kLeastDepth = 0.5f;    // widths of a car that it reaches from the wall, at least,
constexpr float kMostDepth = 1.25f;    // and lengths, at most
constexpr float kLonger = 1.15f;       // lengths of a car that it has along the wall, at most

// A line along a wall: axes in the vehicle frame, and a parabola on them. Positive across: on the side of the vehicle.
class WallLine {
 public:
  // Low points of a wall, at most kMostSamples.
  bool fit(const float* x_m, const float* y_m, int32_t count) {
    std::fill_n(c_, 3, 0.0f);
    find_axes(x_m, y_m, count);
    float low = INFINITY, high = -INFINITY;
    for (int32_t k = 0; k < count; ++k) {
      const float along = along_of(x_m[k], y_m[k]);
      low = min_of(low, along), high = max_of(high, along);
    }
    const int32_t bins = std::min(int32_t((high - low) * (1.0f / kBin_m)) + 1, kBins);
    double sum[kBins] = {};
    int32_t points[kBins] = {};
    for (int32_t k = 0; k < count; ++k) {
      const int32_t bin = int32_t((along_of(x_m[k], y_m[k]) - low) * (1.0f / kBin_m));
      if (bin >= bins) continue;
      sum[bin] += double(across_of(x_m[k], y_m[k]));
      ++points[bin];
    }
    int32_t used = 0;
    for (int32_t bin = 0; bin < bins; ++bin) {
      if (points[bin] < kLeastOfBin) continue;
      at_[used] = double(low + kBin_m * (float(bin) + 0.5f));
      mean_[used++] = sum[bin] / points[bin];
    }
    return used >= kLeastBins && fit_parabola(used);
  }

  float along_of(float x, float y) const { return (x - mid_x_) * axis_x_ + (y - mid_y_) * axis_y_; }
  // How far a point is in front of the wall.
  float inside_of(float x, float y) const {
    const float along = along_of(x, y);
    return across_of(x, y) - ((c_[2] * along + c_[1]) * along + c_[0]);
  }

 private:
  static constexpr float kBin_m = 2.0f;
  static constexpr int32_t kBins = 64, kLeastOfBin = 2, kLeastBins = 5;

  float across_of(float x, float y) const { return side_ * ((y - mid_y_) * axis_x_ - (x - mid_x_) * axis_y_); }

  void find_axes(const float* x_m, const float* y_m, int32_t count) {
    double x = 0, y = 0, xx = 0, xy = 0, yy = 0;
    for (int32_t k = 0; k < count; ++k) x += double(x_m[k]), y += double(y_m[k]);
    x /= count, y /= count;
    for (int32_t k = 0; k < count; ++k) {
      const double dx = double(x_m[k]) - x, dy = double(y_m[k]) - y;
      xx += dx * dx, xy += dx * dy, yy += dy * dy;
    }
    // The eigenvector of the larger eigenvalue.
    const double half = 0.5 * (xx - yy), root = std::sqrt(half * half + xy * xy);
    double ax = half >= 0 ? half + root : std::fabs(xy), ay = half >= 0 ? xy : (xy < 0 ? half - root : root - half);
    const double length = std::sqrt(ax * ax + ay * ay);
    ax = length > 0 ? ax / length : 1.0, ay = length > 0 ? ay / length : 0.0;
    axis_x_ = float(ax), axis_y_ = float(ay), mid_x_ = float(x), mid_y_ = float(y);
    side_ = 1.0f;
    side_ = across_of(0.0f, 0.0f) < 0.0f ? -1.0f : 1.0f;
  }

  // Least squares; each round leaves out the means that are far from the parabola of the one before.
  bool fit_parabola(int32_t count) {
    constexpr double kFar_m[] = {1e9, 1.0, 0.7, 0.5, 0.35, 0.3};
    int32_t used = 0;
    for (const double far_m : kFar_m) {
      double s[5] = {}, t[3] = {};
      used = 0;
      for (int32_t k = 0; k < count; ++k) {
        const double a = at_[k], expected = (double(c_[2]) * a + double(c_[1])) * a + double(c_[0]);
        if (std::fabs(mean_[k] - expected) > far_m) continue;
        double power = 1.0;
        for (int32_t i = 0; i < 5; ++i, power *= a) {
          s[i] += power;
          if (i < 3) t[i] += power * mean_[k];
        }
        ++used;
      }
      if (used < kLeastBins || !solve(s, t)) return false;
    }
    return 5 * used >= 3 * count;
  }

  bool solve(const double (&s)[5], const double (&t)[3]) {
    const double m0 = s[2] * s[4] - s[3] * s[3], m1 = s[1] * s[4] - s[3] * s[2], m2 = s[1] * s[3] - s[2] * s[2];
    const double det = s[0] * m0 - s[1] * m1 + s[2] * m2;
    if (!(std::fabs(det) > 0.0)) return false;
    c_[0] = float((t[0] * m0 - t[1] * m1 + t[2] * m2) / det);
    c_[1] = float((0.0 - t[0] * m1 + t[1] * (s[0] * s[4] - s[2] * s[2]) - t[2] * (s[0] * s[3] - s[1] * s[2])) / det);
    c_[2] = float((t[0] * m2 - t[1] * (s[0] * s[3] - s[1] * s[2]) + t[2] * (s[0] * s[2] - s[1] * s[1])) / det);
    return true;
  }

  float axis_x_ = 1, axis_y_ = 0, mid_x_ = 0, mid_y_ = 0, side_ = 1;
  float c_[3] = {};
  double at_[kBins], mean_[kBins];
};

class Splitter {
 public:
  Splitter(const SplitWallsParams& params, const ClusterPointTable& cluster_points, Plane<const float> height_m,
           PointTable& points, Plane<int32_t> labels)
      : params_(params), cluster_points_(cluster_points), height_m_(height_m), points_(points), labels_(labels) {}

  // Labels what stands in front of a wall: label_count + 1, + 2, ... Returns the last one.
  int32_t split(int32_t begin, int32_t end, int32_t label_count) {
    const int32_t step = (end - begin + kMostSamples - 1) / kMostSamples;
    int32_t count = 0;
    for (int32_t k = begin; k < end; k += step) {
      if (!is_low(k)) continue;
      x_m_[count] = cluster_points_.x_m[k], y_m_[count++] = cluster_points_.y_m[k];
    }
    if (count < kLeastSamples || !line_.fit(x_m_, y_m_, count)) return label_count;
    int32_t in_front = 0;
    for (int32_t k = 0; k < count; ++k) in_front += line_.inside_of(x_m_[k], y_m_[k]) > kLeastDepth * params_.width_m;
    return in_front < kLeastInFront ? label_count : label_objects(begin, end, label_count);
  }

 private:
  static constexpr float kCell_m = 0.5f;  // along the wall
  static constexpr int32_t kCells = 512, kApart = 3;
  struct Cell {
    int32_t points, label;
    float deepest_m;
  };

  bool is_low(int32_t k) const {
    const float x = cluster_points_.x_m[k], y = cluster_points_.y_m[k];
    if (x * x + y * y > kFarthest_m * kFarthest_m) return false;
    const int32_t pixel = points_.pixel[cluster_points_.point[k]];
    return pixel >= 0 && height_m_.data[pixel] >= kLow_m && height_m_.data[pixel] <= params_.top_m;
  }
  // Calls f(point of the cluster, cell) for the points in front of the wall.
  template <class F>
  void for_each_in_front(int32_t begin, int32_t end, F&& f) {
    for (int32_t k = begin; k < end; ++k) {
      const float x = cluster_points_.x_m[k], y = cluster_points_.y_m[k], inside_m = line_.inside_of(x, y);
      if (!(inside_m > params_.inside_m) || !is_low(k)) continue;
      const int32_t cell = int32_t(line_.along_of(x, y) * (1.0f / kCell_m) + 0.5f * float(kCells));
      if (cell >= 0 && cell < kCells) f(k, cells_[cell], inside_m);
    }
  }

  int32_t label_objects(int32_t begin, int32_t end, int32_t label_count) {
    std::fill_n(cells_, kCells, Cell{});
    for_each_in_front(begin, end, [](int32_t, Cell& cell, float inside_m) {
      ++cell.points;
      cell.deepest_m = max_of(cell.deepest_m, inside_m);
    });
    const int32_t before = label_count, most_labels = labels_.rows * labels_.cols;
    for (int32_t first = 0; first < kCells;) {
      if (cells_[first].points == 0) {
        ++first;
        continue;
      }
      int32_t last = first, points = 0;  // of an object
      float depth_m = 0.0f;
      for (int32_t c = first; c < kCells && c <= last + kApart; ++c) {
        if (cells_[c].points == 0) continue;
        last = c, points += cells_[c].points;
        depth_m = max_of(depth_m, cells_[c].deepest_m);
      }
      const float length_m = kCell_m * float(last - first);
      const bool is_deep = depth_m >= kLeastDepth * params_.width_m && depth_m <= kMostDepth * params_.length_m;
      const bool is_car = points >= kLeastPoints && length_m <= kLonger * params_.length_m && is_deep;
      if (is_car && label_count < most_labels) {
        ++label_count;
        for (int32_t c = first; c <= last; ++c) cells_[c].label = label_count;
      }
      first = last + 1;
    }
    if (label_count > before)
      for_each_in_front(begin, end, [&](int32_t k, const Cell& cell, float) {
        if (cell.label > 0) label_point(cluster_points_.point[k], cell.label);
      });
    return label_count;
  }

  void label_point(int32_t point, int32_t label) const {
    points_.label[point] = label;
    if (points_.lost[point] == 0) labels_.data[points_.pixel[point]] = label;
  }

  const SplitWallsParams& params_;
  const ClusterPointTable& cluster_points_;
  const Plane<const float> height_m_;
  PointTable& points_;
  const Plane<int32_t> labels_;
  WallLine line_;
  float x_m_[kMostSamples], y_m_[kMostSamples];
  Cell cells_[kCells];
};

}  // namespace

int32_t split_walls(const SplitWallsParams& params, const ClusterTable& clusters,
                    const ClusterPointTable& cluster_points, Plane<const float> height_m, int32_t label_count,
                    PointTable& points, Plane<int32_t> labels) noexcept {
  if (!(params.inside_m > 0.0f)) return label_count;
  Splitter splitter(params, cluster_points, height_m, points, labels);
  for (int32_t row = 0; row < clusters.count; ++row) {
    const float longest_m =
        max_of(clusters.max_x_m[row] - clusters.min_x_m[row], clusters.max_y_m[row] - clusters.min_y_m[row]);
    if (clusters.point_count[row] < kLeastSamples || clusters.nearest_m[row] > kFarthest_m ||
        longest_m < kWallLength * params.length_m)
      continue;
    const int32_t begin = clusters.point_begin[row];
    label_count = splitter.split(begin, begin + clusters.point_count[row], label_count);
  }
  return label_count;
}

}  // namespace overtake
