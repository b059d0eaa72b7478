// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// The tracker of preset `best`: speeds of cars that brake, accelerate, stand, or pass a slow ego vehicle.
#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <vector>

#include "tests/support/lane_bench.h"

namespace {

using namespace overtake;
using test::kFrame_s, test::LaneBench, test::seen_car;
using test::make_ring, test::on_ring;

}  // namespace

TEST_CASE("lane speed: braking is noticed") {
  constexpr double kRadius = 3000;
  const test::CircleRoad ring = make_ring(kRadius);
  const auto speed_error = [&](double gain) {
    TrackerParams params = LaneBench::of_best();
    params.lane.manoeuvre_gain = gain;
    LaneBench bench(&ring.map, params);
    double way_m = 0, v_mps = 70, worst = 0;
    for (int32_t k = 0; k < 60; ++k) {
      if (k >= 30) v_mps -= 18 * kFrame_s;
      const Place at = on_ring(kRadius, way_m), ego = on_ring(kRadius, way_m - 40);
      bench.input.ego = {true, ego.x_m, ego.y_m, (way_m - 40) / kRadius, 50};
      bench.step(k, {seen_car(at.x_m, at.y_m, k)});
      if (k >= 45) worst = std::max(worst, std::fabs(bench.rows.speed_mps[0] - v_mps));
      way_m += v_mps * kFrame_s;
    }
    return worst;
  };
  CHECK(speed_error(10) < 2.5);
  CHECK(speed_error(1) > 1.3 * speed_error(10));
}

namespace {

// The speed of the track of a car that drives along x at 50 m/s and from frame 30 on changes its speed, less that of
// the car, in the last of `frames` frames. The car is not seen from frame `hidden` on.
double late_by(LaneBench& bench, double accel_mps2, int32_t frames, int32_t hidden = INT32_MAX) {
  double x_m = 0, v_mps = 50, late_mps = 0;
  for (int32_t k = 0; k < frames; ++k) {
    bench.ego_at(x_m - 30);
    bench.step(k, k < hidden ? std::vector{seen_car(x_m, 0, k)} : std::vector<Measurement>{});
    REQUIRE(bench.rows.count == 1);
    late_mps = bench.rows.speed_mps[0] - v_mps;
    x_m += v_mps * kFrame_s;
    if (k >= 30) v_mps += accel_mps2 * kFrame_s;
  }
  return late_mps;
}

}  // namespace

TEST_CASE("lane speed: the speed of a car that accelerates or brakes is not late by much, and its track knows why") {
  for (const double accel_mps2 : {-3.0, 3.0}) {
    CAPTURE(accel_mps2);
    const test::CircleRoad road = make_ring(1e6);
    LaneBench bench(&road.map);
    CHECK(std::fabs(late_by(bench, accel_mps2, 70)) < 0.65);
    CHECK(bench.state().estimate.accel_mps2 / accel_mps2 > 0.25);
    CHECK(bench.state().estimate.accel_mps2 / accel_mps2 < 1.25);
  }
}

TEST_CASE("lane speed: the acceleration of a car that is not seen ends soon, and a slow or new car has none") {
  const test::CircleRoad road = make_ring(1e6);
  LaneBench bench(&road.map);
  late_by(bench, -3, 70);
  const double before_mps = bench.rows.speed_mps[0];
  LaneBench hidden(&road.map);
  late_by(hidden, -3, 90, 70);
  CHECK(hidden.rows.speed_mps[0] < before_mps);
  CHECK(hidden.rows.speed_mps[0] > before_mps - 0.6);
  CHECK(std::fabs(hidden.state().estimate.accel_mps2) < 0.05);

  LaneBench young(&road.map);
  late_by(young, 3, 4);
  CHECK(young.state().estimate.accel_mps2 == 0);
  CHECK(young.state().estimate.accel_var == 0);
  LaneBench slow(&road.map);
  for (int32_t k = 0; k < 40; ++k) {
    slow.ego_at(-30);
    slow.step(k, {seen_car(0.1 * k, 0, k)});
  }
  REQUIRE(slow.rows.count == 1);
  CHECK(slow.state().estimate.accel_mps2 == 0);
  CHECK(slow.state().estimate.accel_var == 0);
}

