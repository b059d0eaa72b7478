// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
#include "pipeline/cut_ends.h"

#include <algorithm>
#include <cmath>

#include "core/math.h"
#include "pipeline/pixel_view.h"

namespace overtake {
namespace {

// An edge of a view: half of a plane through the sensor. The normal points outside.
struct Edge {
  const float* at_m;
  float x, y, z;
  float along_x, along_y;  // from the sensor

  bool is_ahead(float px, float py) const { return along_x * (px - at_m[0]) + along_y * (py - at_m[1]) > 0.0f; }

  float outside_m(float px, float py, float pz) const {
    return x * (px - at_m[0]) + y * (py - at_m[1]) + z * (pz - at_m[2]);
  }
};
Edge edge_at(const SensorModel& sensor, float azimuth_rad, bool is_left) {
  double s, c;
  sin_cos_f64(double(azimuth_rad), s, c);
  const float sign = is_left ? 1.0f : -1.0f, n[2] = {-sign * float(s), sign * float(c)};
  const float* const r = sensor.T_vehicle_sensor.r;
  return {.at_m = sensor.T_vehicle_sensor.t,
          .x = r[0] * n[0] + r[1] * n[1],
          .y = r[3] * n[0] + r[4] * n[1],
          .z = r[6] * n[0] + r[7] * n[1],
          .along_x = r[0] * float(c) + r[1] * float(s),
          .along_y = r[3] * float(c) + r[4] * float(s)};
}

// Whether a place lies in a sector of a sensor.
bool is_in_sector(const SensorModel& sensor, float left_rad, float width_rad, float x_m, float y_m, float z_m) {
  const Edge left = edge_at(sensor, left_rad, true), right = edge_at(sensor, left_rad - width_rad, false);
  const bool is_inside_left = left.outside_m(x_m, y_m, z_m) < 0.0f,
             is_inside_right = right.outside_m(x_m, y_m, z_m) < 0.0f;
  return width_rad > float(kPi) ? is_inside_left || is_inside_right : is_inside_left && is_inside_right;
}

float view_width(const SensorModel& sensor) { return sensor.pitch_rad * float(sensor.cols); }

// Whether a sensor of the frame looks to a place.
bool looks_to(const StageContext& context, const Frame& frame, int32_t s, float x_m, float y_m, float z_m) {
  const SensorModel& sensor = context.sensors[s];
  const ViewGaps& gaps = frame.gaps[s];
  if (!frame.sensors[s].present) return false;
  if (!sensor.wraps && !is_in_sector(sensor, sensor.azimuth_left_rad, view_width(sensor), x_m, y_m, z_m)) return false;
  return std::none_of(gaps.gap, gaps.gap + gaps.count, [&](const ViewGap& gap) {
    return is_in_sector(sensor, left_of(sensor, gap), width_of(sensor, gap), x_m, y_m, z_m);
  });
}

// Calls f for the edges of what a sensor sees: those of its field of view, and of the gaps in it.
template <class F>
void for_each_edge(const SensorModel& sensor, const ViewGaps& gaps, F&& f) {
  if (!sensor.wraps) {
    f(edge_at(sensor, sensor.azimuth_left_rad, true));
    f(edge_at(sensor, sensor.azimuth_left_rad - view_width(sensor), false));
  }
  for (int32_t i = 0; i < gaps.count; ++i) {
    const float left_rad = left_of(sensor, gaps.gap[i]);
    f(edge_at(sensor, left_rad - width_of(sensor, gaps.gap[i]), true));
    f(edge_at(sensor, left_rad, false));
  }
}

// Calls f(x, y, z, is_own) for each point of a merged cluster.
template <class F>
void for_each_point(const Frame& frame, int32_t row, const SensorPart& own, F&& f) {
  for_each_member(frame, row, [&](const SensorPart& part, int32_t cluster) {
    const int32_t begin = part.clusters.point_begin[cluster], end = begin + part.clusters.point_count[cluster];
    for (int32_t k = begin; k < end; ++k)
      f(part.cluster_points.x_m[k], part.cluster_points.y_m[k], part.cluster_points.z_m[k], &part == &own);
  });
}

// How far inside of an edge the ends and sides of a cluster reach, each with the points within end_m of it.
struct Inside {
  float end_m;
  float low_1 = 0, high_1 = 0, low_2 = 0, high_2 = 0;

