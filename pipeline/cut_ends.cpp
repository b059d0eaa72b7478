// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
#include "pipeline/cut_ends.h"

#include <cmath>

#include "core/math.h"

namespace overtake {
namespace {

// An edge of a field of view: half of a plane through the sensor. The normal points outside.
struct Edge {
  const float* at_m;
  float x, y, z;
  float along_x, along_y;  // from the sensor

  bool is_ahead(float px, float py) const { return along_x * (px - at_m[0]) + along_y * (py - at_m[1]) > 0.0f; }

  float outside_m(float px, float py, float pz) const {
    return x * (px - at_m[0]) + y * (py - at_m[1]) + z * (pz - at_m[2]);
  }
};
Edge edge_of(const SensorModel& sensor, bool is_left) {
  const float azimuth_rad = sensor.azimuth_left_rad - (is_left ? 0.0f : sensor.pitch_rad * float(sensor.cols));
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

// Whether the columns of a sensor look to a place.
bool looks_to(const SensorModel& sensor, float x_m, float y_m, float z_m) {
  if (sensor.wraps) return true;
  const Edge left = edge_of(sensor, true), right = edge_of(sensor, false);
  const bool is_inside_left = left.outside_m(x_m, y_m, z_m) < 0.0f,
             is_inside_right = right.outside_m(x_m, y_m, z_m) < 0.0f;
  const bool is_wide = sensor.pitch_rad * float(sensor.cols) > float(kPi);
  return is_wide ? is_inside_left || is_inside_right : is_inside_left && is_inside_right;
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

// How far inside of an edge the ends and sides of a cluster reach.
struct Inside {
  static constexpr float kEnd_m = 0.25f;  // of an end, or a side
  float low_1 = 0, high_1 = 0, low_2 = 0, high_2 = 0;

  void add(const OrientedBox& box, float along, float across, float inside_m) {
    if (along < box.low_1 + kEnd_m) low_1 = max_of(low_1, inside_m);
    if (along > box.high_1 - kEnd_m) high_1 = max_of(high_1, inside_m);
    if (across < box.low_2 + kEnd_m) low_2 = max_of(low_2, inside_m);
    if (across > box.high_2 - kEnd_m) high_2 = max_of(high_2, inside_m);
  }
};

void find_cut_by(const StageContext& context, const Frame& frame, int32_t row, const SensorPart& part, const Edge& edge,
                 float cos, float sin, const OrientedBox& box, CutEnds& cut) {
  constexpr float kColumns = 1.5f, kBeyond_m = 0.15f, kDeep_m = 0.35f, kOutside_m = 0.5f;
  const SensorModel& sensor = context.sensors[&part - frame.sensors];
  Inside inside;
  float own_m = -1e9f, other_m = -1e9f, own_range_m = 0.0f, x_m = 0.0f, y_m = 0.0f, z_m = 0.0f;
  for_each_point(frame, row, part, [&](float x, float y, float z, bool is_own) {
    const float outside_m = edge.outside_m(x, y, z);
    inside.add(box, x * cos + y * sin, y * cos - x * sin, 0.0f - outside_m);
    if (!is_own) other_m = max_of(other_m, outside_m);
    if (!is_own || outside_m <= own_m) return;
    const float dx = x - edge.at_m[0], dy = y - edge.at_m[1];
    own_m = outside_m, x_m = x, y_m = y, z_m = z, own_range_m = std::sqrt(dx * dx + dy * dy);
  });
  const float column_m = kColumns * sensor.pitch_rad * own_range_m;
  if (!(abs_of(own_m) <= column_m) || other_m > kBeyond_m) return;
  x_m += kOutside_m * edge.x, y_m += kOutside_m * edge.y, z_m += kOutside_m * edge.z;
  for (int32_t s = 0; s < context.sensor_count; ++s)
    if (&frame.sensors[s] != &part && frame.sensors[s].present && looks_to(context.sensors[s], x_m, y_m, z_m)) return;
  // The edge crosses the car obliquely: points within kEnd_m of an end that it cuts off lie so far inside of it.
  const float along = edge.x * cos + edge.y * sin, across = edge.y * cos - edge.x * sin;
  const float deep_1 = kDeep_m + Inside::kEnd_m * abs_of(along), deep_2 = kDeep_m + Inside::kEnd_m * abs_of(across);
  cut.low_1 = cut.low_1 || (along < 0.0f && inside.low_1 < deep_1);
  cut.high_1 = cut.high_1 || (along > 0.0f && inside.high_1 < deep_1);
  cut.low_2 = cut.low_2 || (across < 0.0f && inside.low_2 < deep_2);
  cut.high_2 = cut.high_2 || (across > 0.0f && inside.high_2 < deep_2);
}

}  // namespace

CutEnds find_cut_ends(const StageContext& context, const Frame& frame, int32_t row, float cos, float sin,
                      const OrientedBox& box) noexcept {
  constexpr float kNear_m = 0.3f;       // most clusters have no corner so near to an edge
  constexpr float kFarthest_m = 20.0f;  // farther away, rows and columns may miss ends and sides
  CutEnds cut;
  const FrameClusterTable& merged = frame.merged;
  if (merged.nearest_m[row] > kFarthest_m) return cut;
  for_each_member(frame, row, [&](const SensorPart& part, int32_t) {
    const SensorModel& sensor = context.sensors[&part - frame.sensors];
    for (const bool is_left : {true, false}) {
      if (sensor.wraps) continue;
      const Edge edge = edge_of(sensor, is_left);
      if (!edge.is_ahead(merged.center_x_m[row], merged.center_y_m[row])) continue;
      const float outside_m = edge.outside_m(edge.x > 0.0f ? merged.max_x_m[row] : merged.min_x_m[row],
                                             edge.y > 0.0f ? merged.max_y_m[row] : merged.min_y_m[row],
                                             edge.z > 0.0f ? merged.max_z_m[row] : merged.min_z_m[row]);
      if (outside_m > 0.0f - kNear_m) find_cut_by(context, frame, row, part, edge, cos, sin, box, cut);
    }
  });
  return cut;
}

}  // namespace overtake
