// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
#include "pipeline/method/step_parts.h"

#include <algorithm>
#include <utility>

namespace overtake {
namespace {

// Part `part` of `count` of `size` items; bounds at multiples of `unit`.
template <class Span>
Span cut_span(int32_t size, int32_t unit, int32_t part, int32_t count) noexcept {
  const int64_t units = (size + unit - 1) / unit;
  const auto bound = [&](int32_t k) { return std::min(int32_t(units * k / count) * unit, size); };
  return {bound(part), bound(part + 1)};
}
PointSpan cut_points(const Segment& whole, int32_t part, int32_t count) noexcept {
  return cut_span<PointSpan>(whole.part.scan.count, kPointSpan, part, count);
}
ColumnSpan cut_columns(const Segment& whole, int32_t part, int32_t count) noexcept {
  return cut_span<ColumnSpan>(whole.sensor.cols, 64, part, count);
}

// Whether a point wins its pixel against another one that comes earlier in the scan.
bool wins(const Segment& s, int32_t point, int32_t earlier) noexcept {
  const float light = s.part.scan.intensity[point], other_light = s.part.scan.intensity[earlier];
  return light > other_light ||
         (light == other_light && s.views.points.range_m[point] < s.views.points.range_m[earlier]);
}

}  // namespace

void run_part(const KernelTable& kernels, const Step& step, const Segment& whole, int32_t part,
              int32_t count) noexcept {
  SegmentViews views = whole.views;
  Segment own = {whole.sensor, whole.params, whole.part, views};
  if (step.cut.by == Cut::kColumns) {
    own.columns = cut_columns(whole, part, count);
    return step.run(kernels, own);
  }
  own.points = cut_points(whole, part, count);
  PartViews& of_part = whole.views.parts[part];
  if (part > 0) {
    views.layer_sums = of_part.layer_sums;
    views.images.range_m = of_part.images.range_m;
    views.images.elevation_rad = of_part.images.elevation_rad;
    views.images.pixel_point = of_part.images.pixel_point;
  }
  step.run(kernels, own);
  of_part.layer_sums.touched_count = views.layer_sums.touched_count;
}

void join_layer_sums(Segment& whole, int32_t part, int32_t count) noexcept {
  if (part > 0) return;
  whole.views.points.count = whole.part.scan.count;
  LayerSums& sums = whole.views.layer_sums;
  sums.touched_count = whole.views.parts[0].layer_sums.touched_count;
  for (int32_t p = 1; p < count; ++p) {
    const LayerSums& more = whole.views.parts[p].layer_sums;
    for (int32_t i = 0; i < more.touched_count; ++i) {
      const int32_t layer = more.touched[i];
      if (sums.point_count[layer] == 0) sums.touched[sums.touched_count++] = layer;
      sums.point_count[layer] += std::exchange(more.point_count[layer], 0);
      sums.elevation_sum[layer] += std::exchange(more.elevation_sum[layer], 0);
    }
  }
}

void join_winners(Segment& whole, int32_t part, int32_t count) noexcept {
  const RangeImages& all = whole.views.images;
  const ColumnSpan own = cut_columns(whole, part, count);
  for (int32_t p = 1; p < count; ++p) {
    const RangeImages& more = whole.views.parts[p].images;
    const int32_t first = cut_points(whole, p, count).first;  // the part counts its points from here
    for (int32_t r = 0; r < all.pixel_point.rows; ++r) {
      int32_t* const point = all.pixel_point.row(r);
      float *const range_m = all.range_m.row(r), *const elevation_rad = all.elevation_rad.row(r);
      const int32_t* const new_point = more.pixel_point.row(r);
      const float *const new_range_m = more.range_m.row(r), *const new_elevation_rad = more.elevation_rad.row(r);
      const auto take = [&](int32_t c, bool takes) {
        point[c] = takes ? new_point[c] + first : point[c];
        range_m[c] = takes ? new_range_m[c] : range_m[c];
        elevation_rad[c] = takes ? new_elevation_rad[c] : elevation_rad[c];
      };
      // Few pixels have points of two parts. Compilers make vectors of the loop over the others.
      int32_t none = -1, both = -1;
      for (int32_t c = own.first; c < own.last; ++c) {
        none &= new_point[c];
        both &= point[c] | new_point[c];
      }
      if (none < 0) continue;
      if (both >= 0)
        for (int32_t c = own.first; c < own.last; ++c) {
          if (point[c] < 0 || new_point[c] < 0) continue;
          const bool new_wins = wins(whole, new_point[c] + first, point[c]);
          whole.views.points.lost[new_wins ? point[c] : new_point[c] + first] = 1;
          take(c, new_wins);
        }
      for (int32_t c = own.first; c < own.last; ++c) take(c, point[c] < 0 && new_point[c] >= 0);
    }
  }
}

}  // namespace overtake
