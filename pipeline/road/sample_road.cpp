// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
#include "pipeline/road/sample_road.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "core/math.h"
#include "kernels/fit_road.h"
#include "pipeline/road/centre_line.h"

namespace overtake {
namespace {

constexpr float kKnownReach_m = 100.0f;  // of known stations along a ray
constexpr float kEdge_m = 1.0f;          // beyond it the ground is not the road
constexpr float kVerge_m = 6.0f;         // a ray that is farther outside of the road goes on level
constexpr float kNearBound_m = 0.5f;     // no bound is nearer
constexpr float kLeastLane_m = 30.0f;    // of known heights that show how a sensor is tilted
constexpr float kOuterReach_m = 6.0f;    // the cross slope goes on beyond the outer edge, to the wall

static_assert(RoadData::kStations <= CentreLine::kMost);

float mix(float a, float b, float weight) noexcept { return a + weight * (b - a); }

// Height of the road at a place relative to the ego vehicle, in the map's axes. `station`: where to begin; then the
// piece of the place. `outside_m`: distance from the road, below 0 on it. False where the heights are not known;
// kExpected: they may also be expected.
template <bool kExpected>
OVT_INLINE bool find_height(const RoadData& road, const CentreLine& line, float x, float y, int32_t& station,
                            float& height_m, float& outside_m) noexcept {
  const float beside = line.find_piece(x, y, station);
  const int32_t k = station;
  if (!kExpected && (!road.known[k] || !road.known[k + 1])) return false;
  const float t = max_of(min_of(beside, 1.0f), 0.0f);
  const float d = line.measure_left(x, y, k);
  const float slope = mix(road.cross_slope[k], road.cross_slope[k + 1], t);
  const float left = mix(line.left_m[k], line.left_m[k + 1], t), right = mix(line.right_m[k], line.right_m[k + 1], t);
  const float reach =
      max_of(min_of(d, left + (slope < 0.0f ? kOuterReach_m : 0.0f)), -right - (slope > 0.0f ? kOuterReach_m : 0.0f));
  height_m = mix(road.height_m[k], road.height_m[k + 1], t) - reach * slope;
  outside_m = max_of(d - left, -right - d);
  return true;
}

// Rays side by side: along a ray each node waits for the one before it, so the walks of several rays overlap, and
// compilers make vectors of the loops over `l`.
constexpr int32_t kTogether = 28;
struct Rays {
  float cosine[kTogether], sine[kTogether];
  bool known[kTogether];
  float known_m[kTogether];            // where the ray leaves the road
  float bound_per_m[kTogether];        // 1 / distance at which it passes the bound; 0: none that is known
  float last_bound_per_m[kTogether];   // the same for the last time
  float heights_m[kNodes][kTogether];  // z in the sensor's axes
};

// Samples the known road, or the expected one; rays.known is false where a station on the way is not known. known_m is
// the distance at which the ray leaves the road.
template <bool kExpected>
void sample_stations(const RoadData& road, const CentreLine& line, const RoadAxes& axes, float origin_m,
                     Rays& rays) noexcept {
  const float *r = axes.map, *m = axes.mounting.r, *t = axes.mounting.t;
  int32_t station[kTogether];
  float sensor_z[kTogether], vehicle_z[kTogether], last_z[kTogether], height_m[kTogether], outside_m[kTogether];
  for (int32_t l = 0; l < kTogether; ++l) {
    rays.known[l] = true;
    rays.known_m[l] = 1e9f;
    rays.bound_per_m[l] = rays.last_bound_per_m[l] = 0.0f;
    station[l] = RoadData::kStations / 2;
    sensor_z[l] = -t[2];
    vehicle_z[l] = last_z[l] = height_m[l] = outside_m[l] = 0.0f;
  }
  for (int32_t i = 0; i < kNodes; ++i) {
    const float distance = node_distance_m(i);
    float x[kTogether], y[kTogether], vx[kTogether], vy[kTogether], map_x[kTogether], map_y[kTogether];
    for (int32_t l = 0; l < kTogether; ++l) {
      x[l] = distance * rays.cosine[l], y[l] = distance * rays.sine[l];
      vx[l] = m[0] * x[l] + m[1] * y[l] + m[2] * sensor_z[l] + t[0];
      vy[l] = m[3] * x[l] + m[4] * y[l] + m[5] * sensor_z[l] + t[1];
      const float guess_z = vehicle_z[l] + (vehicle_z[l] - last_z[l]);  // the height decides the place on a banked road
      map_x[l] = r[0] * vx[l] + r[1] * vy[l] + r[2] * guess_z;
      map_y[l] = r[3] * vx[l] + r[4] * vy[l] + r[5] * guess_z;
    }
    bool skips[kTogether] = {}, any_skips = false;
    float before_m[kTogether];  // outside_m of the node before
    std::copy_n(outside_m, kTogether, before_m);
    for (int32_t l = 0; l < kTogether; ++l) {
      if (!rays.known[l] || !(outside_m[l] <= kVerge_m) ||
          find_height<kExpected>(road, line, map_x[l], map_y[l], station[l], height_m[l], outside_m[l]))
        continue;
      if (distance <= kKnownReach_m)
        rays.known[l] = false;
      else
        skips[l] = any_skips = true;
    }
    const float step_m = distance - node_distance_m(std::max(i - 1, 0));
    for (int32_t l = 0; l < kTogether; ++l) {
      if (outside_m[l] > kEdge_m) rays.known_m[l] = min_of(rays.known_m[l], distance);
      if (i == 0 || before_m[l] >= 0.0f || outside_m[l] < 0.0f) continue;
      rays.last_bound_per_m[l] =
          1.0f / max_of(distance - step_m * outside_m[l] / (outside_m[l] - before_m[l]), kNearBound_m);
      if (rays.bound_per_m[l] == 0.0f) rays.bound_per_m[l] = rays.last_bound_per_m[l];
    }
    const float *const before = rays.heights_m[std::max(i - 1, 0)], *const first = rays.heights_m[std::max(i - 2, 0)];
    float* const now = rays.heights_m[i];
    float next_z[kTogether];
    for (int32_t l = 0; l < kTogether; ++l) {
      next_z[l] = (height_m[l] - r[6] * vx[l] - r[7] * vy[l]) / r[8] - origin_m;
      now[l] = axes.to_sensor_z(next_z[l], x[l], y[l]);
    }
    if (!any_skips) {
      for (int32_t l = 0; l < kTogether; ++l) {
        last_z[l] = vehicle_z[l];
        vehicle_z[l] = next_z[l];
        sensor_z[l] = now[l];
      }
      continue;
    }
    for (int32_t l = 0; l < kTogether; ++l) {
      if (skips[l]) {
        now[l] = 2.0f * before[l] - first[l];
      } else {
        last_z[l] = vehicle_z[l];
        vehicle_z[l] = next_z[l];
        sensor_z[l] = now[l];
      }
    }
  }
}

// The road along the vehicle's lane, in the vehicle frame: as the map lets expect it (kMap), or where its heights are
// known (kLearned).
void expect_road(const RoadData& road, const CentreLine& line, const float* r, float origin_m,
                 ExpectedRoad::Source source, RoadShape& shape) noexcept {
  constexpr float kBeside_m = 4.0f;  // to either side of the lane: the cross slope
  constexpr float kMost_m = 100.0f;  // a vehicle on its side has no road ahead
  ExpectedRoad& expected = shape.expected;
  if (source == ExpectedRoad::Source::kLearned) expected.from_m = expected.to_m = 0.0f;
  int32_t station = RoadData::kStations / 2;
  // The height of the vehicle's plane at which a place of it is on the road. False: it is not known.
  const auto find_z = [&](float x, float y, float guess_z, float& z) {
    const float map_x = r[0] * x + r[1] * y + r[2] * guess_z, map_y = r[3] * x + r[4] * y + r[5] * guess_z;
    float height_m = 0.0f, outside_m = 0.0f;
    const bool known = source == ExpectedRoad::Source::kLearned
                           ? find_height<false>(road, line, map_x, map_y, station, height_m, outside_m)
                           : find_height<true>(road, line, map_x, map_y, station, height_m, outside_m);
    const float at = (height_m - r[6] * x - r[7] * y) / r[8] - origin_m;
    z = max_of(min_of(at, kMost_m), -kMost_m);
    return known;
  };
  constexpr int32_t kHere = int32_t(-ExpectedRoad::kFirst_m / ExpectedRoad::kStep_m);
  const auto walk = [&](int32_t first, int32_t step) {  // away from the vehicle, whose place is known
    float guess_z = 0.0f, climb_m = 0.0f;
    bool ends = false;  // beyond the last known place: straight on
    for (int32_t i = first; i >= 0 && i < ExpectedRoad::kPlaces; i += step) {
      const float x = ExpectedRoad::kFirst_m + float(i) * ExpectedRoad::kStep_m;
      const float y = -shape.lane_offset(x, 0.0f);
      float left_z = 0.0f, right_z = 0.0f;
      ends = ends || !find_z(x, y + kBeside_m, guess_z, left_z) || !find_z(x, y - kBeside_m, guess_z, right_z);
      if (ends) {
        expected.base_m[i] = guess_z += climb_m;
        expected.twist[i] = i == first ? 0.0f : expected.twist[i - step];
        continue;
      }
      if (source == ExpectedRoad::Source::kLearned) (step > 0 ? expected.to_m : expected.from_m) = x;
      expected.base_m[i] = 0.5f * (left_z + right_z);
      expected.twist[i] = (left_z - right_z) * (0.5f / kBeside_m);
      climb_m = i == first ? 0.0f : expected.base_m[i] - guess_z;
      guess_z = expected.base_m[i];
    }
  };
  walk(kHere, 1);
  station = RoadData::kStations / 2;
  walk(kHere - 1, -1);
  station = RoadData::kStations / 2;
  line.find_piece(0.0f, 0.0f, station);
  const float d = line.measure_left(0.0f, 0.0f, station), slope = road.cross_slope[station];
  expected.left_m = max_of(line.left_m[station] - d, 0.0f) + (slope < 0.0f ? kOuterReach_m : 0.0f);
  expected.right_m = max_of(line.right_m[station] + d, 0.0f) + (slope > 0.0f ? kOuterReach_m : 0.0f);
  if (!road.faces_along) std::swap(expected.left_m, expected.right_m);
  expected.source = source;
}

// The road along the vehicle's lane without a map, in the vehicle frame. Behind, the vehicle stood on it. Ahead, and
// farther behind, its bank goes on along the bend: a bend lies in a level plane, so a banked one leaves the vehicle's
// plane, by `bend` times the square of the distance.
void expect_way(const RoadData& road, RoadShape& shape) noexcept {
  constexpr float kBeside_m = 6.0f;  // so far to either side of the way its cross slope goes on
  const double* const r = road.ego.r;
  const double level = std::sqrt(r[0] * r[0] + r[3] * r[3]);
  if (!(level > 0.1)) return;  // a vehicle on its nose has no bend
  const float bend = float(0.5 * double(shape.curvature) * (r[0] * r[5] - r[3] * r[2]) / level);
  ExpectedRoad& expected = shape.expected;
  struct Node {
    float x, base_m, twist;
  };
  Node from = {0.0f, 0.0f, 0.0f}, to = from;
  int32_t next = 0;
  constexpr int32_t kHere = int32_t(-ExpectedRoad::kFirst_m / ExpectedRoad::kStep_m);
  for (int32_t i = kHere; i >= 0; --i) {
    const float x = ExpectedRoad::kFirst_m + float(i) * ExpectedRoad::kStep_m;
    while (to.x > x && next < road.way_count) {
      const RoadData::WayPlace& place = road.way[next++];
      from = to;
      const float n = shape.lane_offset(place.x_m, place.y_m);
      to = {place.x_m, place.z_m - place.slope * n, place.slope};
    }
    const float t = to.x < x ? (x - from.x) / (to.x - from.x) : 1.0f;
    const float beyond = to.x > x ? bend * (x * x - to.x * to.x) : 0.0f;
    expected.base_m[i] = mix(from.base_m, to.base_m, t) + beyond;
    expected.twist[i] = mix(from.twist, to.twist, t);
  }
  for (int32_t i = kHere + 1; i < ExpectedRoad::kPlaces; ++i) {
    const float x = ExpectedRoad::kFirst_m + float(i) * ExpectedRoad::kStep_m;
    expected.base_m[i] = bend * x * x;
    expected.twist[i] = 0.0f;
  }
  expected.left_m = expected.right_m = kBeside_m;
  expected.source = ExpectedRoad::Source::kWay;
}

// Turns and lifts the sensor until its ground lies on the known road: its mounting is known to half a degree, the
// pitch of the ego pose to a tenth, and a tenth is 0.17 m at 100 m.
void level_sensor(const RoadShape& ground, RoadAxes& axes) noexcept {
  const float a = ground.term[0], b = ground.term[1], c = ground.term[2];
  float *m = axes.mounting.r, *t = axes.mounting.t;
  for (int32_t i = 0; i < 3; ++i) m[6 + i] -= b * m[i] + c * m[3 + i];
  t[2] -= a + b * t[0] + c * t[1];
}

// Takes what lies on the road. Beside it the fitted shape goes on: it knows the apron better than the map does.
void take_road(const Rays& expected, Rays& rays) noexcept {
  for (int32_t i = 0; i < kNodes; ++i)
    for (int32_t l = 0; l < kTogether; ++l)
      if (node_distance_m(i) < expected.known_m[l]) rays.heights_m[i][l] = expected.heights_m[i][l];
  std::copy_n(expected.known_m, kTogether, rays.known_m);
  std::copy_n(expected.bound_per_m, kTogether, rays.bound_per_m);
  std::copy_n(expected.last_bound_per_m, kTogether, rays.last_bound_per_m);
}

// A node of the rays in the sensor's axes, where its z is known, and a height of the shape there, in the vehicle frame.
struct NodeOnShape {
  float x[kTogether], y[kTogether], height_m[kTogether];