  void add(const OrientedBox& box, float along, float across, float inside_m) {
    if (along < box.low_1 + end_m) low_1 = max_of(low_1, inside_m);
    if (along > box.high_1 - end_m) high_1 = max_of(high_1, inside_m);
    if (across < box.low_2 + end_m) low_2 = max_of(low_2, inside_m);
    if (across > box.high_2 - end_m) high_2 = max_of(high_2, inside_m);
  }
};
constexpr float kEnd_m = 0.25f;  // of an end, or a side
constexpr float kFlat_m = 0.1f;  // of an end that faces the sensor

// `flat`: ends that would be cut off, but that look like the face of an end.
struct Found {
  CutEnds cut;
  bool flat_low = false, flat_high = false;
};

void find_cut_by(const StageContext& context, const Frame& frame, int32_t row, const SensorPart& part, const Edge& edge,
                 float cos, float sin, const OrientedBox& box, Found& found) {
  constexpr float kColumns = 1.5f, kBeyond_m = 0.15f, kDeep_m = 0.35f, kDeepOfFlat_m = 0.1f, kOutside_m = 0.5f;
  const SensorModel& sensor = context.sensors[&part - frame.sensors];
  Inside inside{kEnd_m}, flat{kFlat_m};
  float own_m = -1e9f, other_m = -1e9f, own_range_m = 0.0f, x_m = 0.0f, y_m = 0.0f, z_m = 0.0f;
  for_each_point(frame, row, part, [&](float x, float y, float z, bool is_own) {
    const float outside_m = edge.outside_m(x, y, z);
    inside.add(box, x * cos + y * sin, y * cos - x * sin, 0.0f - outside_m);
    flat.add(box, x * cos + y * sin, y * cos - x * sin, 0.0f - outside_m);
    if (!is_own) other_m = max_of(other_m, outside_m);
    if (!is_own || outside_m <= own_m) return;
    const float dx = x - edge.at_m[0], dy = y - edge.at_m[1];
    own_m = outside_m, x_m = x, y_m = y, z_m = z, own_range_m = std::sqrt(dx * dx + dy * dy);
  });
  const float column_m = kColumns * sensor.pitch_rad * own_range_m;
  if (!(abs_of(own_m) <= column_m) || other_m > kBeyond_m) return;
  x_m += kOutside_m * edge.x, y_m += kOutside_m * edge.y, z_m += kOutside_m * edge.z;
  for (int32_t s = 0; s < context.sensor_count; ++s)
    if (&frame.sensors[s] != &part && looks_to(context, frame, s, x_m, y_m, z_m)) return;
  // The edge crosses the car obliquely: points within end_m of an end that it cuts off lie so far inside of it.
  const float along = edge.x * cos + edge.y * sin, across = edge.y * cos - edge.x * sin;
  const float deep_1 = kDeep_m + kEnd_m * abs_of(along), deep_2 = kDeep_m + kEnd_m * abs_of(across);
  const float deep_flat = kDeepOfFlat_m + kFlat_m * abs_of(along);
  const bool low = along < 0.0f && inside.low_1 < deep_1;
  const bool high = along > 0.0f && inside.high_1 < deep_1;
  found.cut.low_1 = found.cut.low_1 || low;
  found.cut.high_1 = found.cut.high_1 || high;
  found.cut.low_2 = found.cut.low_2 || (across < 0.0f && inside.low_2 < deep_2);
  found.cut.high_2 = found.cut.high_2 || (across > 0.0f && inside.high_2 < deep_2);
  found.flat_low = found.flat_low || (low && flat.low_1 >= deep_flat);
  found.flat_high = found.flat_high || (high && flat.high_1 >= deep_flat);
}

// Whether something nearer hides what lies beyond an end: beside the last pixel of half of the rows or more.
bool is_end_hidden(const StageContext& context, const Frame& frame, int32_t row, float cos, float sin, bool is_high) {
  constexpr int32_t kRows = 256;  // rows that are a multiple of it apart count as one: no car near holds both
  int32_t rows = 0, hidden = 0;
  for_each_member(frame, row, [&](const SensorPart& part, int32_t cluster) {
    const SensorModel& sensor = context.sensors[&part - frame.sensors];
    const float* const at_m = sensor.T_vehicle_sensor.t;
    const float sight_x = frame.merged.center_x_m[row] - at_m[0], sight_y = frame.merged.center_y_m[row] - at_m[1];
    const bool is_left = (sight_x * sin - sight_y * cos > 0.0f) == is_high;  // of the middle, as the sensor sees it
    const int32_t stride = part.kept.images.pixel_point.stride;
    int32_t last[kRows];
    std::fill_n(last, kRows, kNoPoint);
    const int32_t begin = part.clusters.point_begin[cluster], end = begin + part.clusters.point_count[cluster];
    for (int32_t k = begin; k < end; ++k) {
      const int32_t point = part.cluster_points.point[k], pixel = part.kept.points.pixel[point];
      if (pixel < 0) continue;
      int32_t& outer = last[pixel / stride % kRows];
      const bool is_farther = outer != kNoPoint && (pixel < part.kept.points.pixel[outer]) == is_left;
      if (outer == kNoPoint || is_farther) outer = point;
    }
    const PixelView view(sensor, part);
    for (const int32_t point : last) {
      rows += point != kNoPoint;
      hidden += point != kNoPoint && view.is_behind(point, is_left ? -1 : 1);
    }
  });
  return hidden > 0 && 2 * hidden >= rows;
}

}  // namespace

CutEnds find_cut_ends(const StageContext& context, const Frame& frame, int32_t row, float cos, float sin,
                      const OrientedBox& box) noexcept {
  constexpr float kNear_m = 0.3f;       // most clusters have no corner so near to an edge
  constexpr float kFarthest_m = 20.0f;  // farther away, rows and columns may miss ends and sides
  constexpr float kShort_m = 1.5f;      // a wheel and a nose have faces, too
  Found found;
  CutEnds& cut = found.cut;
  const FrameClusterTable& merged = frame.merged;
  if (merged.nearest_m[row] > kFarthest_m) return cut;
  for_each_member(frame, row, [&](const SensorPart& part, int32_t) {
    const auto s = &part - frame.sensors;
    for_each_edge(context.sensors[s], frame.gaps[s], [&](const Edge& edge) {
      if (!edge.is_ahead(merged.center_x_m[row], merged.center_y_m[row])) return;
      const float outside_m = edge.outside_m(edge.x > 0.0f ? merged.max_x_m[row] : merged.min_x_m[row],
                                             edge.y > 0.0f ? merged.max_y_m[row] : merged.min_y_m[row],
                                             edge.z > 0.0f ? merged.max_z_m[row] : merged.min_z_m[row]);
      if (outside_m > 0.0f - kNear_m) find_cut_by(context, frame, row, part, edge, cos, sin, box, found);
    });
  });
  if (cut.low_1 == cut.high_1 || !is_end_hidden(context, frame, row, cos, sin, cut.low_1)) return cut;
  const bool is_long = box.length() >= kShort_m;
  cut.low_1 = !(is_long && found.flat_low), cut.high_1 = !(is_long && found.flat_high);
  return cut;
}

}  // namespace overtake
