// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// The tracker of preset `best`: what a new track knows, and the second measurement.
#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "core/math.h"
#include "tests/support/lane_bench.h"

namespace {

using namespace overtake;
using test::kFrame_s, test::LaneBench, test::seen_car;
using test::make_ring, test::on_ring;

// A row without ego pose and map, of a car that drives along y.
Measurement row_along_y(double speed_mps, double t_s, double error_m = 0, double variance = 0.3) {
  Measurement z = seen_car(30 + error_m, speed_mps * t_s, 0);
  z.points = 0, z.var_x = z.var_y = variance;
  z.stamp_ns = std::llround(t_s * 1e9);
  return z;
}

}  // namespace

TEST_CASE("lane births: without map and ego pose, two rows tell speed and course, whatever the course") {
  for (int32_t direction = 0; direction < 12; ++direction) {
    CAPTURE(direction);
    const double course_rad = wrap_angle(direction * kTwoPi / 12 + 0.1), speed_mps = 30;
    LaneBench bench;
    bench.input.ego.known = false;
    TrackId id = kNobody;
    for (int32_t k = 0; k < 2; ++k) {
      const double way_m = speed_mps * 2 * k * kFrame_s;
      Measurement z = seen_car(way_m * std::cos(course_rad), way_m * std::sin(course_rad), 2 * k);
      z.points = 0, z.var_x = z.var_y = 0.04;
      const TrackId taken = bench.step(2 * k, {z})[0];
      if (k == 0) id = taken;
      REQUIRE(taken == id);
    }
    const MotionState& m = bench.state().estimate.mean;
    CHECK(m.speed_mps == doctest::Approx(speed_mps).epsilon(0.05));
    CHECK(std::fabs(wrap_angle(m.course_rad - course_rad)) < 0.01);
    const auto& p = bench.state().estimate.covariance;
    CHECK(std::sqrt(p[2][2]) == doctest::Approx(0.2 * std::sqrt(2.0) / 0.1).epsilon(0.05));
    CHECK(std::sqrt(p[3][3]) == doctest::Approx(0.2 * std::sqrt(2.0) / 3).epsilon(0.05));
    CHECK(bench.is_confirmed());
  }
}

TEST_CASE("lane births: a track of one row waits where it is, and its place spreads to all sides") {
  LaneBench bench;
  bench.input.ego.known = false;
  Measurement z = seen_car(0, 0, 0);
  z.points = 0, z.var_x = z.var_y = 0.04;
  bench.step(0, {z});
  for (int32_t k = 1; k <= 3; ++k) bench.step(k, {});
  const TrackEstimate& e = bench.state().estimate;
  CHECK(e.mean.x_m == 0);
  CHECK(e.mean.y_m == 0);
  CHECK(e.covariance[0][0] == doctest::Approx(0.04 + std::pow(30 * 3 * kFrame_s, 2)).epsilon(1e-9));
  CHECK(e.covariance[1][1] == doctest::Approx(e.covariance[0][0]).epsilon(1e-12));
}

TEST_CASE("lane births: two rows a moment apart tell no course, and the car has one track") {
  for (const double lag_s : {0.001, 0.002, 0.005, 0.01}) {
    CAPTURE(lag_s);
    LaneBench bench;
    bench.input.ego.known = false;
    bench.input.in_map = false;
    for (int32_t k = 0; k < 16; ++k) {
      bench.push({row_along_y(60, kFrame_s * k)});
      bench.push({row_along_y(60, kFrame_s * k + lag_s, 0.3)});
      CHECK(bench.rows.count == 1);
    }
    CHECK(bench.is_confirmed());
    CHECK(bench.rows.speed_mps[0] == doctest::Approx(60).epsilon(0.05));
  }
}

TEST_CASE("lane births: a track waits for its course no longer than 0.12 s, however uncertain its places are") {
  LaneBench bench;
  bench.input.ego.known = false;
  bench.input.in_map = false;
  for (int32_t k = 0; k < 5; ++k) {
    CHECK((k < 4 || bench.state().has_course));
    bench.push({row_along_y(0.2, kFrame_s * k, 0, 60)});
    if (k < 3) CHECK(!bench.state().has_course);
  }
}

TEST_CASE("lane births: the course comes from the time between two rows, also where the second one is older") {
  LaneBench bench;
  bench.input.ego.known = false;
  bench.input.in_map = false;
  const auto step = [&](double t_s, const std::vector<Measurement>& rows) {
    std::vector<TrackId> ids(rows.size(), kNobody);
    bench.input.stamp_ns = std::llround(t_s * 1e9);
    bench.input.measurements = rows;
    bench.tracker->step(bench.input, ids.data());
    bench.tracker->snapshot(bench.rows, bench.states);
  };
  step(0, {row_along_y(60, 0, 0, 0.05)});
  step(0.1, {});
  step(0.105, {row_along_y(60, 0.06, 0, 0.05)});
  REQUIRE(bench.rows.count == 1);
  CHECK(bench.state().estimate.mean.speed_mps == doctest::Approx(56).epsilon(0.08));
  // A row that is older than the first one changes nothing.
  for (const double old_s : {-0.02, -0.04}) {
    CAPTURE(old_s);
    bench.tracker->restart();
    step(10, {row_along_y(60, 10, 0, 0.05)});
    step(10.001, {row_along_y(60, 10 + old_s, 0, 0.05)});
    for (int32_t k = 1; k <= 3; ++k) step(10 + 0.05 * k, {row_along_y(60, 10 + 0.05 * k, 0, 0.05)});
    CHECK(bench.rows.count == 1);
    CHECK(bench.state().estimate.mean.speed_mps == doctest::Approx(60).epsilon(0.04));
  }
}