namespace {

// A car ahead of the ego vehicle brakes from 75 m/s for 1.5 s; its deceleration grows for 0.3 s.
struct Braking {
  double brake_mps2 = 18, noise_m = 0.05, declared_m = 0.05;
  bool spins = false;  // its heading is measured, and turns
};
double speed_rms(const Braking& b) {
  const test::CircleRoad road = make_ring(1e6);
  double sum = 0;
  int32_t count = 0;
  for (uint32_t seed = 1; seed <= 20; ++seed) {
    std::mt19937_64 random(seed);
    std::normal_distribution<double> noise(0.0, b.noise_m);
    LaneBench bench(&road.map);
    double x_m = 0, v_mps = 75;
    for (int32_t k = 0; k < 70; ++k) {
      bench.ego_at(x_m - 40);
      Measurement z = seen_car(x_m + noise(random), noise(random), k);
      z.var_x = z.var_y = b.declared_m * b.declared_m;
      if (b.spins && k >= 30) z.free_heading = 1, z.heading_rad = wrap_angle(2.0 * kFrame_s * (k - 30));
      bench.step(k, {z});
      REQUIRE(bench.rows.count == 1);
      const double late_mps = bench.rows.speed_mps[0] - v_mps;
      if (k >= 40) sum += late_mps * late_mps, ++count;
      for (int32_t i = 0; i < 10; ++i) {
        const double t_s = kFrame_s * (k - 40 + 0.1 * i);
        x_m += 0.1 * kFrame_s * v_mps;
        v_mps -= 0.1 * kFrame_s * b.brake_mps2 * std::clamp(t_s / 0.3, 0.0, 1.0);
      }
    }
  }
  return std::sqrt(sum / count);
}

}  // namespace

TEST_CASE(
    "lane speed: of a car that brakes hard the speed is late by little, and no later where its places are exact") {
  CHECK(speed_rms({.brake_mps2 = 6}) < 0.48);
  CHECK(speed_rms({.brake_mps2 = 18}) < 0.85);
  CHECK(speed_rms({.brake_mps2 = 30}) < 1.4);
  CHECK(speed_rms({.brake_mps2 = 18, .declared_m = 0.15}) < 1.27);
}

TEST_CASE("lane speed: a car that spins loses its speed for long, and its track follows") {
  CHECK(speed_rms({.brake_mps2 = 7, .noise_m = 0.1, .declared_m = 0.3, .spins = true}) < 1.55);
}

// Behind the ego vehicle its own wing hides parts of a car. The place jumps when others are seen.
TEST_CASE("lane speed: a jump of a place whose error lasts is no change of speed") {
  const test::CircleRoad road = make_ring(1e6);
  LaneBench bench(&road.map);
  std::mt19937_64 random(3);
  std::normal_distribution<double> noise(0.0, 0.02);
  double worst_mps = 0;
  for (int32_t k = 0; k < 100; ++k) {
    const double x_m = 70 * kFrame_s * k;
    bench.ego_at(x_m + 40);
    Measurement z = seen_car(x_m - (k < 60 ? 0.9 : 0.0) + noise(random), noise(random), k);
    z.var_x = z.var_y = 0.06;
    bench.step(k, {z});
    if (k > 50) worst_mps = std::max(worst_mps, std::fabs(bench.rows.speed_mps[0] - 70));
  }
  CHECK(worst_mps < 1.8);
}

TEST_CASE("lane speed: a slow car on its lane changes its speed faster than a fast one, a standing one does not") {
  constexpr double kRadius = 2000;
  const test::CircleRoad ring = make_ring(kRadius);
  const auto drive = [&](double speed_mps) {
    LaneBench bench(&ring.map);
    for (int32_t k = 0; k < 60; ++k) {
      const Place at = on_ring(kRadius, speed_mps * kFrame_s * k);
      bench.ego_at(at.x_m - 30);
      bench.step(k, {seen_car(at.x_m, at.y_m, k)});
    }
    REQUIRE(bench.rows.count == 1);
    return bench.state().estimate;
  };
  const LaneEstimate slow = drive(15), fast = drive(40), standing = drive(0.5);
  CHECK(slow.covariance[2][2] > 1.5 * fast.covariance[2][2]);
  CHECK(standing.covariance[2][2] < 1.1 * fast.covariance[2][2]);
  // Its acceleration changes faster and lasts longer: each alone gives about twice the variance.
  CHECK(slow.accel_var > 2.5 * fast.accel_var);
}

TEST_CASE("lane speed: a car that stands is confirmed far away, and stays where it is while hidden") {
  const test::CircleRoad ring = make_ring(3000);
  LaneBench bench(&ring.map);
  bench.input.ego.speed_mps = 80;
  std::mt19937_64 random(9);
  std::normal_distribution<double> noise(0.0, 0.3);
  double confirmed_m = 0;
  for (int32_t k = 0; k < 40; ++k) {
    bench.ego_at(80 * kFrame_s * k - 160);
    Measurement z = seen_car(noise(random), noise(random), k);
    z.var_x = z.var_y = 0.09, z.points = 6, z.width_m = 1.7;
    bench.step(k, k < 25 ? std::vector{z} : std::vector<Measurement>{});
    if (confirmed_m == 0 && bench.is_confirmed()) confirmed_m = 160 - 80 * kFrame_s * k;
  }
  CHECK(confirmed_m > 110);
  CHECK(bench.rows.speed_mps[0] < 1.0);
  CHECK(std::hypot(bench.rows.x_m[0], bench.rows.y_m[0]) < 1.0);
}

