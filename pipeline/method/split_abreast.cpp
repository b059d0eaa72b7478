// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
#include "pipeline/method/split_abreast.h"

#include <algorithm>
#include <cmath>

#include "core/math.h"
#include "kernels/heading_grid.h"
#include "pipeline/cluster_places.h"

namespace overtake {
namespace {

constexpr int32_t kEnoughPoints = 60;          // of a cluster: fewer leave gaps anywhere
constexpr int32_t kMostPoints = 1024;          // of a cluster with more, every n-th counts
constexpr int32_t kLeastOfPart = 8;            // of these points
constexpr float kLonger = 1.1f;                // how much longer than a car its points may be,
constexpr float kWider = 1.15f;                // and wider
constexpr float kLongest = 2.4f;               // lengths of a car that the cluster has at most
constexpr float kFarthest_m = 30.0f;           // of the cluster's nearest point,
constexpr float kMostBetweenColumns_m = 0.1f;  // and between two columns there

// The points of a cluster that count, vehicle frame.
struct Sample {
  const float *x_m, *y_m;
  int32_t count, step;

  template <class F>
  void for_each(F&& f) const {
    for (int32_t k = 0; k < count; k += step) f(x_m[k], y_m[k]);
  }
  int32_t size() const { return (count + step - 1) / step; }
};

struct Span {
  float low = INFINITY, high = -INFINITY;
  void add(float v) { low = min_of(low, v), high = max_of(high, v); }
  float length() const { return high - low; }
};

// A heading of the grid, -45 to 45 deg.
struct Heading {
  float cos, sin;
  float along(float x, float y) const { return x * cos + y * sin; }
  float across(float x, float y) const { return y * cos - x * sin; }
};
Heading heading_of(float degree) {
  const int32_t k = int32_t(abs_of(degree) * float(kHeadingsPerDegree));
  return {kHeadingGrid.cos[k], degree < 0.0f ? 0.0f - kHeadingGrid.sin[k] : kHeadingGrid.sin[k]};
}

bool may_be_one_car(const SplitAbreastParams& params, const Sample& sample) {
  const CarLimits most = {kLonger * params.length_m, kWider * params.width_m, INFINITY};
  return fits_at_any_heading(most, [&](float cos, float sin) {
    const Heading heading = {cos, sin};
    Span along, across;
    sample.for_each([&](float x, float y) {
      along.add(heading.along(x, y));
      across.add(heading.across(x, y));
    });
    return OrientedBox{along.low, along.high, across.low, across.high};
  });
}

struct Strip {
  float width_m = 0.0f, middle_m = 0.0f;  // across the heading
  Heading heading = {};
};

// Neither part is longer than a car: else it is a wall.
bool are_cars(const SplitAbreastParams& params, const Sample& sample, const Strip& strip) {
  Span left, right;
  sample.for_each([&](float x, float y) {
    (strip.heading.across(x, y) > strip.middle_m ? left : right).add(strip.heading.along(x, y));
  });
  return max_of(left.length(), right.length()) <= kLonger * params.length_m;
}

// The widest strip between two parts of the size of a car. It need not be quite empty, because a beam that hits both
// cars measures a place between them: each bin has at most a tenth of the points that a bin of the cluster has on
// average.
class StripSearch {
 public:
  StripSearch(const SplitAbreastParams& params, const Sample& sample) : params_(params), sample_(sample) {}

  void try_heading(const Heading& heading) {
    Span across;
    sample_.for_each([&](float x, float y) { across.add(heading.across(x, y)); });
    bins_ = int32_t(across.length() * kBinsPerMetre) + 1;
    if (across.length() <= kWider * params_.width_m || bins_ > kMostBins) return;
    std::fill_n(count_, bins_, 0);
    sample_.for_each([&](float x, float y) { ++count_[bin_of(heading.across(x, y) - across.low)]; });
    constexpr float kFew = 0.1f;
    const float few = kFew * float(sample_.size()) / float(bins_);
    const int32_t part_bins = int32_t(kWider * params_.width_m * kBinsPerMetre);
    int32_t before = 0;
    for (int32_t first = 0, end = 0; first <= part_bins && first < bins_; first = end) {
      int32_t within = 0;
      for (end = first; end < bins_ && float(count_[end]) <= few; ++end) within += count_[end];
      const float width_m = float(end - first) * (1.0f / kBinsPerMetre);
      const int32_t behind = sample_.size() - before - within;
      const Strip strip = {width_m, across.low + 0.5f * float(first + end) * (1.0f / kBinsPerMetre), heading};
      if (width_m > best_.width_m && bins_ - end <= part_bins && before >= kLeastOfPart && behind >= kLeastOfPart &&
          are_cars(params_, sample_, strip))
        best_ = strip;
      before += within;
      if (end == first) before += count_[end++];
    }
  }
  const Strip& best() const { return best_; }

 private:
  static constexpr float kBinsPerMetre = 20.0f;
  static constexpr int32_t kMostBins = 512;
  int32_t bin_of(float from_low_m) const {
    const int32_t bin = int32_t(from_low_m * kBinsPerMetre);
    return bin < bins_ ? bin : bins_ - 1;
  }

  const SplitAbreastParams& params_;
  const Sample& sample_;
  int32_t bins_ = 0;
  int32_t count_[kMostBins];
  Strip best_;
};

Strip find_strip(const SplitAbreastParams& params, const Sample& sample) {
  constexpr float kStep_deg = 2.5f, kMost_deg = 45.0f;
  if (may_be_one_car(params, sample)) return {};
  StripSearch search(params, sample);
  for (float degree = 0.0f; degree <= kMost_deg; degree += kStep_deg) {
    search.try_heading(heading_of(degree));
    if (degree > 0.0f) search.try_heading(heading_of(0.0f - degree));
  }
  return search.best().width_m >= params.strip_m ? search.best() : Strip{};
}

}  // namespace

int32_t split_abreast(const SplitAbreastParams& params, const ClusterTable& clusters,
                      const ClusterPointTable& cluster_points, int32_t label_count, PointTable& points,
                      Plane<int32_t> labels) noexcept {
  if (!(params.strip_m > 0.0f)) return label_count;
  const int32_t most_labels = labels.rows * labels.cols;
  const float farthest_m = min_of(kFarthest_m, kMostBetweenColumns_m / params.pitch_rad);
  for (int32_t row = 0; row < clusters.count; ++row) {
    const int32_t count = clusters.point_count[row], begin = clusters.point_begin[row];
    const float length_m = clusters.max_x_m[row] - clusters.min_x_m[row];
    const float width_m = clusters.max_y_m[row] - clusters.min_y_m[row];
    const float longest_m = max_of(length_m, width_m);
    if (count < kEnoughPoints || clusters.nearest_m[row] > farthest_m || longest_m > kLongest * params.length_m ||
        (length_m <= kLonger * params.length_m && width_m <= kWider * params.width_m))
      continue;
    const Sample sample = {cluster_points.x_m + begin, cluster_points.y_m + begin, count,
                           (count + kMostPoints - 1) / kMostPoints};
    const Strip strip = find_strip(params, sample);
    if (!(strip.width_m > 0.0f) || label_count >= most_labels) continue;
    ++label_count;
    for (int32_t k = begin; k < begin + count; ++k) {
      if (!(strip.heading.across(cluster_points.x_m[k], cluster_points.y_m[k]) > strip.middle_m)) continue;
      const int32_t point = cluster_points.point[k];
      points.label[point] = label_count;
      if (points.pixel[point] >= 0 && points.lost[point] == 0) labels.data[points.pixel[point]] = label_count;
    }
  }
  return label_count;
}

}  // namespace overtake