TEST_CASE("lane births: without a map a car has a track whatever its course, at any speed, beside any ego speed") {
  for (const double ego_mps : {0.0, 20.0, 60.0})
    for (const double course_deg : {0.0, 45.0, 90.0, 135.0, 180.0})
      for (const double v_mps : {10.0, 45.0, 75.0})
        for (const int32_t every : {1, 2}) {  // 20 and 10 Hz
          CAPTURE(ego_mps);
          CAPTURE(course_deg);
          CAPTURE(v_mps);
          CAPTURE(every);
          const double course = course_deg * kPi / 180, vx = v_mps * std::cos(course), vy = v_mps * std::sin(course);
          LaneBench bench;
          bench.input.ego.speed_mps = ego_mps;
          TrackId id = kNobody;
          for (int32_t k = 0; k <= 20; k += every) {
            const double t_s = kFrame_s * k;
            bench.ego_at(ego_mps * t_s - 30);
            Measurement z = seen_car(vx * t_s, vy * t_s + 3, k);
            z.points = 0;
            const TrackId now = bench.step(k, {z})[0];
            if (k == 0) id = now;
            CHECK(now == id);
            CHECK(bench.rows.count == 1);
            if (k < 2 * every) continue;
            CHECK(bench.is_confirmed());
            CHECK(bench.rows.speed_mps[0] == doctest::Approx(v_mps).epsilon(0.02));
            CHECK(std::fabs(wrap_angle(bench.rows.course_rad[0] - course)) < 0.02);
          }
        }
}

TEST_CASE(
    "lane births: without an ego pose a car of 300 km/h has a track, also in rows at 5 Hz, with a map and without") {
  const test::CircleRoad ring = make_ring(1e5);
  for (const bool with_map : {false, true})
    for (const int32_t every : {1, 2, 4})
      for (const double variance : {0.01, 0.3}) {
        CAPTURE(with_map);
        CAPTURE(every);
        CAPTURE(variance);
        LaneBench bench(with_map ? &ring.map : nullptr);
        bench.input.ego.known = false;
        for (int32_t k = 0; k <= 40; k += every) {
          const Place at = on_ring(1e5, 83.3 * kFrame_s * k);
          Measurement z = seen_car(at.x_m, at.y_m, k);
          z.points = 0, z.var_x = z.var_y = variance;
          bench.step(k, {z});
        }
        CHECK(bench.confirmed() == 1);
        CHECK(bench.rows.speed_mps[0] == doctest::Approx(83.3).epsilon(0.05));
      }
}

TEST_CASE("lane births: on a map, of cars one behind the other, none takes the next one's row where one is missed") {
  const test::CircleRoad ring = make_ring(1e5);
  const struct {
    double ego_mps, gap_m;
    int32_t every;
  } convoys[] = {{0, 8, 1}, {60, 8, 1}, {0, 10, 2}, {60, 10, 2}};
  for (const auto& [ego_mps, gap_m, every] : convoys) {
    CAPTURE(ego_mps);
    CAPTURE(every);
    LaneBench bench(&ring.map);
    bench.input.ego.speed_mps = ego_mps;
    std::vector<TrackId> first(8, kNobody);
    for (int32_t k = 0; k < 30; k += every) {
      const Place ego = on_ring(1e5, ego_mps * kFrame_s * k);
      bench.input.ego.x_m = ego.x_m, bench.input.ego.y_m = ego.y_m;
      std::vector<Measurement> rows;
      for (int32_t car = 0; car < 8; ++car) {
        if ((k == every && car == 0) || (k == 0 && car == 7)) continue;  // one is missed as another one comes
        const Place at = on_ring(1e5, 60 * kFrame_s * k - gap_m * car);
        rows.push_back(seen_car(at.x_m, at.y_m, k));
        rows.back().points = 0;
      }
      const std::vector<TrackId> ids = bench.step(k, rows);
      for (std::size_t i = 0; i < ids.size(); ++i) {
        const std::size_t car = i + (k == every);
        if (first[car] == kNobody) first[car] = ids[i];
        CHECK(ids[i] == first[car]);
      }
    }
    CHECK(bench.rows.count == 8);
    for (int32_t i = 0; i < bench.rows.count; ++i) CHECK(bench.rows.speed_mps[i] == doctest::Approx(60).epsilon(0.02));
  }
}
