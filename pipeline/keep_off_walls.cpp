// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// Without a map, the walls that the sensors see take the place of the circuit's bounds: what lies along a wall is a
// piece of it, and what a sensor sees over a wall is not on the track.
#include <algorithm>
#include <cmath>

#include "core/math.h"
#include "pipeline/body_look.h"
#include "pipeline/nearest_walls.h"

namespace overtake {
namespace {

constexpr int32_t kMostRead = 8192;  // points of walls, of one sensor
constexpr float kBehind_m = 1.0f;    // farther behind the wall is not on the track; nearer stands on the wall
constexpr float kReach_m = 10.0f, kReachOfRange = 0.2f;  // from a candidate, of the points that give the wall's line
constexpr int32_t kFewest = 4;                           // of these points
constexpr float kShortest_m = 5.0f, kBeyond_m = 5.0f;    // length of the line, and how far it goes on
constexpr float kScatter_m = 0.3f;                       // root mean square of their distances from the line, at most
constexpr int32_t kMostTested = 64;                      // points of a candidate

// The nearest point of a wall in each direction from a sensor.
class WallView {
 public:
  WallView(const StageContext& context, const Frame& frame, int32_t sensor)
      : at_m_(context.sensors[sensor].T_vehicle_sensor.t) {
    NearestWall nearest[kWallDirections];
    find_nearest_walls(context, frame, sensor, kMostRead, true, nearest);
    const ClusterPointTable& points = frame.sensors[sensor].cluster_points;
    for (int32_t b = 0; b < kWallDirections; ++b) {
      const int32_t row = row_of(nearest[b]);
      range_m2_[b] = row < 0 ? kNone_m2 : range2_of(nearest[b]);
      if (row < 0) continue;
      x_m_[b] = points.x_m[row], y_m_[b] = points.y_m[row];
      empty_ = false;
    }
  }

  bool empty() const { return empty_; }
  // Whether the wall is between the sensor and a point.
  bool hides(float x, float y) const {
    const float dx = x - at_m_[0], dy = y - at_m_[1];
    const float nearest_m2 = range_m2_[wall_direction_of(dx, dy)], before_m = std::sqrt(dx * dx + dy * dy) - kBehind_m;
    return before_m > 0.0f && nearest_m2 < before_m * before_m;
  }

  // A straight line through the wall around a place. The sensor is on its left.
  struct Line {
    bool valid = false;
    float x_m, y_m, cos, sin, low_m, high_m;
    float left_of(float x, float y) const { return (y - y_m) * cos - (x - x_m) * sin; }
    // What stands on the wall, as a fence does, is a little farther than its foot.
    bool is_on(float x, float y, float most_m) const {
      const float along = (x - x_m) * cos + (y - y_m) * sin, left = left_of(x, y);
      return left <= most_m && left >= -(kBehind_m + most_m) && along >= low_m - kBeyond_m &&
             along <= high_m + kBeyond_m;
    }
  };
  Line line_around(float x, float y) const {
    const float reach = kReach_m + kReachOfRange * std::sqrt(x * x + y * y);
    int32_t near[kWallDirections], count = 0;
    float sum_x = 0.0f, sum_y = 0.0f, xx = 0.0f, xy = 0.0f, yy = 0.0f;  // relative to the place
    for (int32_t b = 0; b < kWallDirections; ++b) {
      const float dx = x_m_[b] - x, dy = y_m_[b] - y;
      if (range_m2_[b] == kNone_m2 || dx * dx + dy * dy > reach * reach) continue;
      near[count++] = b;
      sum_x += dx, sum_y += dy;
      xx += dx * dx, xy += dx * dy, yy += dy * dy;
    }
    Line line;
    if (count < kFewest) return line;
    const float n = float(count), mean_x = sum_x / n, mean_y = sum_y / n;
    const float a = xx / n - mean_x * mean_x, b = xy / n - mean_x * mean_y, c = yy / n - mean_y * mean_y;
    const float half = 0.5f * (a - c), root = std::sqrt(half * half + b * b);
    // The eigenvector of the larger variance, in the form that loses no digits.
    const float u = half >= 0.0f ? root + half : abs_of(b),
                v = half >= 0.0f ? b : (b < 0.0f ? half - root : root - half);
    const float size = std::sqrt(u * u + v * v);
    if (!(size > 0.0f) || 0.5f * (a + c) - root > kScatter_m * kScatter_m) return line;
    line = {true, x + mean_x, y + mean_y, u / size, v / size, 0.0f, 0.0f};
    if (line.left_of(at_m_[0], at_m_[1]) < 0.0f) line.cos = -line.cos, line.sin = -line.sin;
    for (int32_t k = 0; k < count; ++k) {
      const float along = (x_m_[near[k]] - line.x_m) * line.cos + (y_m_[near[k]] - line.y_m) * line.sin;
      line.low_m = min_of(line.low_m, along), line.high_m = max_of(line.high_m, along);
    }
    line.valid = line.high_m - line.low_m >= kShortest_m;
    return line;
  }