  template <class HeightAt>
  NodeOnShape(const RoadAxes& axes, const RoadShape& shape, const Rays& rays, int32_t node, const float* z,
              HeightAt&& height_at) noexcept {
    const float *m = axes.mounting.r, *t = axes.mounting.t;
    const float distance = node_distance_m(node);
    float vx[kTogether], vy[kTogether];
    for (int32_t l = 0; l < kTogether; ++l) {
      x[l] = distance * rays.cosine[l], y[l] = distance * rays.sine[l];
      vx[l] = m[0] * x[l] + m[1] * y[l] + m[2] * z[l] + t[0];
      vy[l] = m[3] * x[l] + m[4] * y[l] + m[5] * z[l] + t[1];
    }
    for (int32_t l = 0; l < kTogether; ++l) height_m[l] = height_at(vx[l], shape.lane_offset(vx[l], vy[l]));
  }
};

void sample_shape(const RoadAxes& axes, const RoadShape& shape, Rays& rays) noexcept {
  float sensor_z[kTogether];
  for (int32_t l = 0; l < kTogether; ++l) sensor_z[l] = -axes.mounting.t[2];
  for (int32_t i = 0; i < kNodes; ++i) {
    const NodeOnShape node(axes, shape, rays, i, sensor_z, [&](float x, float n) { return shape.height_at(x, n); });
    for (int32_t l = 0; l < kTogether; ++l)
      rays.heights_m[i][l] = sensor_z[l] = axes.to_sensor_z(node.height_m[l], node.x[l], node.y[l]);
  }
}

// Adds what the scan's ground differs from the expected road.
void add_difference(const RoadAxes& axes, const RoadShape& shape, Rays& rays) noexcept {
  for (int32_t i = 0; i < kNodes; ++i) {
    const NodeOnShape node(axes, shape, rays, i, rays.heights_m[i],
                           [&](float x, float n) { return shape.difference_at(x, n); });
    for (int32_t l = 0; l < kTogether; ++l) rays.heights_m[i][l] += node.height_m[l] / axes.mounting.r[8];
  }
}

}  // namespace

void sample_road(const KernelTable& kernels, const RunningGroundParams& params, const RoadData& road,
                 const SensorModel& sensor, Plane<const float> range_filled_m, Plane<const float> elevation_filled_rad,
                 const RoadSurface& surface, ColumnSpan columns) noexcept {
  RoadAxes axes = {{1, 0, 0, 0, 1, 0, 0, 0, 1}, sensor.T_vehicle_sensor};
  if (abs_of(axes.mounting.r[8]) < 0.1f) axes.mounting.r[8] = 0.1f;  // a sensor on its side sees no road
  float origin_m = 0.0f, outside_m = 0.0f;
  RoadShape shape;
  bool fitted = false;
  CentreLine line;
  const bool on_map = road.map && road.has_pose;
  bool has_line = false, expects = false;
  if (road.has_pose) {
    for (int32_t i = 0; i < 9; ++i) axes.map[i] = float(road.ego.r[i]);
    const double speed = road.ego.pose.speed_mps;
    const double of_map = road.faces_along ? road.curvature_per_m : -road.curvature_per_m;
    const double curvature = road.map ? of_map : speed > 5.0 ? road.ego.pose.yaw_rate_rps / speed : 0.0;
    shape.curvature = float(std::clamp(curvature, -0.02, 0.02));
    has_line = road.map && road.ego.r[8] > 0.1;
  }
  if (has_line) {
    line.lay(*road.map, road.s_m, RoadData::kStation_m, RoadData::kStations, road.ego.pose.x_m, road.ego.pose.y_m);
    int32_t station = RoadData::kStations / 2;
    expects = !line.empty() && road.has_expected;
    has_line = !line.empty() && find_height<false>(road, line, 0.0f, 0.0f, station, origin_m, outside_m);
    if (!has_line && expects) find_height<true>(road, line, 0.0f, 0.0f, station, origin_m, outside_m);
    origin_m /= axes.map[8];
  }
  if (has_line) {
    RoadShape ground;
    ground.curvature = shape.curvature;
    expect_road(road, line, axes.map, origin_m, ExpectedRoad::Source::kLearned, ground);
    if (ground.expected.to_m - ground.expected.from_m >= kLeastLane_m) {
      kernels.fit_road(params, axes, sensor, range_filled_m, elevation_filled_rad, ground);
      level_sensor(ground, axes);
    }
  }
  // The up axis of the map, in the sensor's axes.
  float up[3];
  const float *r = axes.map, *m = axes.mounting.r;
  for (int32_t i = 0; i < 3; ++i) up[i] = m[i] * r[6] + m[3 + i] * r[7] + m[6 + i] * r[8];
  if (abs_of(up[2]) < 0.1f) up[2] = 0.1f;

  static_assert(64 % kRayColumns == 0);
  const int32_t count = columns.last < sensor.cols ? columns.last / kRayColumns : count_rays(sensor.cols);
  for (int32_t begin = columns.first / kRayColumns; begin < count; begin += kTogether) {
    Rays known, guess;
    const int32_t here = std::min(kTogether, count - begin);
    for (int32_t l = 0; l < kTogether; ++l) {
      const int32_t k = std::min(begin + l, count - 1);
      sin_cos_f32(
          float(wrap_angle(double(sensor.azimuth_left_rad) - double(k * kRayColumns) * double(sensor.pitch_rad))),
          known.sine[l], known.cosine[l]);
      guess.sine[l] = known.sine[l], guess.cosine[l] = known.cosine[l];
      known.known[l] = false;
    }
    if (has_line) sample_stations<false>(road, line, axes, origin_m, known);
    if (!std::all_of(known.known, known.known + here, [](bool is_known) { return is_known; })) {
      if (!fitted && expects) expect_road(road, line, axes.map, origin_m, ExpectedRoad::Source::kMap, shape);
      if (!fitted && !expects && road.has_pose && road.ego.pose.has_attitude) expect_way(road, shape);
      if (!fitted) kernels.fit_road(params, axes, sensor, range_filled_m, elevation_filled_rad, shape);
      fitted = true;
      sample_shape(axes, shape, guess);
      if (expects) {
        Rays expected = guess;
        sample_stations<true>(road, line, axes, origin_m, expected);
        add_difference(axes, shape, expected);
        take_road(expected, guess);
      }
    }
    for (int32_t l = 0; l < here; ++l) {
      const int32_t k = begin + l;
      const Rays& rays = known.known[l] ? known : guess;
      surface.known_m[k] = known.known[l] || expects ? rays.known_m[l] : on_map ? 0.0f : -1.0f;
      surface.bound_per_m[k] = known.known[l] || expects ? rays.bound_per_m[l] : 0.0f;
      surface.last_bound_per_m[k] = known.known[l] || expects ? rays.last_bound_per_m[l] : 0.0f;
      surface.level_slope[k] = -(up[0] * rays.cosine[l] + up[1] * rays.sine[l]) / up[2];
      float heights_m[kNodes];
      for (int32_t i = 0; i < kNodes; ++i) heights_m[i] = rays.heights_m[i][l];
      float *offset_m = surface.offset_m + k * kNodes, *slope = surface.slope + k * kNodes;
      for (int32_t i = 0; i + 1 < kNodes; ++i) {
        slope[i] = (heights_m[i + 1] - heights_m[i]) / (node_distance_m(i + 1) - node_distance_m(i));
        offset_m[i] = heights_m[i] - slope[i] * node_distance_m(i);
      }
      slope[kNodes - 1] = slope[kNodes - 2];
      offset_m[kNodes - 1] = offset_m[kNodes - 2];
    }
  }
}

}  // namespace overtake
