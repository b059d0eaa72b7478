// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// The road surface along the rays of a sensor, against the exact surface of roads with a closed form.
#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <utility>
#include <vector>

#include "tests/support/road_samples.h"

namespace overtake {
namespace {

using test::CircleRoad, test::Mounting, test::Sampled, test::Scan;
using test::data_at, test::exact_height, test::make_sensor, test::kHere, test::kLevel, test::kMountings;

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

TEST_CASE("sample_road: each ray tells where it passes a bound of the circuit, and none without a map") {
  constexpr double kRadius = 400.0;
  const CircleRoad road({.radius_m = kRadius});
  for (const Mounting& mounting : kMountings) {
    const SensorModel sensor = make_sensor(mounting);
    for (const double d_m : {-2.0, 3.0}) {
      const RoadData data = data_at(road, 50.0, d_m);
      const Sampled sampled(data, sensor);
      int32_t passed = 0;
      for (int32_t k = 0; k < sampled.rays; ++k) {
        const double per_m = double(sampled.bound_per_m[std::size_t(k)]);
        if (per_m == 0.0) continue;
        double left_m = 0.0;
        exact_height(data, sensor, sampled.azimuth(k), 1.0 / per_m, [&](double x, double y) {
          left_m = kRadius - std::hypot(x, y - kRadius);
          return 0.0;
        });
        const double outside_m = std::fmax(left_m - CircleRoad::kWidthLeft_m, -CircleRoad::kWidthRight_m - left_m);
        CHECK(std::fabs(outside_m) < 0.2);
        ++passed;
      }
      CHECK(passed > sampled.rays * 3 / 4);  // the others go along the road
    }
    RoadData none = data_at(road, 50.0, 0.0);
    none.map = nullptr;
    const Sampled without(none, sensor);
    CHECK(std::all_of(without.bound_per_m.begin(), without.bound_per_m.end() - 1, [](float v) { return v == 0.0f; }));
  }
}

TEST_CASE("sample_road: across a bend, a ray also tells where it leaves the circuit for the last time") {
  constexpr double kRadius = 100.0;
  const CircleRoad road({.radius_m = kRadius});
  const SensorModel sensor = make_sensor(kMountings[0]);
  const RoadData data = data_at(road, 50.0, 0.0);
  const Sampled sampled(data, sensor);
  int32_t twice = 0;
  for (int32_t k = 0; k < sampled.rays; ++k) {
    const double first = double(sampled.bound_per_m[std::size_t(k)]);
    const double last = double(sampled.last_bound_per_m[std::size_t(k)]);
    CHECK((first == 0.0) == (last == 0.0));
    CHECK(last <= first);
    if (last == first) continue;
    const auto left_of = [&](double distance_m) {
      double left_m = 0.0;
      exact_height(data, sensor, sampled.azimuth(k), distance_m, [&](double x, double y) {
        left_m = kRadius - std::hypot(x, y - kRadius);
        return 0.0;
      });
      return left_m;
    };
    CHECK(left_of(1.0 / first) == doctest::Approx(CircleRoad::kWidthLeft_m).epsilon(0.05));   // towards the inside
    CHECK(left_of(1.0 / last) == doctest::Approx(-CircleRoad::kWidthRight_m).epsilon(0.05));  // and to the outer wall
    ++twice;
  }
  CHECK(twice >= 2);
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
  const double wide[] = {4e8, 4e8, 4e8, 4e8}, banking[] = {1.0, -1.0, 0.9, 0.3};
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
