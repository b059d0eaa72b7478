// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
#include "pipeline/road/sample_road.h"

#include <algorithm>
#include <cmath>

#include "core/math.h"
#include "kernels/running_ground_pixel.h"

namespace overtake {
namespace {

constexpr float kKnownReach_m = 100.0f;  // of known stations along a ray
constexpr float kVerge_m = 6.0f;         // a ray that is farther outside of the road goes on level
constexpr float kOuterReach_m = 0.8f;    // the cross slope goes on beyond the outer edge, to the wall

// The centre line as straight pieces between stations, relative to the ego vehicle, in the map's axes.
struct Line {
  int32_t first = 0, last = -1;  // stations with a place
  float x[RoadData::kStations], y[RoadData::kStations], left[RoadData::kStations], right[RoadData::kStations];
  float dx[RoadData::kStations], dy[RoadData::kStations];  // to the next station
  float per_m[RoadData::kStations], per_m2[RoadData::kStations];
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
    line.per_m[k] = std::sqrt(line.per_m2[k]);
  }
}

float mix(float a, float b, float weight) noexcept { return a + weight * (b - a); }

// Height of the road at a place relative to the ego vehicle, in the map's axes. `station`: where to begin; then the
// piece of the place. `outside_m`: distance from the road. False where the heights are not known.
bool find_height(const RoadData& road, const Line& line, float x, float y, int32_t& station, float& height_m,
                 float& outside_m) noexcept {
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
  const float d = (line.dx[k] * (y - line.y[k]) - line.dy[k] * (x - line.x[k])) * line.per_m[k];
  const float slope = mix(road.cross_slope[k], road.cross_slope[k + 1], t);
  const float left = mix(line.left[k], line.left[k + 1], t), right = mix(line.right[k], line.right[k + 1], t);
  const float reach = max_of(min_of(d, left + (slope < 0.0f ? kOuterReach_m : 0.0f)),
                             -right - (slope > 0.0f ? kOuterReach_m : 0.0f));
  height_m = mix(road.height_m[k], road.height_m[k + 1], t) - reach * slope;
  outside_m = abs_of(d - reach);
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
  float sensor_z = -t[2], vehicle_z = 0.0f, last_z = 0.0f, height_m = 0.0f, outside_m = 0.0f;
  for (int32_t i = 0; i < kNodes; ++i) {
    const float distance = node_distance_m(i), x = distance * cosine, y = distance * sine;
    const float vx = m[0] * x + m[1] * y + m[2] * sensor_z + t[0], vy = m[3] * x + m[4] * y + m[5] * sensor_z + t[1];
    const float guess_z = vehicle_z + (vehicle_z - last_z);  // the height decides the place on a banked road
    if (outside_m <= kVerge_m &&
        !find_height(road, line, r[0] * vx + r[1] * vy + r[2] * guess_z, r[3] * vx + r[4] * vy + r[5] * guess_z, station,
                     height_m, outside_m)) {
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

// The shape of a road that is not known, in the vehicle frame: z = a + b x + c n + q x^2 + e x n with n the distance from
// the vehicle's lane, which bends by `curvature`. Beyond kBend_m it goes on straight, beyond kLane_m it is as at the edge.
constexpr int32_t kTerms = 5;
struct RoadShape {
  double term[kTerms] = {};  // a, b, c, q, e
  double curvature = 0;

  static constexpr double kBend_m = 100.0, kLane_m = 12.0;
  double lane_offset(double x, double y) const noexcept {
    const double near = std::clamp(x, -kBend_m, kBend_m);
    return y - 0.5 * curvature * near * (2.0 * x - near);
  }
  double height(double x, double y) const noexcept {
    const double near = std::clamp(x, -kBend_m, kBend_m), n = std::clamp(lane_offset(x, y), -kLane_m, kLane_m);
    return term[0] + term[1] * x + term[2] * n + term[3] * near * (2.0 * x - near) + term[4] * near * n;
  }
};

// Points on the road, of one scan.
struct RoadPoints {
  static constexpr int32_t kCapacity = 4096;
  int32_t count = 0;
  float x[kCapacity], n[kCapacity], z[kCapacity];
};

// Walks up some columns like running_ground, over the shape so far, and collects the ground near the vehicle's lane.
void collect_ground(const RunningGroundParams& params, const Axes& axes, const SensorModel& sensor,
                    Plane<const float> range_m, Plane<const float> elevation_rad, const RoadShape& shape, float reach_m,
                    RoadPoints& points) noexcept {
  constexpr int32_t kColumns = 20;
  constexpr float kLane_m = 6.0f;
  const float *m = axes.mounting.r, *t = axes.mounting.t;
  const GroundBlock block = make_ground_block(params, false);
  points.count = 0;
  const int32_t stride = std::max(1, sensor.cols / kColumns);
  for (int32_t c = stride / 2; c < sensor.cols; c += stride) {
    float sine, cosine;
    sin_cos_f32(float(wrap_angle(double(sensor.azimuth_left_rad) - (c + 0.5) * double(sensor.pitch_rad))), sine,
                cosine);
    GroundState<float> state = start_ground(axes.to_sensor_z(float(shape.height(double(t[0]), double(t[1]))), 0.0f, 0.0f));
    bool below = false;
    for (int32_t r = range_m.rows - 1; r >= 0; --r) {
      const float range = range_m.row(r)[c];
      const bool exists = range > 0.0f;
      float up, level;
      sin_cos_small_f32(elevation_rad.row(r)[c], up, level);
      const float distance = range * level, sensor_z = range * up, sx = distance * cosine, sy = distance * sine;
      const float x = m[0] * sx + m[1] * sy + m[2] * sensor_z + t[0], y = m[3] * sx + m[4] * sy + m[5] * sensor_z + t[1];
      const float road_z = axes.to_sensor_z(float(shape.height(double(x), double(y))), sx, sy);
      const auto pixel = walk_ground(block, distance, sensor_z, road_z, 0.0f, exists, below, state);
      below = exists;
      const float n = float(shape.lane_offset(double(x), double(y)));
      if (!pixel.ground || state.distance != distance || abs_of(x) > reach_m || abs_of(n) > kLane_m) continue;
      if (points.count == RoadPoints::kCapacity) return;
      points.x[points.count] = x;
      points.n[points.count] = n;
      points.z[points.count++] = m[6] * sx + m[7] * sy + m[8] * sensor_z + t[2];
    }
  }
}

// Least squares over the points within trim_m of the shape, each 5 m of x with the same weight. False: too few points.
bool fit_shape(const RoadPoints& points, double trim_m, RoadShape& shape) noexcept {
  constexpr int32_t kBins = 40, kFewest = 24, kFewestBins = 3;
  constexpr double kBin_m = 5.0, kSigma_m = 0.03;
  constexpr double kPrior[kTerms] = {0.1, 0.02, 0.02, 5e-4, 2e-3};  // standard deviations from the level road
  const auto bin_of = [](float x) { return std::clamp(int32_t(x / kBin_m + 0.5 * kBins), 0, kBins - 1); };
  int32_t of_bin[kBins] = {}, used = 0, bins = 0;
  const auto is_near = [&](int32_t i) {
    const double x = double(points.x[i]), n = double(points.n[i]);
    const double* p = shape.term;
    return std::fabs(p[0] + p[1] * x + p[2] * n + p[3] * x * x + p[4] * x * n - double(points.z[i])) <= trim_m;
  };
  for (int32_t i = 0; i < points.count; ++i)
    if (is_near(i)) {
      ++used;
      bins += of_bin[bin_of(points.x[i])]++ == 0;
    }
  if (used < kFewest || bins < kFewestBins) return false;
  double a[kTerms][kTerms + 1] = {};
  for (int32_t k = 0; k < kTerms; ++k) a[k][k] = kSigma_m * kSigma_m / (kPrior[k] * kPrior[k]);
  for (int32_t i = 0; i < points.count; ++i) {
    if (!is_near(i)) continue;
    const double x = double(points.x[i]), n = double(points.n[i]), weight = 1.0 / of_bin[bin_of(points.x[i])];
    const double basis[kTerms + 1] = {1.0, x, n, x * x, x * n, double(points.z[i])};
    for (int32_t row = 0; row < kTerms; ++row)
      for (int32_t col = row; col <= kTerms; ++col) a[row][col] += weight * basis[row] * basis[col];
  }
  // Symmetric and positive definite by the prior: elimination without pivots.
  for (int32_t k = 0; k < kTerms; ++k)
    for (int32_t row = k + 1; row < kTerms; ++row) {
      const double factor = a[k][row] / a[k][k];
      for (int32_t col = row; col <= kTerms; ++col) a[row][col] -= factor * a[k][col];
    }
  for (int32_t k = kTerms - 1; k >= 0; --k) {
    double value = a[k][kTerms];
    for (int32_t col = k + 1; col < kTerms; ++col) value -= a[k][col] * shape.term[col];
    shape.term[k] = value / a[k][k];
  }
  return true;
}

// Fits the shape to the scan's own ground, from near to far.
void fit_road(const RunningGroundParams& params, const Axes& axes, const SensorModel& sensor,
              Plane<const float> range_m, Plane<const float> elevation_rad, RoadShape& shape) noexcept {
  constexpr struct {
    float reach_m;
    double trim_m;
  } kPass[] = {{30.0f, 0.5}, {60.0f, 0.3}, {100.0f, 0.3}};
  RoadPoints points;
  for (const auto& pass : kPass) {
    collect_ground(params, axes, sensor, range_m, elevation_rad, shape, pass.reach_m, points);
    if (!fit_shape(points, pass.trim_m, shape)) return;
  }
}

void sample_shape(const Axes& axes, const RoadShape& shape, float cosine, float sine, Ray& ray) noexcept {
  const float *m = axes.mounting.r, *t = axes.mounting.t;
  float sensor_z = -t[2];
  for (int32_t i = 0; i < kNodes; ++i) {
    const float distance = node_distance_m(i), x = distance * cosine, y = distance * sine;
    const float vx = m[0] * x + m[1] * y + m[2] * sensor_z + t[0], vy = m[3] * x + m[4] * y + m[5] * sensor_z + t[1];
    sensor_z = axes.to_sensor_z(float(shape.height(double(vx), double(vy))), x, y);
    ray.heights_m[i] = sensor_z;
  }
}

}  // namespace

void sample_road(const RunningGroundParams& params, const RoadData& road, const SensorModel& sensor,
                 Plane<const float> range_filled_m, Plane<const float> elevation_filled_rad,
                 const RoadSurface& surface) noexcept {
  Axes axes = {{1, 0, 0, 0, 1, 0, 0, 0, 1}, sensor.T_vehicle_sensor};
  if (abs_of(axes.mounting.r[8]) < 0.1f) axes.mounting.r[8] = 0.1f;  // a sensor on its side sees no road
  float origin_m = 0.0f, outside_m = 0.0f;
  RoadShape shape;
  bool fitted = false;
  Line line;
  bool has_line = false;
  if (road.has_pose) {
    for (int32_t i = 0; i < 9; ++i) axes.map[i] = float(road.ego.r[i]);
    const double speed = road.ego.pose.speed_mps;
    const double curvature = road.map ? road.curvature_per_m : speed > 5.0 ? road.ego.pose.yaw_rate_rps / speed : 0.0;
    shape.curvature = std::clamp(curvature, -0.02, 0.02);
    has_line = road.map && road.ego.r[8] > 0.1;
  }
  if (has_line) {
    lay_line(road, line);
    int32_t station = RoadData::kStations / 2;
    has_line = line.last > line.first && find_height(road, line, 0.0f, 0.0f, station, origin_m, outside_m);
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
    if (!known) {
      if (!fitted) fit_road(params, axes, sensor, range_filled_m, elevation_filled_rad, shape);
      fitted = true;
      sample_shape(axes, shape, cosine, sine, ray);
    }
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
