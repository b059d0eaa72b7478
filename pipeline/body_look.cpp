// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
#include "pipeline/body_look.h"

#include <algorithm>
#include <limits>

#include "core/math.h"
#include "kernels/drop_smoke.h"

namespace overtake {
namespace {

constexpr float kRough = 2.0f;  // times the limit: brighter points are lit, whatever is beside them
constexpr float kInfinity = std::numeric_limits<float>::infinity();
constexpr OrientedBox kNoBox = {kInfinity, -kInfinity, kInfinity, -kInfinity};

// Calls f(x, y) for each lit point of a cluster.
template <class F>
void for_each_lit(const StageContext& context, const Frame& frame, int32_t row, F&& f) {
  for_each_member(frame, row, [&](const SensorPart& part, int32_t cluster) {
    const int32_t s = int32_t(&part - frame.sensors);
    const int32_t begin = part.clusters.point_begin[cluster], end = begin + part.clusters.point_count[cluster];
    const GroundLight& dark = frame.smoke_limit[s];
    const PixelView view(context.sensors[s], part);
    for (int32_t k = begin; k < end; ++k) {
      const int32_t point = part.cluster_points.point[k];
      if (dark.light > 0.0f) {
        const float light = dark.of(part.scan, point);
        if (light < kRough * dark.light && (light < dark.light || !view.is_on_surface(point))) continue;
      }
      f(part.cluster_points.x_m[k], part.cluster_points.y_m[k]);
    }
  });
}

// Calls f(intensity, road's) for each point of a merged cluster whose sensor has reflectivities. How bright a surface
// is by signals is not known well enough to tell a sign.
template <class F>
void for_each_light(const Frame& frame, int32_t row, F&& f) {
  for_each_member(frame, row, [&](const SensorPart& part, int32_t cluster) {
    const GroundLight& road = part.ground_light;
    const int32_t begin = part.clusters.point_begin[cluster], count = part.clusters.point_count[cluster];
    if (road.is_signal || !(road.light > 0.0f)) return;
    for (int32_t k = begin; k < begin + count; ++k) f(part.scan.intensity[part.cluster_points.point[k]], road.light);
  });
}

}  // namespace

void find_smoke_limits(const StageContext& context, Frame& frame) noexcept {
  constexpr int32_t kSmokePoints = 100;  // a scan without smoke has up to 40, smoke thousands
  for (int32_t s = 0; s < context.sensor_count; ++s) {
    const SensorPart& part = frame.sensors[s];
    frame.smoke_limit[s] = {};
    if (!part.present || part.reason_count[int32_t(Reason::kSmoke)] < kSmokePoints) continue;
    frame.smoke_limit[s] = part.ground_light;
    frame.smoke_limit[s].light *= context.segment[s].drop_smoke.dark_share;
  }
}

bool is_lit(const StageContext& context, const Frame& frame, int32_t row) noexcept {
  int32_t lit = 0;
  for_each_lit(context, frame, row, [&](float, float) { ++lit; });
  return 2 * lit >= frame.merged.point_count[row];
}

namespace {

OrientedBox trim_smoke(const StageContext& context, const Frame& frame, int32_t row, float cos, float sin,
                       const OrientedBox& box) {
  bool any_smoke = false;
  for_each_member(frame, row, [&](const SensorPart& part, int32_t) {
    any_smoke = any_smoke || frame.smoke_limit[&part - frame.sensors].light > 0.0f;
  });
  if (!any_smoke) return box;
  OrientedBox lit = kNoBox;
  int32_t count = 0;
  for_each_lit(context, frame, row, [&](float x, float y) {
    const float along = x * cos + y * sin, across = y * cos - x * sin;
    lit = {min_of(lit.low_1, along), max_of(lit.high_1, along), min_of(lit.low_2, across), max_of(lit.high_2, across)};
    ++count;
  });
  return 2 * count >= frame.merged.point_count[row] ? lit : box;
}

// The points of a cluster in bins along one axis, from a box's low end on.
struct AxisBins {
  static constexpr int32_t kBins = 80;
  static constexpr float kBin_m = 0.2f;
  int32_t points[kBins] = {}, total = 0;
  float low_m;