TEST_CASE("lane speed: the ego vehicle stands, and a car that passes at any speed and rate has a track") {
  const test::CircleRoad ring = make_ring(1e5);
  for (const CircuitMap* map : {static_cast<const CircuitMap*>(nullptr), &ring.map})
    for (const int32_t frames : {1, 2})  // 20 and 10 Hz
      for (const double ego_mps : {0.0, 15.0})
        for (const double car_mps : {20.0, 40.0, 60.0, 85.0}) {
          CAPTURE((map != nullptr));
          CAPTURE(frames);
          CAPTURE(ego_mps);
          CAPTURE(car_mps);
          LaneBench bench(map);
          bench.input.ego.speed_mps = ego_mps;
          for (int32_t k = 0; k < 40 * frames; k += frames) {
            bench.ego_at(ego_mps * kFrame_s * k);
            bench.step(k, {seen_car(car_mps * kFrame_s * k - 60, 3, k)});
          }
          REQUIRE(bench.confirmed() == 1);
          CHECK(bench.rows.speed_mps[0] == doctest::Approx(car_mps).epsilon(0.02));
          CHECK(bench.rows.count == 1);
        }
}

TEST_CASE("lane speed: places whose error lasted do not make a car's exact ones look like changes of speed") {
  const test::CircleRoad road = make_ring(1e6);
  // The least mean square of the innovations in 60 frames; the places of the first 40 are of that deviation.
  const auto least_share = [&](double declared_var, double noise_m) {
    double least = 1e9;
    std::mt19937_64 random(3);
    std::normal_distribution<double> noise(0.0, noise_m);
    LaneBench bench(&road.map);
    for (int32_t k = 0; k < 40; ++k) {
      const double x_m = 70 * kFrame_s * k;
      bench.ego_at(x_m - 30);
      Measurement z = seen_car(x_m + noise(random), noise(random), k);
      z.var_x = z.var_y = declared_var;
      bench.step(k, {z});
      REQUIRE(bench.rows.count == 1);
      least = std::min(least, bench.state().along_share);
    }
    return least;
  };
  CHECK(least_share(0.01, 0.05) < 0.6);
  CHECK(least_share(0.06, 0.05) == 1.0);
}

namespace {

// Whether a car has one id before and after frames that are lost. It drives along x from `from_mps` and brakes from
// frame 40 on; the first frame after the loss is `again`.
bool is_found(const CircuitMap* map, double from_mps, double brake_mps2, int32_t lost, int32_t again) {
  LaneBench bench(map);
  double x_m = 0, v_mps = from_mps;
  TrackId before = kNobody;
  for (int32_t k = 0;; ++k) {
    bench.input.ego = {true, x_m - 30, 0, 0, v_mps};
    if (k < lost || k == again) {
      const TrackId id = bench.step(k, {seen_car(x_m, 0, k)})[0];
      if (k == again) return id == before;
      before = id;
    }
    const double slower_mps = k < 40 ? 0.0 : brake_mps2 * kFrame_s;
    x_m += (v_mps - 0.5 * slower_mps) * kFrame_s;
    v_mps -= slower_mps;
  }
}

}  // namespace

TEST_CASE("lane speed: a car that brakes hard is the same one after a gap between frames") {
  const test::CircleRoad road = make_ring(1e6);
  CHECK(is_found(&road.map, 80, 20, 52, 71));
  CHECK(is_found(&road.map, 80, 30, 52, 65));
}

TEST_CASE("lane speed: a new car much faster than expected has one track, though it is missed at first") {
  const test::CircleRoad road = make_ring(1e6);
  for (const auto& [missed, step] : {std::pair{3, 1}, std::pair{2, 2}}) {  // 20 Hz, 10 Hz
    CAPTURE(step);
    LaneBench bench(&road.map);
    TrackId first = kNobody, last = kNobody;
    for (int32_t i = 0; i <= missed + 1; ++i) {
      const int32_t k = i * step;
      bench.input.ego = {true, 80 * kFrame_s * k - 20, 0, 0, 80};
      const bool is_seen = i == 0 || i > missed;
      bench.step(k, is_seen ? std::vector{seen_car(90 * kFrame_s * k, 0, k)} : std::vector<Measurement>{});
      if (is_seen) (i == 0 ? first : last) = bench.ids[0];
    }
    CHECK(first == last);
  }
}
