// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// Tracks of the vehicle frame, in the map.
#include "tools/evaluation/tracks_in_map.h"

#include <doctest/doctest.h>

#include <cmath>

#include "tools/evaluation/places.h"

namespace {

using namespace overtake::evaluation;
using doctest::Approx;

constexpr double kDeg = 3.14159265358979323846 / 180;

// An ego in a left bend of this bank, and a car that drives on a level road 50 m away from it.
std::vector<CarTruth> make_cars(double roll_rad) {
  CarTruth ego, car;
  ego.is_ego = true;
  ego.x_m = 300, ego.y_m = -40, ego.z_m = 2, ego.roll_rad = roll_rad, ego.pitch_rad = 0.01;
  ego.heading_rad = 2.2, ego.course_rad = 2.18, ego.speed_mps = 60, ego.yaw_rate_rps = 0.3;
  car.car = 1;
  car.x_m = 265, car.y_m = -4, car.z_m = 4, car.heading_rad = car.course_rad = 2.5, car.speed_mps = 55;
  return {ego, car};
}

// The car as the vehicle's pipeline sees it: its place, and how the place changes in a short time.
struct Relative {
  double x_m, y_m, speed_mps, course_rad, heading_rad;

  explicit Relative(const std::vector<CarTruth>& cars) {
    constexpr double kStep_s = 1e-4;
    const auto at = [&](double t) {
      std::vector<CarTruth> then = cars;
      for (CarTruth& c : then) {
        c.x_m += t * c.speed_mps * std::cos(c.course_rad), c.y_m += t * c.speed_mps * std::sin(c.course_rad);
        c.heading_rad += t * c.yaw_rate_rps;
      }
      return see(then[0], then[1].x_m, then[1].y_m, then[1].z_m);
    };
    const Seen now = at(0), before = at(-kStep_s), after = at(kStep_s);
    const double vx = (after.ahead_m - before.ahead_m) / (2 * kStep_s);
    const double vy = (after.left_m - before.left_m) / (2 * kStep_s);
    x_m = now.ahead_m, y_m = now.left_m, speed_mps = std::hypot(vx, vy), course_rad = std::atan2(vy, vx);
    heading_rad = heading_from_map(cars[0].roll_rad, cars[0].pitch_rad, cars[0].heading_rad, cars[1].heading_rad);
  }
};

struct Taken {
  double x_m, y_m, speed_mps, course_rad, heading_rad, yaw_rate_rps;
};
Taken take(const std::vector<CarTruth>& cars, const Relative& seen) {
  ovt_tracks in{};
  const double yaw_rate_rps = 0.1;
  in.count = 1, in.x_m = &seen.x_m, in.y_m = &seen.y_m, in.speed_mps = &seen.speed_mps;
  in.course_rad = &seen.course_rad, in.heading_rad = &seen.heading_rad, in.yaw_rate_rps = &yaw_rate_rps;
  TracksInMap tracks;
  const ovt_tracks& t = tracks.take(in, cars);
  REQUIRE(t.count == 1);
  return {t.x_m[0], t.y_m[0], t.speed_mps[0], t.course_rad[0], t.heading_rad[0], t.yaw_rate_rps[0]};
}

}  // namespace

TEST_CASE("tracks in map: what a turning vehicle sees of a car is where the car is and how it moves") {
  for (const double roll_deg : {0.0, -20.0}) {
    CAPTURE(roll_deg);
    const std::vector<CarTruth> cars = make_cars(roll_deg * kDeg);
    const Taken t = take(cars, Relative(cars));
    CHECK(t.x_m == Approx(cars[1].x_m).epsilon(1e-9));
    CHECK(t.y_m == Approx(cars[1].y_m).epsilon(1e-9));
    CHECK(t.heading_rad == Approx(cars[1].heading_rad).epsilon(1e-9));
    // A vehicle on a bank does not see how the car leaves its plane.
    CHECK(std::fabs(t.speed_mps - cars[1].speed_mps) < (roll_deg == 0 ? 0.01 : 2.0));
    CHECK(std::fabs(t.course_rad - cars[1].course_rad) < (roll_deg == 0 ? 0.1 * kDeg : 2 * kDeg));
    CHECK(std::isnan(t.yaw_rate_rps));
  }
}

TEST_CASE("tracks in map: a track that is at no car has the height of the vehicle's plane") {
  const std::vector<CarTruth> cars = make_cars(-20 * kDeg);
  Relative seen(cars);
  seen.x_m = -20, seen.y_m = 5;
  const Taken t = take(cars, seen);
  const auto axes = overtake::io::axes_of(cars[0].roll_rad, cars[0].pitch_rad, cars[0].heading_rad);
  CHECK(t.x_m == Approx(300 - 20 * axes[0][0] + 5 * axes[1][0]));
  CHECK(t.y_m == Approx(-40 - 20 * axes[0][1] + 5 * axes[1][1]));
}
