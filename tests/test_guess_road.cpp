// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// The road surface along the rays of a sensor where the heights are not known: fitted to the scan's ground, and
// expected from a map with banking. And where they are known but the sensor is tilted.
#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "tests/support/road_samples.h"

namespace overtake {
namespace {

using test::CircleRoad, test::Mounting, test::Sampled, test::Scan;
using test::data_at, test::exact_height, test::make_sensor, test::kHere, test::kMountings;

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
      while (range < 90.0 && above(range) > 0.0) range += 0.25;
      for (double step = 0.125; range < 90.0 && step > 0.01; step *= 0.5) range += above(range) > 0.0 ? step : -step;
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

TEST_CASE("guess_road: without known heights and without ground in the scan the road is level") {
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

TEST_CASE("guess_road: a guess has the height, grade, cross slope and bend of the scan's ground") {
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
RoadData first_look(const CircleRoad& road, double s_m, double turned_rad = 0.0) {
  EgoBuffer buffer(512);
  EgoPose pose = road.pose_at(s_m, 0.0);
  pose.yaw_rad = wrap_angle(pose.yaw_rad + turned_rad);
  if (std::fabs(turned_rad) > 3.0) pose.roll_rad = -pose.roll_rad;
  REQUIRE(buffer.push(pose) == OVT_OK);
  HeightProfile profile;
  REQUIRE(profile.build(&road.map, default_allocator()));
  RoadData data;
  profile.describe(buffer, buffer.range(), 0, data);
  REQUIRE(data.map == &road.map);
  return data;
}

// The largest error of the surface on the road around the centre line, up to so far away, in the axes of the sensor as
// it is mounted.
double worst_on_road(const Sampled& sampled, const RoadData& data, const CircleRoad& road, double far_m,
                     const SensorModel& mounted) {
  double worst_m = 0.0, left_m = 0.0;
  int32_t checked = 0;
  const auto surface = [&](double x, double y) {
    const MapProjection at = road.map.project(x, y, -1);
    left_m = at.d_m;
    return road.height(at.s_m) - at.d_m * road.slope(at.s_m);
  };
  for (int32_t k = 0; k < sampled.rays; ++k)
    for (double distance = 5.0; distance <= far_m; distance += 5.0) {
      const double exact = exact_height(data, mounted, sampled.azimuth(k), distance, surface);
      if (std::fabs(left_m) > 3.0) continue;
      worst_m = std::fmax(worst_m, std::fabs(sampled.height(k, distance) - exact));
      ++checked;
    }
  CHECK(checked > 8);
  return worst_m;
}
double worst_on_road(const Sampled& sampled, const RoadData& data, const CircleRoad& road, double far_m) {
  return worst_on_road(sampled, data, road, far_m, sampled.sensor);
}

TEST_CASE("guess_road: the first time at a place, a map with banking tells how the road turns ahead") {
  const SensorModel sensor = make_sensor(kMountings[0], 240);
  for (const double s_m : {60.0, 120.0, 200.0}) {
    CAPTURE(s_m);
    const CircleRoad told = rising_bank(true, true), untold = rising_bank(false, true);
    const RoadData with = first_look(told, s_m), without = first_look(untold, s_m);
    const Sampled sampled(with, sensor);
    CHECK(sampled.known_m[std::size_t(sampled.rays / 2)] > 40.0f);  // where the ray leaves the road
    CHECK(worst_on_road(sampled, with, told, 95.0) < 0.2);
    CHECK(worst_on_road(Sampled(without, sensor), without, untold, 95.0) > 0.4);
  }
}

// What a drive from s_m - 150 m to s_m tells without a map; from_m: only the last metres of it.
RoadData drive_without_map(const CircleRoad& road, double s_m, double from_m = 150.0) {
  constexpr double kSpeed_mps = 70.0, kPeriod_s = 0.01;
  EgoBuffer buffer(512);
  int64_t k = 0;
  for (double back_m = from_m; back_m >= 0.0; back_m -= kSpeed_mps * kPeriod_s, ++k) {
    EgoPose pose = road.pose_at(s_m - back_m, 0.0);
    pose.stamp_ns = k * 10'000'000;
    pose.speed_mps = kSpeed_mps, pose.yaw_rate_rps = kSpeed_mps / road.def.radius_m;
    REQUIRE(buffer.push(pose) == OVT_OK);
  }
  HeightProfile profile;
  REQUIRE(profile.build(nullptr, default_allocator()));
  RoadData data;
  profile.describe(buffer, buffer.range(), (k - 1) * 10'000'000, data);
  REQUIRE(data.has_pose);
  REQUIRE(data.map == nullptr);
  return data;
}

TEST_CASE("guess_road: without a map the own way tells the road behind, also where the scan has no ground") {
  const SensorModel sensor = make_sensor({1.8, 0.0, 0.65, 0.0, 0.0, kPi}, 240);
  const CircleRoad road = rising_bank(false, true);
  for (const double s_m : {160.0, 200.0, 260.0}) {
    CAPTURE(s_m);
    const RoadData way = drive_without_map(road, s_m), none = drive_without_map(road, s_m, 1.0);
    CHECK(way.way_count > 15);
    CHECK(none.way_count == 0);
    CHECK(worst_on_road(Sampled(way, sensor), way, road, 75.0) < 0.15);
    CHECK(worst_on_road(Sampled(none, sensor), none, road, 75.0) > 0.4);
  }
}

TEST_CASE("guess_road: the own way tells the road behind also where it does not follow the lane") {
  const SensorModel sensor = make_sensor({1.8, 0.0, 0.65, 0.0, 0.0, kPi}, 240);
  const CircleRoad road = rising_bank(false, false);
  RoadData way = drive_without_map(road, 220.0);
  way.ego.pose.yaw_rate_rps = -0.01;  // just now
  CHECK(worst_on_road(Sampled(way, sensor), way, road, 60.0) < 0.25);
}

TEST_CASE("guess_road: without a map a bank goes on along the bend ahead") {
  const SensorModel sensor = make_sensor(kMountings[0], 240);
  const CircleRoad road({.slope = [](double) { return 0.3; }});
  const RoadData data = drive_without_map(road, 300.0);
  CHECK(worst_on_road(Sampled(data, sensor), data, road, 95.0) < 0.25);
  RoadData straight = data;
  straight.ego.pose.yaw_rate_rps = 0.0;
  CHECK(worst_on_road(Sampled(straight, sensor), straight, road, 95.0) > 1.0);
  RoadData unknown = data;
  unknown.has_pose = false;
  CHECK(worst_on_road(Sampled(unknown, sensor), unknown, road, 95.0) > 1.0);
}

TEST_CASE("guess_road: beside an expected road the cross slope goes on, a known one ends at its inner edge") {
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

TEST_CASE("guess_road: ahead, the ground beside an expected road does not twist with it") {
  const SensorModel sensor = make_sensor(kMountings[0], 240);
  const CircleRoad road = rising_bank(true, true);
  const double s_m = 120.0;
  const RoadData data = first_look(road, s_m);
  const Sampled sampled(data, sensor);
  double left_m = 0.0, worst_m = 0.0, twisted_m = 0.0;
  int32_t checked = 0;
  const auto height = [&](double x, double y, bool twists) {  // from the edge on, with the vehicle's slope
    const MapProjection at = road.map.project(x, y, -1);
    left_m = at.d_m;
    const double on_road = std::fmin(left_m, CircleRoad::kWidthLeft_m);
    return road.height(at.s_m) - on_road * road.slope(at.s_m) - (left_m - on_road) * road.slope(twists ? at.s_m : s_m);
  };
  for (int32_t k = 0; k < sampled.rays; ++k)
    for (double distance = 20.0; distance <= 60.0; distance += 5.0) {
      const auto exact = [&](bool twists) {
        return exact_height(data, sensor, sampled.azimuth(k), distance,
                            [&](double x, double y) { return height(x, y, twists); });
      };
      const double level = exact(false);
      if (!(left_m > 9.0 && left_m < 14.0)) continue;
      worst_m = std::fmax(worst_m, std::fabs(sampled.height(k, distance) - level));
      twisted_m = std::fmax(twisted_m, std::fabs(exact(true) - level));
      ++checked;
    }
  CHECK(checked > 8);
  CHECK(twisted_m > 0.5);
  CHECK(worst_m < 0.3 * twisted_m);
}

// A scan of the road, up to 90 m. Beside it the ground is level. With a box as in scan_of.
Scan scan_of_road(const SensorModel& sensor, const RoadData& data, const CircleRoad& road, double box_x_m = 1e9) {
  const auto surface = [&](double x, double y) {  // the height above the vehicle's plane, by two steps
    double z = 0.0;
    for (int32_t i = 0; i < 3; ++i) {
      const double* const r = data.ego.r;
      const double map_x = data.ego.pose.x_m + r[0] * x + r[1] * y + r[2] * z;
      const double map_y = data.ego.pose.y_m + r[3] * x + r[4] * y + r[5] * z;
      const MapProjection at = road.map.project(map_x, map_y, -1);
      const double on_road = std::clamp(at.d_m, -CircleRoad::kWidthRight_m, CircleRoad::kWidthLeft_m);
      z = (road.height(at.s_m) - on_road * road.slope(at.s_m) - data.ego.pose.z_m - r[6] * x - r[7] * y) / r[8];
    }
    return z;
  };
  return scan_of(sensor, surface, box_x_m);
}

TEST_CASE("guess_road: without a measured attitude neither the map nor the own way tells the road, the scan does") {
  const SensorModel sensor = make_sensor(kMountings[0], 240);
  const CircleRoad road = rising_bank(true, true);
  RoadData of_map = first_look(road, 120.0), way = drive_without_map(road, 220.0);
  way.ego.pose.has_attitude = false;
  RoadData none = way;
  none.way_count = 0;
  CHECK(Sampled(way, sensor).offset_m == Sampled(none, sensor).offset_m);
  const Scan scan = scan_of_road(sensor, of_map, road);
  of_map.ego.pose.has_attitude = false, of_map.has_expected = false;
  std::fill_n(of_map.known, RoadData::kStations, false);  // as the height profile does
  CHECK(worst_on_road(Sampled(of_map, sensor, scan), of_map, road, 60.0) < 0.3);
}

TEST_CASE("guess_road: for a vehicle that faces against the map, the road bends to the other side") {
  const SensorModel sensor = make_sensor(kMountings[0], 120);
  const CircleRoad road = rising_bank(true, false);
  for (const double s_m : {200.0, 260.0}) {
    CAPTURE(s_m);
    const RoadData data = first_look(road, s_m, kPi);
    CHECK_FALSE(data.faces_along);
    CHECK(first_look(road, s_m).faces_along);
    const double plain = worst_on_road(Sampled(data, sensor), data, road, 60.0);
    const double corrected = worst_on_road(Sampled(data, sensor, scan_of_road(sensor, data, road)), data, road, 60.0);
    CHECK(corrected < 0.5 * plain);
    CHECK(corrected < 0.3);
  }
}

TEST_CASE("guess_road: where the road is not what the map lets expect, the scan's ground corrects it") {
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

  // And no pixel of that road is an obstacle. Farther away a ray comes to the road from the ground inside of the bend.
  Scan scan = scan_of_road(sensor, with, told);
  Sampled sampled(with, sensor, scan_of_road(sensor, with, told));
  test::OwnedPlane<float> height(sensor.rows, sensor.cols);
  test::OwnedBits nonground(sensor.rows, sensor.cols), steep(sensor.rows, sensor.cols);
  ref::running_ground(test::paper_params(sensor).running_ground,
                      {sampled.offset_m.data(), sampled.slope.data(), sampled.level_slope.data(),
                       sampled.known_m.data(), sampled.bound_per_m.data(), sampled.last_bound_per_m.data()},
                      scan.range, scan.elevation, height, nonground, steep);
  int32_t obstacles = 0, returns = 0;
  for (int32_t r = 0; r < sensor.rows; ++r)
    for (int32_t c = 0; c < sensor.cols; ++c) {
      const double range = double(scan.range.at(r, c)), up = double(scan.elevation.at(r, c));
      const double azimuth = double(sensor.azimuth_left_rad) - (c + 0.5) * double(sensor.pitch_rad);
      const double x = 2.3 + range * std::cos(up) * std::cos(azimuth), y = range * std::cos(up) * std::sin(azimuth);
      const double z = 0.65 + range * std::sin(up);
      double map_x, map_y;
      with.ego.to_map(x, y, z, map_x, map_y);
      if (!(range > 0.0 && range < 50.0) || std::fabs(told.map.project(map_x, map_y, -1).d_m) > 4.0) continue;
      ++returns;
      obstacles += ConstBitPlane(BitPlane(nonground)).test(r, c);
    }
  CHECK(returns > 500);
  CHECK(obstacles == 0);
}

constexpr double kTilt_rad = 0.5 * kPi / 180.0;

TEST_CASE("guess_road: a sensor that is tilted and too low lies over a known road as its ground does") {
  const CircleRoad road({.radius_m = 400.0, .slope = [](double) { return 0.2; }});
  for (const double yaw_rad : {0.0, kPi, 2.5}) {
    CAPTURE(yaw_rad);
    const SensorModel declared = make_sensor({1.8, 0.0, 0.65, 0.0, 0.0, yaw_rad}, 240);
    const SensorModel mounted = make_sensor({1.8, 0.0, 0.63, -0.8 * kTilt_rad, kTilt_rad, yaw_rad}, 240);
    const RoadData data = data_at(road, 300.0, 0.5);
    const Sampled sampled(data, declared, scan_of_road(mounted, data, road));
    CHECK(worst_on_road(Sampled(data, declared), data, road, 60.0, mounted) > 0.4);
    CHECK(worst_on_road(sampled, data, road, 60.0, mounted) < 0.08);
    CHECK(worst_on_road(sampled, data, road, 15.0, mounted) < 0.04);
    // The level, too, is that of the tilted sensor, also to its sides.
    const Sampled exact(data, mounted);
    for (int32_t k = 0; k < sampled.rays; ++k)
      CHECK(std::fabs(sampled.level_slope[std::size_t(k)] - exact.level_slope[std::size_t(k)]) < 0.005f);
    // And one that is mounted as it should be stays so.
    const Sampled right(data, declared, scan_of_road(declared, data, road));
    CHECK(worst_on_road(right, data, road, 60.0, declared) < 0.05);
  }
}

TEST_CASE("guess_road: the tilt of a sensor shows where the vehicle has driven, if that is far enough") {
  const CircleRoad road({.radius_m = 400.0, .slope = [](double) { return 0.2; }});
  const SensorModel declared = make_sensor({1.8, 0.0, 0.65, 0.0, 0.0, kPi}, 240);
  const SensorModel mounted = make_sensor({1.8, 0.0, 0.65, 0.0, kTilt_rad, kPi}, 240);
  const RoadData all = data_at(road, 300.0, 0.0);
  const auto driven = [&](double so_far_m) {
    RoadData data = all;
    for (int32_t k = 0; k < RoadData::kStations; ++k) {
      data.known[k] = k <= kHere + 2 && (kHere - k) * RoadData::kStation_m <= so_far_m;
      if (!data.known[k]) data.height_m[k] = 50.0f, data.cross_slope[k] = -1.0f;  // of no meaning
    }
    return data;
  };
  const RoadData far = driven(120.0), near = driven(15.0);
  CHECK(worst_on_road(Sampled(far, declared, scan_of_road(mounted, all, road)), far, road, 60.0, mounted) < 0.08);
  CHECK(worst_on_road(Sampled(far, declared), far, road, 60.0, mounted) > 0.4);
  const Sampled with(near, declared, scan_of_road(mounted, all, road)), without(near, declared);
  int32_t known = 0;
  for (int32_t k = 0; k < with.rays; ++k) {
    if (!(without.known_m[std::size_t(k)] > 0.0f)) continue;
    CHECK(with.height(k, 20.0) == without.height(k, 20.0));
    ++known;
  }
  CHECK(known > 0);
}

TEST_CASE("guess_road: heights that are not known are not read, on either side of the lane") {
  // In a bend the outer side of the lane reaches other stations than its inner one.
  const CircleRoad road({.radius_m = 100.0, .slope = [](double) { return 0.05; }});
  const RoadData all = data_at(road, 150.0, 0.0);
  for (const double yaw_rad : {0.0, kPi})
    for (int32_t last = kHere + 1; last < kHere + 9; ++last) {
      CAPTURE(yaw_rad);
      CAPTURE(last);
      const SensorModel sensor = make_sensor({1.8, 0.0, 0.65, 0.0, 0.0, yaw_rad}, 240);
      const auto with = [&](float height_m, float cross_slope) {
        RoadData data = all;
        for (int32_t k = 0; k < RoadData::kStations; ++k) {
          data.known[k] = k >= 2 * kHere - 10 - last && k <= last;
          if (!data.known[k]) data.height_m[k] = height_m, data.cross_slope[k] = cross_slope;
        }
        return Sampled(data, sensor, scan_of_road(sensor, all, road));
      };
      const Sampled one = with(50.0f, -1.0f), other = with(-3.0f, 0.5f);
      const Sampled known(all, sensor);
      float worst = 0.0f;
      for (int32_t k = 0; k < one.rays; ++k)
        worst = std::fmax(worst, std::fabs(one.level_slope[std::size_t(k)] - known.level_slope[std::size_t(k)]));
      CHECK(worst < 5e-4f);  // as if all were known
      CHECK(one.offset_m == other.offset_m);
      CHECK(one.slope == other.slope);
      CHECK(one.level_slope == other.level_slope);
      CHECK(one.known_m == other.known_m);
      CHECK(one.bound_per_m == other.bound_per_m);
      CHECK(one.last_bound_per_m == other.last_bound_per_m);
    }
}

TEST_CASE("guess_road: beyond the known heights the ground tells nothing about the tilt of a sensor") {
  // From 50 m behind the vehicle on, where it has not driven, the road rises to the back.
  const CircleRoad road(
      {.radius_m = 400.0, .height = [](double turn) { return 0.006 * std::fmax(250.0 - 400.0 * turn, 0.0); }});
  const SensorModel sensor = make_sensor({1.8, 0.0, 0.65, 0.0, 0.0, kPi}, 240);
  const RoadData all = data_at(road, 300.0, 0.0);
  RoadData data = all;
  for (int32_t k = 0; k < kHere - 10; ++k) data.known[k] = false;
  CHECK(worst_on_road(Sampled(data, sensor, scan_of_road(sensor, all, road)), data, road, 45.0, sensor) < 0.02);
}

TEST_CASE("guess_road: a car behind does not tilt a sensor over a known road") {
  const CircleRoad road({.radius_m = 400.0, .slope = [](double) { return 0.2; }});
  const SensorModel sensor = make_sensor({1.8, 0.0, 0.65, 0.0, 0.0, kPi}, 240);
  const RoadData data = data_at(road, 300.0, 0.0);
  const Sampled sampled(data, sensor, scan_of_road(sensor, data, road, -22.0));
  CHECK(worst_on_road(sampled, data, road, 60.0, sensor) < 0.05);
}

TEST_CASE("guess_road: rows without a return change no byte of a guess, with any number of rows") {
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

TEST_CASE("guess_road: of more ground than the fit has room for, every part of the road counts") {
  const auto higher_on_the_left = [](double x, double y) { return 0.06 * std::fmax(y - 0.5 / 400.0 * x * x, 0.0); };
  SensorModel few = make_sensor({2.3, 0.0, 0.65, 0.0, 0.0, 0.0}, 240), many = few;
  few.rows = 64, many.rows = 1024;
  const Sampled one(turning_without_map(), few, scan_of(few, higher_on_the_left));
  const Sampled other(turning_without_map(), many, scan_of(many, higher_on_the_left));
  for (int32_t k = 0; k < one.rays; ++k)
    for (const double distance : {5.0, 15.0, 40.0})
      CHECK(other.height(k, distance) == doctest::Approx(one.height(k, distance)).epsilon(0.02));
}

TEST_CASE("guess_road: a car on the road does not lift the guess") {
  const auto level = [](double, double) { return 0.0; };
  const SensorModel sensor = make_sensor({2.3, 0.0, 0.65, 0.0, 0.0, 0.0}, 240);
  for (const double car_x_m : {8.0, 15.0, 30.0}) {
    CAPTURE(car_x_m);
    check_guess(Sampled(turning_without_map(), sensor, scan_of(sensor, level, car_x_m)), level, 0.05);
  }
}

}  // namespace
}  // namespace overtake
