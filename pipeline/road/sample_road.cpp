// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
#include "pipeline/road/sample_road.h"

#include <algorithm>
#include <cmath>

#include "core/math.h"

namespace overtake {
namespace {

constexpr float kKnownReach_m = 100.0f;  // of known stations along a ray
constexpr float kParabola_m = 100.0f;    // then its tangent
constexpr float kOuterReach_m = 0.8f;    // the cross slope goes on beyond the outer edge, to the wall

// The centre line as straight pieces between stations, relative to the ego vehicle, in the map's axes.
struct Line {
  int32_t first = 0, last = -1;  // stations with a place
  float x[RoadData::kStations], y[RoadData::kStations], left[RoadData::kStations], right[RoadData::kStations];
  float dx[RoadData::kStations], dy[RoadData::kStations], per_m2[RoadData::kStations];  // to the next station
};

void lay_line(const RoadData& road, Line& line) noexcept {
  const double length = road.map->length_m();
  line.first = RoadData::kStations;
  for (int32_t k = 0; k < RoadData::kStations; ++k) {
    const double s = road.s_m + (k - RoadData::kStations / 2) * RoadData::kStation_m;
    if (!road.map->closed() && (s < 0.0 || s > length)) continue;
    const MapPose at = road.map->at(s);
    line.first = std::min(line.first, k);
    line.last = k;
    line.x[k] = float(at.x_m - road.ego.pose.x_m);
    line.y[k] = float(at.y_m - road.ego.pose.y_m);
    line.left[k] = float(at.width_left_m);
    line.right[k] = float(at.width_right_m);
  }
  for (int32_t k = line.first; k < line.last; ++k) {
    line.dx[k] = line.x[k + 1] - line.x[k];
    line.dy[k] = line.y[k + 1] - line.y[k];
    const float length2 = line.dx[k] * line.dx[k] + line.dy[k] * line.dy[k];
    line.per_m2[k] = length2 > 1e-6f ? 1.0f / length2 : 0.0f;
  }
}

float mix(float a, float b, float weight) noexcept { return a + weight * (b - a); }

// Height of the road at a place relative to the ego vehicle, in the map's axes. `station`: where to begin; then the
// piece of the place. False where the heights are not known.
bool find_height(const RoadData& road, const Line& line, float x, float y, int32_t& station, float& height_m) noexcept {
  int32_t k = std::clamp(station, line.first, line.last - 1);
  const auto along = [&](int32_t i) {
    return ((x - line.x[i]) * line.dx[i] + (y - line.y[i]) * line.dy[i]) * line.per_m2[i];
  };
  float t = along(k);
  while (t > 1.0f && k + 1 < line.last) t = along(++k);
  while (t < 0.0f && k > line.first) t = along(--k);
  station = k;
  if (!road.known[k] || !road.known[k + 1]) return false;
  t = max_of(min_of(t, 1.0f), 0.0f);
  const float d =
      (line.dx[k] * (y - line.y[k]) - line.dy[k] * (x - line.x[k])) * float(std::sqrt(line.per_m2[k]));
  const float slope = mix(road.cross_slope[k], road.cross_slope[k + 1], t);
  const float left = mix(line.left[k], line.left[k + 1], t), right = mix(line.right[k], line.right[k + 1], t);
  const float reach = max_of(min_of(d, left + (slope < 0.0f ? kOuterReach_m : 0.0f)),
                             -right - (slope > 0.0f ? kOuterReach_m : 0.0f));
  height_m = mix(road.height_m[k], road.height_m[k + 1], t) - reach * slope;
  return true;
}

// The vehicle's axes in the map and the sensor's axes in the vehicle, in float.
struct Axes {
  float map[9];
  Transform mounting;
  float to_sensor_z(float vehicle_z, float x, float y) const noexcept {  // x, y in the sensor's axes
    return (vehicle_z - mounting.t[2] - mounting.r[6] * x - mounting.r[7] * y) / mounting.r[8];
  }
};

struct Ray {
  float heights_m[kNodes];  // z in the sensor's axes
};

// False: a station on the way is not known.
bool sample_known(const RoadData& road, const Line& line, const Axes& axes, float cosine, float sine,
                  float origin_m, Ray& ray) noexcept {
  const float *r = axes.map, *m = axes.mounting.r, *t = axes.mounting.t;
  int32_t station = RoadData::kStations / 2;
  float sensor_z = -t[2], vehicle_z = 0.0f, last_z = 0.0f;
  for (int32_t i = 0; i < kNodes; ++i) {
    const float distance = node_distance_m(i), x = distance * cosine, y = distance * sine;
    const float vx = m[0] * x + m[1] * y + m[2] * sensor_z + t[0], vy = m[3] * x + m[4] * y + m[5] * sensor_z + t[1];
    const float guess_z = vehicle_z + (vehicle_z - last_z);  // the height decides the place on a banked road
    float height_m;
    if (!find_height(road, line, r[0] * vx + r[1] * vy + r[2] * guess_z, r[3] * vx + r[4] * vy + r[5] * guess_z,
                     station, height_m)) {
      if (distance <= kKnownReach_m) return false;
      ray.heights_m[i] = 2.0f * ray.heights_m[i - 1] - ray.heights_m[i - 2];
      continue;
    }
    last_z = vehicle_z;
    vehicle_z = (height_m - r[6] * vx - r[7] * vy) / r[8] - origin_m;
    sensor_z = axes.to_sensor_z(vehicle_z, x, y);
    ray.heights_m[i] = sensor_z;
  }
  return true;
}

void sample_parabola(const Axes& axes, float bend, float cosine, float sine, Ray& ray) noexcept {
  const float *m = axes.mounting.r, *t = axes.mounting.t;
  for (int32_t i = 0; i < kNodes; ++i) {
    const float distance = node_distance_m(i), x = distance * cosine, y = distance * sine;
    const float ahead = abs_of(m[0] * x + m[1] * y + t[0]), near = min_of(ahead, kParabola_m);
    ray.heights_m[i] = axes.to_sensor_z(bend * near * (2.0f * ahead - near), x, y);
  }
}

}  // namespace

void sample_road(const RoadData& road, const SensorModel& sensor, const RoadSurface& surface) noexcept {
  Axes axes = {{1, 0, 0, 0, 1, 0, 0, 0, 1}, sensor.T_vehicle_sensor};
  if (abs_of(axes.mounting.r[8]) < 0.1f) axes.mounting.r[8] = 0.1f;  // a sensor on its side sees no road
  float bend = 0.0f, origin_m = 0.0f;
  Line line;
  bool has_line = false;
  if (road.has_pose) {
    for (int32_t i = 0; i < 9; ++i) axes.map[i] = float(road.ego.r[i]);
    const double speed = road.ego.pose.speed_mps;
    const double curvature = road.map ? road.curvature_per_m : speed > 5.0 ? road.ego.pose.yaw_rate_rps / speed : 0.0;
    double sine, cosine;
    sin_cos_f64(road.ego.pose.roll_rad, sine, cosine);
    bend = float(-0.5 * curvature * sine);
    has_line = road.map && road.ego.r[8] > 0.1;
  }
  if (has_line) {
    lay_line(road, line);
    int32_t station = RoadData::kStations / 2;
    has_line = line.last > line.first && find_height(road, line, 0.0f, 0.0f, station, origin_m);
    origin_m /= axes.map[8];
  }
  // The up axis of the map, in the sensor's axes.
  float up[3];
  const float *r = axes.map, *m = axes.mounting.r;
  for (int32_t i = 0; i < 3; ++i) up[i] = m[i] * r[6] + m[3 + i] * r[7] + m[6 + i] * r[8];
  if (abs_of(up[2]) < 0.1f) up[2] = 0.1f;

  const int32_t rays = count_rays(sensor.cols);
  for (int32_t k = 0; k < rays; ++k) {
    float sine, cosine;
    sin_cos_f32(float(wrap_angle(double(sensor.azimuth_left_rad) - double(k * kRayColumns) * double(sensor.pitch_rad))),
                sine, cosine);
    Ray ray;
    const bool known = has_line && sample_known(road, line, axes, cosine, sine, origin_m, ray);
    if (!known) sample_parabola(axes, bend, cosine, sine, ray);
    surface.known[k] = known ? 1.0f : 0.0f;
    surface.level_slope[k] = -(up[0] * cosine + up[1] * sine) / up[2];
    float *offset_m = surface.offset_m + k * kNodes, *slope = surface.slope + k * kNodes;
    for (int32_t i = 0; i + 1 < kNodes; ++i) {
      slope[i] = (ray.heights_m[i + 1] - ray.heights_m[i]) / (node_distance_m(i + 1) - node_distance_m(i));
      offset_m[i] = ray.heights_m[i] - slope[i] * node_distance_m(i);
    }
    slope[kNodes - 1] = slope[kNodes - 2];
    offset_m[kNodes - 1] = offset_m[kNodes - 2];
  }
}

}  // namespace overtake