  int32_t bin_of(float at_m) const { return std::clamp(int32_t((at_m - low_m) * (1.0f / kBin_m)), 0, kBins - 1); }
};

// The box of the points between the empty bins around the fullest one, if few points lie beyond.
OrientedBox trim_axis(const Frame& frame, int32_t row, float cos, float sin, bool is_across, const OrientedBox& box) {
  constexpr int32_t kOneIn = 50;  // points may be strays
  const auto for_each_point = [&](auto&& f) {
    for_each_member(frame, row, [&](const SensorPart& part, int32_t cluster) {
      const int32_t begin = part.clusters.point_begin[cluster], end = begin + part.clusters.point_count[cluster];
      for (int32_t k = begin; k < end; ++k) {
        const float x = part.cluster_points.x_m[k], y = part.cluster_points.y_m[k];
        const float along = x * cos + y * sin, across = y * cos - x * sin;
        if (along >= box.low_1 && along <= box.high_1 && across >= box.low_2 && across <= box.high_2) f(along, across);
      }
    });
  };
  AxisBins bins;
  bins.low_m = is_across ? box.low_2 : box.low_1;
  const auto bin_of = [&](float along, float across) { return bins.bin_of(is_across ? across : along); };
  for_each_point([&](float along, float across) { ++bins.points[bin_of(along, across)], ++bins.total; });
  int32_t first = int32_t(std::max_element(bins.points, bins.points + AxisBins::kBins) - bins.points), last = first;
  int32_t inside = bins.points[first];
  while (first > 0 && bins.points[first - 1] > 0) inside += bins.points[--first];
  while (last + 1 < AxisBins::kBins && bins.points[last + 1] > 0) inside += bins.points[++last];
  if (inside == bins.total || kOneIn * (bins.total - inside) > bins.total) return box;
  OrientedBox body = kNoBox;
  for_each_point([&](float along, float across) {
    const int32_t bin = bin_of(along, across);
    if (bin < first || bin > last) return;
    body = {min_of(body.low_1, along), max_of(body.high_1, along), min_of(body.low_2, across),
            max_of(body.high_2, across)};
  });
  return body;
}

}  // namespace

OrientedBox trim_box(const StageContext& context, const Frame& frame, int32_t row, float cos, float sin,
                     const OrientedBox& box) noexcept {
  const CarLimits& limits = context.detect.gate_cars.limits;
  OrientedBox body = trim_smoke(context, frame, row, cos, sin, box);
  if (body.length() > limits.length_m) body = trim_axis(frame, row, cos, sin, false, body);
  if (body.width() > limits.width_m) body = trim_axis(frame, row, cos, sin, true, body);
  return body;
}

PixelBox main_pixels(const Frame& frame, int32_t row, const PixelView& view) noexcept {
  const SensorPart& part = frame.sensors[frame.merged.main_sensor[row]];
  PixelBox pixels;
  for_each_member(frame, row, [&](const SensorPart& own, int32_t cluster) {
    if (&own == &part) view.add_pixels(cluster, pixels);
  });
  return pixels;
}

LevelRows count_level_rows(const StageContext& context, const Frame& frame, int32_t row) noexcept {
  LevelRows all;
  for_each_member(frame, row, [&](const SensorPart& part, int32_t cluster) {
    PixelView(context.sensors[&part - frame.sensors], part).count_level(cluster, all);
  });
  return all;
}

bool is_in_own_shadow(const StageContext& context, const Frame& frame, int32_t row) noexcept {
  constexpr float kNear_m = 30.0f;  // farther away, the road may return nothing
  const int32_t s = frame.merged.main_sensor[row];
  if (!(frame.merged.nearest_m[row] < kNear_m) || frame.smoke_limit[s].light > 0.0f) return false;
  const PixelView view(context.sensors[s], frame.sensors[s]);
  const PixelBox pixels = main_pixels(frame, row, view);
  if (pixels.row_high < 0) return false;
  const GroundBeside ground = view.find_ground(pixels);
  return !ground.left && !ground.right && (ground.none_left || ground.none_right);
}

bool is_sign(const Frame& frame, int32_t row) noexcept {
  constexpr float kBright = 4.0f;
  int32_t bright = 0;
  for_each_light(frame, row, [&](float light, float road) { bright += light > kBright * road; });
  return 2 * bright > frame.merged.point_count[row];
}

bool is_reflector(const Frame& frame, int32_t row, float bare_share) noexcept {
  constexpr float kGlare = 5.0f, kBare = 25.0f;  // a white body is up to 20 times as bright as dark asphalt
  constexpr int32_t kFewest = 2;                 // one point is the lamp of a car, and of few points makes such a mean
  constexpr int32_t kManyPoints = 30;            // of so many of glare, some are the reflector itself
  float sum = 0.0f, least = 0.0f;
  int32_t bright = 0, bare = 0;
  for_each_light(frame, row, [&](float light, float road) {
    sum += light;
    least += kGlare * road;
    bright += light > kGlare * road;
    bare += light > kBare * road;
  });
  const int32_t points = frame.merged.point_count[row];
  if (bare == 0 && points >= kManyPoints) return false;
  return sum > least && bright >= kFewest && float(bare) >= bare_share * float(points);
}

bool is_surely_car(const StageContext& context, const Frame& frame, int32_t row) noexcept {
  constexpr int32_t kPoints = 30, kRows = 3;  // the rows of one sensor
  constexpr float kUpright_m = 0.5f, kLow_m = 0.4f, kHigh_m = 0.6f, kTop_m = 1.25f;
  constexpr float kLength = 0.5f, kWidth = 0.45f;  // of the vehicle
  constexpr float kSurface = 0.65f;
  const FrameClusterTable& merged = frame.merged;
  if (merged.point_count[row] < kPoints || merged.max_z_m[row] - merged.min_z_m[row] < kUpright_m) return false;
  const OrientedBox box = box_of(frame.places, row);
  if (max_of(box.length(), box.width()) < kLength * context.detect.fit_rectangle.length_m ||
      min_of(box.length(), box.width()) < kWidth * context.detect.fit_rectangle.width_m)
    return false;
  int32_t rows = 0, beside = 0;
  RowCount by_row;
  for_each_member(frame, row, [&](const SensorPart& part, int32_t cluster) {
    const PixelView view(context.sensors[&part - frame.sensors], part);
    view.count_rows(cluster, by_row);
    PixelBox pixels;
    view.add_pixels(cluster, pixels);
    if (pixels.row_high >= 0) rows = std::max(rows, pixels.row_high - pixels.row_low + 1);
    const int32_t begin = part.clusters.point_begin[cluster], end = begin + part.clusters.point_count[cluster];
    for (int32_t k = begin; k < end; ++k) beside += view.is_on_surface(part.cluster_points.point[k]);
  });
  if (rows < kRows || float(beside) < kSurface * float(merged.point_count[row])) return false;
  // Most points on one row: a post in one cluster with the ground at its foot.
  if (2 * *std::max_element(std::begin(by_row.points), std::end(by_row.points)) > merged.point_count[row]) return false;
  const ClusterHeights heights = measure_heights(frame, row);
  if (!(heights.low_m < kLow_m && heights.high_m >= kHigh_m && heights.high_m < kTop_m)) return false;
  return is_lit(context, frame, row) && !is_sign(frame, row);
}

}  // namespace overtake