 private:
  static constexpr float kNone_m2 = 1e30f;

  const float* at_m_;
  bool empty_ = true;
  float range_m2_[kWallDirections], x_m_[kWallDirections], y_m_[kWallDirections];
};

// A piece of a wall that the sensor sees at a grazing angle: deep along the line of sight, and narrow across it. A car
// shows its width, unless the shadow of the own car cuts it off.
bool is_streak(const StageContext& context, const Frame& frame, int32_t row) {
  constexpr float kDepthOfWidth = 4.0f, kCarShare = 0.6f;
  const float* const at_m = context.sensors[frame.merged.main_sensor[row]].T_vehicle_sensor.t;
  const float x = frame.merged.center_x_m[row] - at_m[0], y = frame.merged.center_y_m[row] - at_m[1];
  const float range_m = std::sqrt(x * x + y * y);
  if (!(range_m > 0.0f)) return false;
  const OrientedBox box = measure_box(frame, row, x / range_m, y / range_m);
  return box.length() > context.detect.pose_by_view.debris_m && box.length() >= kDepthOfWidth * box.width() &&
         box.width() < kCarShare * float(context.detect.vehicle_width_m) && !is_in_own_shadow(context, frame, row);
}

// Whether `is` holds for the points of a candidate; of many points, for some that are spread over it. False if the
// sensor has none: `sensor` -1 means every sensor.
template <class F>
bool holds_for_points(const Frame& frame, int32_t row, int32_t sensor, F&& is) {
  bool any = false, all = true;
  for_each_member(frame, row, [&](const SensorPart& part, int32_t cluster) {
    if (sensor >= 0 && &part != &frame.sensors[sensor]) return;
    const int32_t begin = part.clusters.point_begin[cluster], count = part.clusters.point_count[cluster];
    const int32_t step = std::max(1, count / kMostTested);
    for (int32_t k = begin; all && k < begin + count; k += step) {
      any = true;
      all = is(part.cluster_points.x_m[k], part.cluster_points.y_m[k]);
    }
  });
  return any && all;
}

}  // namespace

void keep_off_walls(const StageContext& context, Frame& frame) noexcept {
  const float wall_m = context.detect.gate_cars.wall_m;
  int32_t* const on_wall = frame.places.group;
  bool any = false;
  for (int32_t i = 0; i < frame.kept_count; ++i) {
    const int32_t row = frame.kept[i];
    on_wall[row] = 0;
    if (!(wall_m > 0.0f) || has_bounds(frame.places, row)) continue;
    on_wall[row] = is_streak(context, frame, row);
    any = any || !on_wall[row];
  }
  for (int32_t s = 0; any && s < context.sensor_count; ++s) {
    if (!frame.sensors[s].present) continue;
    const WallView walls(context, frame, s);
    if (walls.empty()) continue;
    for (int32_t i = 0; i < frame.kept_count; ++i) {
      const int32_t row = frame.kept[i];
      if (on_wall[row] || has_bounds(frame.places, row)) continue;
      on_wall[row] = frame.merged.main_sensor[row] == s &&
                     holds_for_points(frame, row, s, [&](float x, float y) { return walls.hides(x, y); });
      if (on_wall[row]) continue;
      const WallView::Line line = walls.line_around(frame.merged.center_x_m[row], frame.merged.center_y_m[row]);
      on_wall[row] =
          line.valid && holds_for_points(frame, row, -1, [&](float x, float y) { return line.is_on(x, y, wall_m); });
    }
  }
  int32_t count = 0;
  for (int32_t i = 0; i < frame.kept_count; ++i)
    if (!on_wall[frame.kept[i]]) frame.kept[count++] = frame.kept[i];
  frame.gated_map += frame.kept_count - count;
  frame.kept_count = count;
}

}  // namespace overtake
