// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// The road surface along the rays of a sensor, against the exact surface of roads with a closed form.
#include "pipeline/road/sample_road.h"

#include <doctest/doctest.h>

#include <cmath>
#include <random>
#include <utility>
#include <vector>

#include "pipeline/road/height_profile.h"
#include "tests/support/circle_road.h"
#include "tests/support/images.h"
#include "tests/support/paper_params.h"

namespace overtake {
namespace {

using test::CircleRoad;

constexpr int32_t kHere = RoadData::kStations / 2;

struct Mounting {
  double x_m, y_m, z_m, roll_rad, pitch_rad, yaw_rad;
};
constexpr Mounting kLevel = {0.0, 0.0, 1.0, 0.0, 0.0, 0.0};
constexpr Mounting kMountings[] = {{2.3, 0.0, 0.65, 0.0, 0.0, 0.0},
                                   {1.5, 0.27, 0.74, 0.02, -0.03, 2.0 * kPi / 3.0},
                                   {1.5, -0.27, 0.74, -0.05, 0.04, -2.0 * kPi / 3.0},
                                   {2.3, 0.0, 0.65, 0.03, 0.05, 0.1}};

SensorModel make_sensor(const Mounting& m, int32_t cols = 857, bool wraps = false) {
  const double left = wraps ? kPi : kPi / 3.0, right = wraps ? -kPi : -kPi / 3.0;
  SensorModel sensor = make_sensor_model(32, cols, left, right, wraps, 0.5, 300.0);
  sensor.T_vehicle_sensor = make_transform(m.x_m, m.y_m, m.z_m, m.roll_rad, m.pitch_rad, m.yaw_rad);
  return sensor;
}

struct Scan {
  explicit Scan(const SensorModel& sensor) : range(sensor.rows, sensor.cols), elevation(sensor.rows, sensor.cols) {
    range.fill(kNoReturn), elevation.fill(0.0f);
  }
  test::OwnedPlane<float> range, elevation;
};

struct Sampled {
  Sampled(const RoadData& road, const SensorModel& of) : Sampled(road, of, Scan(of)) {}
  Sampled(const RoadData& road, const SensorModel& of, Scan scan) : sensor(of), rays(count_rays(of.cols)) {
    const std::size_t nodes = std::size_t(rays * kNodes);
    // One guard value behind each column.
    offset_m.assign(nodes + 1, kGuard), slope.assign(nodes + 1, kGuard);
    level_slope.assign(std::size_t(rays) + 1, kGuard), known_m.assign(std::size_t(rays) + 1, kGuard);
    sample_road(test::paper_params(sensor).running_ground, road, sensor, scan.range, scan.elevation,
                {offset_m.data(), slope.data(), level_slope.data(), known_m.data()});
    for (const auto* column : {&offset_m, &slope, &level_slope, &known_m}) {
      CHECK(column->back() == kGuard);
      bool written = true;
      for (std::size_t i = 0; i + 1 < column->size(); ++i) written &= (*column)[i] != kGuard;
      CHECK(written);
    }
  }
  double azimuth(int32_t ray) const {
    return double(sensor.azimuth_left_rad) - ray * kRayColumns * double(sensor.pitch_rad);
  }
  // As running_ground reads it.
  double height(int32_t ray, double distance_m) const {
    const int32_t piece = std::min(int32_t(std::sqrt(distance_m / double(kNodeScale_m))), kNodes - 1);
    const std::size_t at = std::size_t(ray * kNodes + piece);
    return double(offset_m[at]) + double(slope[at]) * distance_m;
  }
  bool is_finite() const {
    bool finite = true;
    for (const auto* column : {&offset_m, &slope, &level_slope, &known_m})
      for (const float value : *column) finite &= std::isfinite(value);
    return finite;
  }
  int32_t known_count() const {
    int32_t count = 0;
    for (int32_t k = 0; k < rays; ++k) count += known_m[std::size_t(k)] > 0.0f;
    return count;
  }
  static constexpr float kGuard = -12345.0f;
  SensorModel sensor;
  int32_t rays;
  std::vector<float> offset_m, slope, level_slope, known_m;
};

// What the height profile tells a vehicle at the place. With all heights known.
RoadData data_at(const CircleRoad& road, double s_m, double d_m, double pitch_rad = 0.0) {
  EgoBuffer buffer(512);
  EgoPose pose = road.pose_at(s_m, d_m);
  pose.pitch_rad = pitch_rad;
  REQUIRE(buffer.push(pose) == OVT_OK);
  HeightProfile profile;
  REQUIRE(profile.build(&road.map, default_allocator()));
  RoadData data;
  profile.describe(buffer, buffer.range(), 0, data);
  REQUIRE(data.map == &road.map);
  for (int32_t k = 0; k < RoadData::kStations; ++k) {
    const double s = data.s_m + (k - kHere) * RoadData::kStation_m;
    data.known[k] = true;
    data.height_m[k] = float(road.height(s) - pose.z_m);
    data.cross_slope[k] = float(road.slope(s));
  }
  return data;
}

// The height in the sensor's axes at which a vertical line of these axes meets a surface z(x, y) of the map.
template <class Surface>
double exact_height(const RoadData& data, const SensorModel& sensor, double azimuth_rad, double distance_m,
                    Surface&& surface, double* map_x = nullptr, double* map_y = nullptr) {
  const Transform& m = sensor.T_vehicle_sensor;
  const auto above = [&](double z) {
    const double p[3] = {distance_m * std::cos(azimuth_rad), distance_m * std::sin(azimuth_rad), z};
    double v[3], w[3];
    for (int32_t i = 0; i < 3; ++i) {
      v[i] = double(m.t[i]);
      for (int32_t j = 0; j < 3; ++j) v[i] += double(m.r[3 * i + j]) * p[j];
    }
    const double origin[3] = {data.ego.pose.x_m, data.ego.pose.y_m, data.ego.pose.z_m};
    for (int32_t i = 0; i < 3; ++i) {
      w[i] = origin[i];
      for (int32_t j = 0; j < 3; ++j) w[i] += data.ego.r[3 * i + j] * v[j];
    }
    if (map_x) *map_x = w[0];
    if (map_y) *map_y = w[1];
    return w[2] - surface(w[0], w[1]);
  };
  double low = -200.0, high = 200.0;
  for (int32_t i = 0; i < 60; ++i) (above(0.5 * (low + high)) > 0.0 ? high : low) = 0.5 * (low + high);
  return low;
}

TEST_CASE("sample_road: a level road is a level plane below every sensor") {
  const CircleRoad road({.radius_m = 400.0});
  for (const Mounting& mounting : kMountings) {
    const SensorModel sensor = make_sensor(mounting);
    const RoadData data = data_at(road, 50.0, -2.0);
    const Sampled sampled(data, sensor);
    CHECK(sampled.known_count() == sampled.rays);
    for (int32_t k = 0; k < sampled.rays; ++k)
      for (const double distance : {0.0, 1.0, 5.0, 20.0, 60.0, 120.0, 160.0, 250.0}) {
        const double exact =
            exact_height(data, sensor, sampled.azimuth(k), distance, [](double, double) { return 0.0; });
        CHECK(sampled.height(k, distance) == doctest::Approx(exact).epsilon(1e-4));
      }
  }
}

// The cone of a constant bank in a constant turn. The vehicle drives on the centre line, or beside it.
void check_turn(double slope, double d_m, const Mounting& mounting) {
  constexpr double kRadius = 400.0;
  const CircleRoad road({.radius_m = kRadius, .slope = [&](double) { return slope; }});
  const RoadData data = data_at(road, 300.0, d_m);
  const SensorModel sensor = make_sensor(mounting);
  const Sampled sampled(data, sensor);
  double left_m = 0.0;
  // The road goes on with its slope 6 m beyond the outer edge; from there, and inside of the inner edge, it is level.
  const auto surface = [&](double x, double y) {
    left_m = kRadius - std::hypot(x, y - kRadius);
    return -slope * std::fmin(std::fmax(left_m, -CircleRoad::kWidthRight_m - (slope > 0.0 ? 6.0 : 0.0)),
                              CircleRoad::kWidthLeft_m + (slope < 0.0 ? 6.0 : 0.0));
  };
  int32_t on_road = 0, far_on_road = 0, beside = 0;
  for (int32_t k = 0; k < sampled.rays; ++k) {
    const double known_m = double(sampled.known_m[std::size_t(k)]);
    if (known_m == 0.0) continue;
    bool on_the_road = true;  // so far
    for (int32_t node = 0; node < kNodes; ++node) {
      const double distance = double(node_distance_m(node));
      if (distance > 100.0) break;
      const double exact = exact_height(data, sensor, sampled.azimuth(k), distance, surface);
      // It is known up to the first node that is 1 m beside the road.
      const double outside_m = std::fmax(left_m - CircleRoad::kWidthLeft_m, -CircleRoad::kWidthRight_m - left_m);
      on_the_road &= outside_m < 1.0;
      if (std::fabs(outside_m - 1.0) < 0.3) break;  // either
      CHECK((distance < known_m) == on_the_road);
      const bool on = left_m < CircleRoad::kWidthLeft_m - 0.3 && left_m > -CircleRoad::kWidthRight_m + 0.3;
      CAPTURE(k);
      CAPTURE(distance);
      CAPTURE(left_m);
      CHECK(std::fabs(sampled.height(k, distance) - exact) < (on ? 0.02 + 0.0005 * distance : 0.15));
      on_road += on, beside += !on, far_on_road += on && distance > 30.0;
    }
  }
  CHECK(on_road > 50);
  CHECK(beside > 50);
  if (std::fabs(mounting.yaw_rad) < 1.0) CHECK(far_on_road > 3);
}

TEST_CASE("sample_road: a banked turn, to both sides, from both sides of the road, all mountings") {
  for (const Mounting& mounting : kMountings)
    for (const double slope : {0.36, 0.1, -0.1})
      for (const double d_m : {0.0, 4.0, -4.0}) {
        CAPTURE(mounting.yaw_rad);
        CAPTURE(slope);
        CAPTURE(d_m);
        check_turn(slope, d_m, mounting);
      }
}

TEST_CASE("sample_road: between its nodes the surface of a turn is exact to 7 cm along the road") {
  const CircleRoad road({.radius_m = 400.0, .slope = [](double) { return 0.36; }});
  const RoadData data = data_at(road, 300.0, 0.0);
  const SensorModel sensor = make_sensor(kMountings[0]);
  const Sampled sampled(data, sensor);
  int32_t checked = 0;
  for (int32_t k = 0; k < sampled.rays; ++k)
    for (double distance = 0.5; distance < 100.0; distance += 0.5) {
      double left_m = 0.0;
      const double exact = exact_height(data, sensor, sampled.azimuth(k), distance, [&](double x, double y) {
        left_m = 400.0 - std::hypot(x, y - 400.0);
        return -0.36 * left_m;
      });
      if (std::fabs(left_m) > 3.0) break;  // the next node may lie beside the road
      CHECK(std::fabs(sampled.height(k, distance) - exact) < 0.07);
      ++checked;
    }
  CHECK(checked > 500);
}

TEST_CASE("sample_road: a grade: the vehicle is parallel to the road before it, or stands at its foot") {
  // 3 % along the road, up to 0.3 rad behind and ahead of the vehicle.
  const CircleRoad slope_road({.radius_m = 2000.0, .height = [](double turn) { return 60.0 * turn; }});
  const double on_slope_m = 1000.0;
  const SensorModel sensor = make_sensor(kLevel);
  const RoadData parallel = data_at(slope_road, on_slope_m, 0.0, -std::atan(0.03));
  const Sampled flat(parallel, sensor);
  const int32_t ahead = flat.rays / 2;
  for (const double distance : {0.0, 10.0, 50.0, 100.0, 150.0})
    CHECK(std::fabs(flat.height(ahead, distance) + 1.0) < 0.03 + 0.002 * distance);
  const RoadData level = data_at(slope_road, on_slope_m, 0.0, 0.0);
  const Sampled climb(level, sensor);
  for (const double distance : {0.0, 10.0, 50.0, 100.0, 150.0})
    CHECK(std::fabs(climb.height(ahead, distance) - (0.03 * distance - 1.0)) < 0.02 + 0.001 * distance);
}

TEST_CASE("sample_road: the origin under the vehicle is on the road, also if the profile has another height there") {
  const CircleRoad road({.radius_m = 400.0, .slope = [](double) { return 0.2; }});
  RoadData data = data_at(road, 100.0, 1.0);
  for (float& height : data.height_m) height += 0.7f;
  const SensorModel sensor = make_sensor(kLevel);
  const Sampled lifted(data, sensor), plain(data_at(road, 100.0, 1.0), sensor);
  for (int32_t k = 0; k < lifted.rays; ++k) {
    CHECK(lifted.height(k, 0.0) == doctest::Approx(-1.0).epsilon(1e-4));
    CHECK(plain.height(k, 0.0) == doctest::Approx(-1.0).epsilon(1e-4));
    CHECK(std::fabs(lifted.height(k, 20.0) - plain.height(k, 20.0)) < 0.02);
  }
}

TEST_CASE("sample_road: unknown heights: a ray to one nearer than 100 m is a guess, a farther one goes on straight") {
  const CircleRoad road({.radius_m = 5000.0, .height = [](double turn) { return 50.0 * turn; }});
  const SensorModel sensor = make_sensor(kLevel);
  RoadData data = data_at(road, 1000.0, 0.0);
  for (int32_t k = 0; k < RoadData::kStations; ++k)
    if (k > kHere + 22) data.known[k] = false;  // beyond 110 m
  const Sampled far(data, sensor);
  const int32_t ahead = far.rays / 2;
  CHECK(far.known_m[std::size_t(ahead)] > 150.0f);
  CHECK(std::fabs(far.height(ahead, 150.0) - (1.5 - 1.0)) < 0.1);
  data.known[kHere + 15] = false;
  const Sampled near(data, sensor);
  CHECK(near.known_m[std::size_t(ahead)] == 0.0f);
  CHECK(near.known_m[0] > 0.0f);  // to the left it leaves the road at the stations around the vehicle
}

// A scan of the surface z(x, y) in the vehicle frame, up to 90 m: rows from 0.05 rad down to -0.3 rad. A box of 1 m
// height, 2 m across and any length stands at box_x_m on the lane.
template <class Surface>
Scan scan_of(const SensorModel& sensor, Surface&& surface, double box_x_m = 1e9) {
  Scan scan(sensor);
  const Transform& m = sensor.T_vehicle_sensor;
  for (int32_t r = 0; r < sensor.rows; ++r)
    for (int32_t c = 0; c < sensor.cols; ++c) {
      const double up = 0.05 - 0.35 * std::pow(double(r) / (sensor.rows - 1), 2.0);
      const double azimuth = double(sensor.azimuth_left_rad) - (c + 0.5) * double(sensor.pitch_rad);
      const double beam[3] = {std::cos(up) * std::cos(azimuth), std::cos(up) * std::sin(azimuth), std::sin(up)};
      const auto above = [&](double range) {
        double v[3];
        for (int32_t i = 0; i < 3; ++i) {
          v[i] = double(m.t[i]);
          for (int32_t j = 0; j < 3; ++j) v[i] += double(m.r[3 * i + j]) * beam[j] * range;
        }
        const bool box = v[0] > box_x_m && v[0] < box_x_m + 5.0 && std::fabs(v[1]) < 1.0;
        return v[2] - surface(v[0], v[1]) - (box ? 1.0 : 0.0);
      };
      double range = 0.5;
      while (range < 90.0 && above(range) > 0.0) range += 0.02;
      scan.elevation.at(r, c) = float(up);
      scan.range.at(r, c) = range < 90.0 ? float(range) : kNoReturn;
    }
  return scan;
}

// A vehicle in a left turn of 400 m, with a yaw rate but no map.
RoadData turning_without_map() {
  RoadData data;
  data.has_pose = true;
  data.ego.pose.speed_mps = 70.0;
  data.ego.pose.yaw_rate_rps = 0.175;
  return data;
}

TEST_CASE("sample_road: without known heights and without ground in the scan the road is level") {
  for (const Mounting& mounting : kMountings)
    for (const bool has_pose : {true, false}) {
      RoadData data = turning_without_map();
      data.has_pose = has_pose;
      const SensorModel sensor = make_sensor(mounting);
      const Sampled sampled(data, sensor);
      CHECK(sampled.known_count() == 0);
      for (int32_t k = 0; k < sampled.rays; ++k) CHECK(sampled.known_m[std::size_t(k)] == -1.0f);
      const Transform& m = sensor.T_vehicle_sensor;
      for (int32_t k = 0; k < sampled.rays; k += 5)
        for (const double distance : {0.0, 10.0, 50.0, 150.0}) {
          const double x = distance * std::cos(sampled.azimuth(k)), y = distance * std::sin(sampled.azimuth(k));
          const double exact = -(double(m.t[2]) + double(m.r[6]) * x + double(m.r[7]) * y) / double(m.r[8]);
          CHECK(sampled.height(k, distance) == doctest::Approx(exact).epsilon(1e-3));
        }
    }
}

// Checks a guess against the surface z(x, y) in the vehicle frame, near the lane and up to 60 m.
template <class Surface>
void check_guess(const Sampled& sampled, Surface&& surface, double tolerance_m) {
  const Transform& m = sampled.sensor.T_vehicle_sensor;
  int32_t checked = 0;
  for (int32_t k = 0; k < sampled.rays; ++k)
    for (int32_t node = 0; node < kNodes; ++node) {
      const double distance = double(node_distance_m(node)), a = sampled.azimuth(k);
      const double z = sampled.height(k, distance);
      const double p[3] = {distance * std::cos(a), distance * std::sin(a), z};
      double v[3];
      for (int32_t i = 0; i < 3; ++i) {
        v[i] = double(m.t[i]);
        for (int32_t j = 0; j < 3; ++j) v[i] += double(m.r[3 * i + j]) * p[j];
      }
      if (std::fabs(v[0]) > 60.0 || std::fabs(v[1] - 0.5 / 400.0 * v[0] * v[0]) > 4.0) continue;
      CAPTURE(v[0]);
      CAPTURE(v[1]);
      CHECK(std::fabs(v[2] - surface(v[0], v[1])) < tolerance_m);
      ++checked;
    }
  CHECK(checked > 20);
}

TEST_CASE("sample_road: a guess has the height, grade, cross slope and bend of the scan's ground") {
  const auto lane = [](double x, double y) { return y - 0.5 / 400.0 * x * x; };
  const auto level = [](double, double) { return 0.0; };
  const auto low = [](double, double) { return -0.06; };            // of the mounting
  const auto pitched = [](double x, double) { return 0.01 * x; };   // of the vehicle
  const auto bent = [](double x, double) { return 4e-4 * x * x; };  // into a bank
  const auto banked = [&](double x, double y) { return 0.01 * lane(x, y) + 0.001 * x * lane(x, y); };
  const SensorModel sensor = make_sensor({2.3, 0.0, 0.65, 0.0, 0.0, 0.0}, 240);
  const RoadData data = turning_without_map();
  check_guess(Sampled(data, sensor, scan_of(sensor, level)), level, 0.03);
  check_guess(Sampled(data, sensor, scan_of(sensor, low)), low, 0.05);
  check_guess(Sampled(data, sensor, scan_of(sensor, pitched)), pitched, 0.08);
  check_guess(Sampled(data, sensor, scan_of(sensor, bent)), bent, 0.12);
  check_guess(Sampled(data, sensor, scan_of(sensor, banked)), banked, 0.12);
  // A level guess is wrong by more than that.
  CHECK_FALSE(std::fabs(Sampled(data, sensor).height(8, 55.0) + 0.65 - bent(57.3, 0.0)) < 0.5);
}

// A left turn whose banking rises ahead of the vehicle: the slope goes from 0.1 to 0.35 between 100 and 240 m. Its
// inner edge is level, or its centre line.
CircleRoad rising_bank(bool with_banking, bool level_edge) {
  constexpr double kRadius = 400.0;
  const auto slope = [](double turn) {
    const double t = std::fmin(std::fmax((turn * kRadius - 100.0) / 140.0, 0.0), 1.0);
    return 0.1 + 0.25 * t * t * (3.0 - 2.0 * t);
  };
  return CircleRoad({.radius_m = kRadius,
                     .with_banking = with_banking,
                     .height = [=](double turn) { return level_edge ? CircleRoad::kWidthLeft_m * slope(turn) : 0.0; },
                     .slope = slope});
}

// The first time at a place, with what one ego pose tells.
RoadData first_look(const CircleRoad& road, double s_m) {
  EgoBuffer buffer(512);
  REQUIRE(buffer.push(road.pose_at(s_m, 0.0)) == OVT_OK);
  HeightProfile profile;
  REQUIRE(profile.build(&road.map, default_allocator()));
  RoadData data;
  profile.describe(buffer, buffer.range(), 0, data);
  REQUIRE(data.map == &road.map);
  return data;
}

// The largest error of the surface on the road around the centre line, up to so far ahead.
double worst_on_road(const Sampled& sampled, const RoadData& data, const CircleRoad& road, double far_m) {
  double worst_m = 0.0, left_m = 0.0;
  int32_t checked = 0;
  const auto surface = [&](double x, double y) {
    const MapProjection at = road.map.project(x, y, -1);
    left_m = at.d_m;
    return road.height(at.s_m) - at.d_m * road.slope(at.s_m);
  };
  for (int32_t k = 0; k < sampled.rays; ++k)
    for (double distance = 5.0; distance <= far_m; distance += 5.0) {
      const double exact = exact_height(data, sampled.sensor, sampled.azimuth(k), distance, surface);
      if (std::fabs(left_m) > 3.0) continue;
      worst_m = std::fmax(worst_m, std::fabs(sampled.height(k, distance) - exact));
      ++checked;
    }
  CHECK(checked > 8);
  return worst_m;
}

TEST_CASE("sample_road: the first time at a place, a map with banking tells how the road turns ahead") {
  const SensorModel sensor = make_sensor(kMountings[0], 240);
  for (const double s_m : {60.0, 120.0, 200.0}) {
    CAPTURE(s_m);
    const CircleRoad told = rising_bank(true, true), untold = rising_bank(false, true);
    const RoadData with = first_look(told, s_m), without = first_look(untold, s_m);
    const Sampled sampled(with, sensor);
    CHECK(sampled.known_m[std::size_t(sampled.rays / 2)] > 40.0f);  // where the ray leaves the road
    CHECK(worst_on_road(sampled, with, told, 95.0) < 0.2);
    CHECK(worst_on_road(Sampled(without, sensor), without, untold, 95.0) > 1.0);
  }
}

TEST_CASE("sample_road: beside an expected road the cross slope goes on, a known one ends at its inner edge") {
  const SensorModel sensor = make_sensor(kMountings[0], 240);
  const CircleRoad road = rising_bank(true, true);
  const RoadData first = first_look(road, 200.0), later = data_at(road, 200.0, 0.0);
  const Sampled expected(first, sensor), known(later, sensor);
  const double slope = road.slope(200.0);
  CHECK(expected.known_m[0] < 15.0f);  // the ray to the left leaves the road
  // There the vehicle's plane goes down with the road; 8 m from the centre line the known road becomes level.
  CHECK(std::fabs(expected.height(0, 14.0) + 0.65) < 0.3);
  CHECK(known.height(0, 20.0) > expected.height(0, 20.0) + 0.5 * slope * 4.0);
}

// A scan of the road, up to 90 m.
Scan scan_of_road(const SensorModel& sensor, const RoadData& data, const CircleRoad& road) {
  return scan_of(sensor, [&](double x, double y) {  // the height above the vehicle's plane, by two steps
    double z = 0.0;
    for (int32_t i = 0; i < 3; ++i) {
      const double* const r = data.ego.r;
      const double map_x = data.ego.pose.x_m + r[0] * x + r[1] * y + r[2] * z;
      const double map_y = data.ego.pose.y_m + r[3] * x + r[4] * y + r[5] * z;
      const MapProjection at = road.map.project(map_x, map_y, -1);
      z = (road.height(at.s_m) - at.d_m * road.slope(at.s_m) - data.ego.pose.z_m - r[6] * x - r[7] * y) / r[8];
    }
    return z;
  });
}

TEST_CASE("sample_road: where the road is not what the map lets expect, the scan's ground corrects it") {
  const SensorModel sensor = make_sensor(kMountings[0], 120);
  const CircleRoad told = rising_bank(true, false), untold = rising_bank(false, false);
  const double s_m = 120.0;  // the edge falls by 1.5 m over the next 100 m, and is expected to stay level
  const RoadData with = first_look(told, s_m), without = first_look(untold, s_m);
  const double plain = worst_on_road(Sampled(with, sensor), with, told, 60.0);
  const double corrected = worst_on_road(Sampled(with, sensor, scan_of_road(sensor, with, told)), with, told, 60.0);
  CHECK(corrected < 0.5 * plain);
  CHECK(corrected < 0.3);
  const double fitted =
      worst_on_road(Sampled(without, sensor, scan_of_road(sensor, without, untold)), without, untold, 60.0);
  CHECK(corrected < fitted + 0.1);

  // And no pixel of that road is an obstacle, as far as a road returns.
  Scan scan = scan_of_road(sensor, with, told);
  Sampled sampled(with, sensor, scan_of_road(sensor, with, told));
  test::OwnedPlane<float> height(sensor.rows, sensor.cols);
  test::OwnedBits nonground(sensor.rows, sensor.cols), steep(sensor.rows, sensor.cols);
  ref::running_ground(
      test::paper_params(sensor).running_ground,
      {sampled.offset_m.data(), sampled.slope.data(), sampled.level_slope.data(), sampled.known_m.data()}, scan.range,
      scan.elevation, height, nonground, steep);
  int32_t obstacles = 0, returns = 0;
  for (int32_t r = 0; r < sensor.rows; ++r)
    for (int32_t c = 0; c < sensor.cols; ++c) {
      const double range = double(scan.range.at(r, c)), up = double(scan.elevation.at(r, c));
      const double azimuth = double(sensor.azimuth_left_rad) - (c + 0.5) * double(sensor.pitch_rad);
      const double x = 2.3 + range * std::cos(up) * std::cos(azimuth), y = range * std::cos(up) * std::sin(azimuth);
      const double z = 0.65 + range * std::sin(up);
      double map_x, map_y;
      with.ego.to_map(x, y, z, map_x, map_y);
      if (!(range > 0.0 && range < 70.0) || std::fabs(told.map.project(map_x, map_y, -1).d_m) > 4.0) continue;
      ++returns;
      obstacles += ConstBitPlane(BitPlane(nonground)).test(r, c);
    }
  CHECK(returns > 500);
  CHECK(obstacles == 0);
}

TEST_CASE("sample_road: rows without a return change no byte of a guess, with any number of rows") {
  const auto bent = [](double x, double) { return 4e-4 * x * x; };
  const SensorModel sensor = make_sensor({2.3, 0.0, 0.65, 0.0, 0.0, 0.0}, 240);
  Scan scan = scan_of(sensor, bent);
  const Sampled sampled(turning_without_map(), sensor, scan_of(sensor, bent));
  for (const int32_t apart : {2, 6, 8, 16, 32}) {  // up to the 1,024 rows of the largest image
    CAPTURE(apart);
    SensorModel tall = sensor;
    tall.rows = apart * sensor.rows;
    Scan sparse(tall);
    for (int32_t r = 0; r < sensor.rows; ++r)
      for (int32_t c = 0; c < sensor.cols; ++c) {
        sparse.range.at(apart * r, c) = scan.range.at(r, c);
        sparse.elevation.at(apart * r, c) = scan.elevation.at(r, c);
      }
    const Sampled same(turning_without_map(), tall, std::move(sparse));
    CHECK(same.offset_m == sampled.offset_m);
    CHECK(same.slope == sampled.slope);
  }
}

TEST_CASE("sample_road: a car on the road does not lift the guess") {
  const auto level = [](double, double) { return 0.0; };
  const SensorModel sensor = make_sensor({2.3, 0.0, 0.65, 0.0, 0.0, 0.0}, 240);
  for (const double car_x_m : {8.0, 15.0, 30.0}) {
    CAPTURE(car_x_m);
    check_guess(Sampled(turning_without_map(), sensor, scan_of(sensor, level, car_x_m)), level, 0.05);
  }
}

TEST_CASE("sample_road: the level slope of a ray is that of a horizontal plane of the map") {
  std::mt19937 random(5);
  std::uniform_real_distribution<double> angle(-0.5, 0.5), any(-3.1, 3.1);
  for (int32_t i = 0; i < 50; ++i) {
    EgoWindow window;
    window.count = 1;
    window.poses[0].roll_rad = angle(random);
    window.poses[0].pitch_rad = angle(random);
    window.poses[0].yaw_rad = any(random);
    RoadData data;
    data.has_pose = window.at(0, data.ego);
    REQUIRE(data.has_pose);
    const SensorModel sensor = make_sensor({1.0, 0.2, 0.7, 0.3 * angle(random), 0.3 * angle(random), any(random)});
    const Sampled sampled(data, sensor);
    const float* m = sensor.T_vehicle_sensor.r;
    for (int32_t k = 0; k < sampled.rays; k += 7) {
      const double a = sampled.azimuth(k);
      const double p[3] = {std::cos(a), std::sin(a), double(sampled.level_slope[std::size_t(k)])};
      double map_z = 0.0;
      for (int32_t r = 0; r < 3; ++r)
        for (int32_t c = 0; c < 3; ++c) map_z += data.ego.r[6 + r] * double(m[3 * r + c]) * p[c];
      CHECK(std::fabs(map_z) < 1e-5);
    }
  }
}

TEST_CASE("sample_road: there is a ray at each edge of every block of columns, for any width and a full turn") {
  const CircleRoad road({.radius_m = 400.0, .slope = [](double) { return 0.2; }});
  const RoadData data = data_at(road, 300.0, 0.0);
  for (const int32_t cols : {1, 2, 15, 16, 17, 31, 32, 33, 857, 1800})
    for (const bool wraps : {false, true}) {
      CAPTURE(cols);
      CAPTURE(wraps);
      const SensorModel sensor = make_sensor(kLevel, cols, wraps);
      const Sampled sampled(data, sensor);
      CHECK(sampled.rays == (cols + 15) / 16 + 1);
      CHECK(sampled.is_finite());
      for (int32_t k = 0; k < sampled.rays; ++k) {
        const double exact = exact_height(data, sensor, sampled.azimuth(k), 5.0,
                                          [](double x, double y) { return -0.2 * (400.0 - std::hypot(x, y - 400.0)); });
        CHECK(std::fabs(sampled.height(k, 5.0) - exact) < 0.05);
      }
    }
}

TEST_CASE("sample_road: every number is finite for every pose and mounting that the library accepts") {
  std::mt19937 random(9);
  std::uniform_real_distribution<double> share(-1.0, 1.0);
  const auto pick = [&](double largest) {  // often extreme
    switch (random() % 4) {
      case 0: return largest * share(random);
      case 1: return largest * (random() % 2 ? 1.0 : -1.0);
      case 2: return 0.0;
      default: return 3.0 * share(random);
    }
  };
  const double x[] = {-1e8, 1e8, 1e8, 1e8 - 1e-3}, y[] = {-1e8, -1e8, 1e8, 1e8};
  const double wide[] = {4e8, 4e8, 4e8, 4e8}, banking[] = {1.4, -1.4, 3.0, 0.3};
  CircuitMap huge;
  const char* error = nullptr;
  REQUIRE(huge.build(x, y, wide, wide, banking, 4, true, &error));
  const CircleRoad small({.radius_m = 30.0, .slope = [](double turn) { return 3.0 * std::sin(turn); }});
  int32_t on_map = 0, known = 0;
  for (int32_t i = 0; i < 3000; ++i) {
    const CircuitMap* map = i % 3 == 0 ? nullptr : i % 3 == 1 ? &huge : &small.map;
    EgoBuffer buffer(512);
    HeightProfile profile;
    if (i % 3 == 1 && i > 60) continue;  // a million stretches: few of them
    REQUIRE(profile.build(map, default_allocator()));
    for (int32_t k = 0; k < 30; ++k) {
      EgoPose pose;
      pose = i % 3 == 2 && random() % 4 ? small.pose_at(0.1 * k + i, share(random)) : pose;
      pose.stamp_ns = k * 10'000'000;
      if (pose.yaw_rad == 0.0) pose.x_m = pick(1e8), pose.y_m = pick(1e8), pose.z_m = pick(1e8);
      pose.roll_rad = pick(1e6), pose.pitch_rad = pick(1e6), pose.yaw_rad = pick(1e6);
      pose.speed_mps = pick(1e3), pose.yaw_rate_rps = pick(100.0);
      REQUIRE(buffer.push(pose) == OVT_OK);
    }
    RoadData data;
    profile.describe(buffer, buffer.range(), 300'000'000 + int64_t(random() % 50) * 1'000'000, data);
    on_map += data.map != nullptr;
    if (i % 2 == 0)  // heights and cross slopes of any earlier poses
      for (int32_t k = 0; k < RoadData::kStations; ++k) {
        data.known[k] = true;
        data.height_m[k] = float(pick(2e8));
        data.cross_slope[k] = float(pick(10.0));
      }
    const SensorModel sensor = make_sensor({pick(10.0), pick(10.0), pick(10.0), pick(kPi), pick(kPi), pick(kPi)},
                                           1 + int32_t(random() % 70), i % 2 == 0);
    Scan scan(sensor);
    const float right_angle = kHalfPiF;
    for (int32_t r = 0; r < sensor.rows; ++r)
      for (int32_t c = 0; c < sensor.cols; ++c) {
        scan.range.at(r, c) = random() % 4 ? float(150.0 * (1.0 + share(random))) : kNoReturn;
        scan.elevation.at(r, c) = random() % 8 ? float(0.3 * share(random)) : random() % 2 ? right_angle : -right_angle;
      }
    const Sampled sampled(data, sensor, scan);
    known += sampled.known_count();
    CHECK(sampled.is_finite());
  }
  CHECK(on_map > 50);
  CHECK(known > 50);
}

TEST_CASE("sample_road: a sensor on its side has no slope that divides by 0") {
  const CircleRoad road({.radius_m = 400.0, .slope = [](double) { return 0.2; }});
  const RoadData data = data_at(road, 300.0, 0.0);
  for (const double roll : {0.5 * kPi, -0.5 * kPi, 0.5 * kPi + 1e-9, kPi})
    for (const double pitch : {0.0, 0.5 * kPi}) {
      const Sampled sampled(data, make_sensor({1.0, 0.0, 1.0, roll, pitch, 0.3}));
      CHECK(sampled.is_finite());
    }
}

}  // namespace
}  // namespace overtake
