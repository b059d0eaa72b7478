// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// The tracker of preset `best`: where its tracks are.
#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <random>
#include <vector>

#include "core/math.h"
#include "tests/support/lane_bench.h"

namespace {

using namespace overtake;
using test::kFrame_s, test::LaneBench, test::ns_of, test::seen_car;
using test::make_ring, test::on_ring;

}  // namespace

TEST_CASE("lane tracker: the height of a pushed row does not make it a cluster, whose error lasts and may be clutter") {
  const auto variance_of = [](int32_t points, double height_m) {
    LaneBench bench;
    Measurement z = seen_car(0, 0, 0);
    z.points = points, z.height_m = height_m, z.var_x = z.var_y = 0.25;
    bench.step(0, {z});
    return bench.state().estimate.covariance[0][0];
  };
  CHECK(variance_of(0, kNotMeasured) == 0.25);
  CHECK(variance_of(0, 1.1) == 0.25);
  CHECK(variance_of(100, 1.1) > 0.5);
}

TEST_CASE("lane tracker: a frame that does not use the map takes it from cars that are not seen, too") {
  const test::CircleRoad ring = make_ring(250);
  for (const bool in_view : {true, false}) {
    CAPTURE(in_view);
    LaneBench bench(&ring.map);
    for (int32_t k = 0; k < 20; ++k) {
      const Place at = on_ring(250, 50 * kFrame_s * k);
      bench.input.ego = {true, at.x_m - 30, at.y_m, 0, 50};
      bench.step(k, {seen_car(at.x_m, at.y_m, k)});
    }
    if (!in_view) bench.input.sector_count = 0;
    bench.step(20, {});
    REQUIRE(bench.rows.count == 1);
    CHECK(bench.state().asks_map == 1);
    CHECK(bench.state().lane.curvature_per_m > 0.003);
    bench.input.ask_map = false;
    bench.step(21, {});
    REQUIRE(bench.rows.count == 1);
    CHECK(bench.state().asks_map == 0);
    CHECK(bench.state().lane.curvature_per_m == 0);
  }
}

TEST_CASE("lane tracker: a car that is lost where a bend begins follows the lane, without a map it goes on as before") {
  constexpr double kRadius = 250;
  const test::CircleRoad ring = make_ring(kRadius);
  const auto error_after_2s = [&](const CircuitMap* map) {
    LaneBench bench(map);
    for (int32_t k = 0; k <= 60; ++k) {  // along the ring's tangent, and lost where it touches the ring
      const Place at = {50 * kFrame_s * (k - 20), 0};
      bench.input.ego = {true, at.x_m - 30, at.y_m, 0, 50};
      bench.step(k, k <= 20 ? std::vector{seen_car(at.x_m, at.y_m, k)} : std::vector<Measurement>{});
    }
    const Place truth = on_ring(kRadius, 50 * kFrame_s * 40);
    return std::hypot(bench.rows.x_m[0] - truth.x_m, bench.rows.y_m[0] - truth.y_m);
  };
  CHECK(error_after_2s(&ring.map) < 7.0);
  CHECK(error_after_2s(nullptr) > 15.0);
}

TEST_CASE(
    "lane tracker: a car that is lost while it leaves its offset becomes parallel to its lane, without a map it goes "
    "on") {
  constexpr double kRadius = 2000, kOff_rad = 0.04;
  constexpr int32_t kSeen = 12;
  const test::CircleRoad ring = make_ring(kRadius);
  struct Guess {
    double off_m, off_rad, var_m2;
  };
  const auto guess_after_2s = [&](const CircuitMap* map) {
    LaneBench bench(map);
    double last_m = 0;
    Guess guess{};
    for (int32_t k = 0; k < kSeen + 40; ++k) {
      const double way_m = 50 * kFrame_s * k;
      const Place on_line = on_ring(kRadius, way_m), ego = on_ring(kRadius, way_m - 30);
      bench.input.ego = {true, ego.x_m, ego.y_m, (way_m - 30) / kRadius, 50};
      const double angle = way_m / kRadius, left_m = kOff_rad * way_m;
      if (k < kSeen) last_m = left_m;
      const Measurement car =
          seen_car(on_line.x_m - left_m * std::sin(angle), on_line.y_m + left_m * std::cos(angle), k);
      bench.step(k, k < kSeen ? std::vector{car} : std::vector<Measurement>{});
      if (bench.rows.count == 0) continue;
      const double from_middle_m = std::hypot(bench.rows.x_m[0], bench.rows.y_m[0] - kRadius);
      guess = {kRadius - from_middle_m - last_m, wrap_angle(bench.rows.course_rad[0] - angle),
               bench.rows.covariance[2][0]};
    }
    REQUIRE(bench.rows.count == 1);
    return guess;
  };
  const Guess on_lane = guess_after_2s(&ring.map), free = guess_after_2s(nullptr);
  CHECK(on_lane.off_m > 0.2);  // after some way
  CHECK(on_lane.off_m < 1.5);
  CHECK(std::fabs(on_lane.off_rad) < 0.003);
  CHECK(on_lane.var_m2 > 0.4 * 0.4 * 1.9 * 1.9);  // path_across in a second
  CHECK(free.off_m > 2.5);
}

TEST_CASE("lane tracker: places that jump across turn no course, a car that leaves its course does") {
  constexpr double kRadius = 3000;
  const test::CircleRoad ring = make_ring(kRadius);
  // Degrees between course and lane at frame 31 to 44. The place is `jump_m` too far left for four frames, or the car
  // turns off at `turn_rps` for half a second.
  const auto course_error = [&](double jump_m, double turn_rps, double var_m2) {
    LaneBench bench(&ring.map);
    double way_m = 0, off_m = 0, off_rad = 0, worst = 0;
    for (int32_t k = 0; k < 45; ++k) {
      if (k >= 30 && k < 40) off_rad += turn_rps * kFrame_s;
      const Place on = on_ring(kRadius, way_m), ego = on_ring(kRadius, way_m - 40);
      bench.input.ego = {true, ego.x_m, ego.y_m, (way_m - 40) / kRadius, 50};
      const double scale = 1.0 - (off_m + (k >= 30 && k < 34 ? jump_m : 0.0)) / kRadius;  // to the centre of the ring
      Measurement z = seen_car(on.x_m * scale, kRadius + (on.y_m - kRadius) * scale, k);
      z.var_x = z.var_y = var_m2, z.points = 6;
      bench.step(k, {z});
      const double lane_rad = way_m / kRadius;
      if (k > 30) worst = std::max(worst, std::fabs(wrap_angle(bench.rows.course_rad[0] - lane_rad - off_rad)));
      way_m += 50 * std::cos(off_rad) * kFrame_s;
      off_m += 50 * std::sin(off_rad) * kFrame_s;
    }
    return worst * 180 / kPi;
  };
  CHECK(course_error(1.0, 0, 0.09) < 2.0);  // far away: three standard deviations
  CHECK(course_error(0, 0.5, 0.01) < 9.0);  // near
}

TEST_CASE("lane tracker: frames in any order give the bytes of the sorted order, with map, losses and joins") {
  constexpr double kRadius = 200;
  const test::CircleRoad ring = make_ring(kRadius);
  std::mt19937_64 random(31);
  const auto draw = [&](double low, double high) { return std::uniform_real_distribution<double>(low, high)(random); };
  int64_t joined = 0, refiltered = 0;
  for (int32_t run = 0; run < 20; ++run) {
    struct Scene {
      TrackerFrame input;
      std::vector<Measurement> seen;
    };
    std::vector<Scene> scenes(120);
    double start_m[4], speed_mps[4];
    for (int32_t c = 0; c < 4; ++c) start_m[c] = draw(-60, 60), speed_mps[c] = draw(0, 70);
    for (int32_t k = 0; k < int32_t(scenes.size()); ++k) {
      Scene& scene = scenes[std::size_t(k)];
      const Place ego = on_ring(kRadius, 40 * kFrame_s * k);
      scene.input.stamp_ns = ns_of(k);
      scene.input.ego = {true, ego.x_m, ego.y_m, wrap_angle(40 * kFrame_s * k / kRadius), 40};
      scene.input.ask_map = k % 17 != 0;
      for (int32_t c = 0; c < 4; ++c) {
        if ((k / 20 + c) % 3 == 0 && draw(0, 1) < 0.9) continue;  // hidden for a second
        const Place at = on_ring(kRadius, start_m[c] + speed_mps[c] * kFrame_s * k);
        for (int32_t parts = draw(0, 1) < 0.2 ? 2 : 1; parts > 0; --parts) {
          Measurement z = seen_car(at.x_m + draw(-1, 1), at.y_m + draw(-1, 1), k);
          z.stamp_ns -= int64_t(draw(0, 40e6));
          z.height_m = draw(0, 1.2), z.points = int32_t(draw(1, 200)), z.view = int32_t(draw(0, 2.99));
          z.free_heading = draw(0, 1) < 0.3, z.heading_rad = draw(-3, 3), z.debris = draw(0, 1) < 0.05;
          scene.seen.push_back(z);
        }
      }
    }
    LaneBench sorted(&ring.map), late(&ring.map);
    const auto feed = [](LaneBench& bench, Scene& scene) {
      scene.input.measurements = scene.seen;
      bench.tracker->step(scene.input, nullptr);
    };
    for (Scene& scene : scenes) feed(sorted, scene);
    std::vector<std::size_t> order(scenes.size());
    for (std::size_t i = 0; i < order.size(); ++i) order[i] = i;
    for (std::size_t i = 1; i + 5 < order.size(); i += 5)
      std::shuffle(order.begin() + long(i), order.begin() + long(i) + 5, random);
    for (const std::size_t i : order) feed(late, scenes[i]);
    for (LaneBench* bench : {&sorted, &late}) bench->tracker->snapshot(bench->rows, bench->states);
    REQUIRE(sorted.rows.count == late.rows.count);
    CHECK(std::memcmp(sorted.states, late.states, std::size_t(sorted.rows.count) * sizeof(LaneTrack)) == 0);
    const TrackerCounts a = sorted.tracker->counts(), b = late.tracker->counts();
    CHECK(a.joined == b.joined);
    CHECK(a.hits == b.hits);
    CHECK(a.births == b.births);
    CHECK(b.late == 0);
    CHECK(a.measurements == a.hits + a.births + a.unborn + a.debris);
    CHECK(a.births == sorted.rows.count + a.deaths);
    joined += a.joined, refiltered += b.refiltered;
  }
  CHECK(joined > 0);
  CHECK(refiltered > 0);
}

TEST_CASE("lane tracker: any input leaves finite tracks") {
  constexpr double kRadius = 200;
  const test::CircleRoad ring = make_ring(kRadius);
  std::mt19937_64 random(41);
  const auto draw = [&](double low, double high) { return std::uniform_real_distribution<double>(low, high)(random); };
  const double odd[] = {0, -0.0, 1e-300, 1e300, -1e9, kNotMeasured, std::numeric_limits<double>::infinity(), 1e8};
  const auto any = [&](double usual) { return draw(0, 1) < 0.1 ? odd[std::size_t(draw(0, 7.99))] : usual; };
  LaneBench bench(&ring.map);
  int64_t stamp_ns = 0;
  for (int32_t k = 0; k < 20000; ++k) {
    stamp_ns += int64_t(draw(0, 1) < 0.01 ? draw(-1e9, 9e9) : draw(-2e7, 1e8));
    std::vector<Measurement> seen;
    const Place ego = on_ring(kRadius, k * 2.0);
    for (int32_t i = int32_t(draw(0, 6)); i > 0; --i) {
      Measurement z = seen_car(any(ego.x_m + draw(-40, 40)), any(ego.y_m + draw(-40, 40)), 0);
      z.var_x = any(draw(0, 1)), z.var_y = any(draw(0, 1)), z.cov_xy = any(0);
      z.heading_rad = any(draw(-4, 4)), z.free_heading = 1, z.height_m = any(1), z.length_m = any(4),
      z.width_m = any(1);
      z.points = int32_t(draw(-5, 5000)), z.object_class = int32_t(draw(-2, 5)), z.view = int32_t(draw(-2, 5));
      z.stamp_ns = stamp_ns - int64_t(draw(0, 1) < 0.02 ? draw(-2e9, 2e9) : draw(0, 5e7));
      seen.push_back(z);
    }
    bench.input.stamp_ns = stamp_ns;
    bench.input.measurements = seen;
    bench.input.ego = {draw(0, 1) < 0.9, any(ego.x_m), any(ego.y_m), any(0.3), any(40)};
    bench.input.in_map = draw(0, 1) < 0.95, bench.input.ask_map = draw(0, 1) < 0.8;
    bench.tracker->step(bench.input, nullptr);
    bench.tracker->snapshot(bench.rows, bench.states);
    for (int32_t i = 0; i < bench.rows.count; ++i) {
      bool finite = true;
      for_each_column(bench.rows, [&](const char*, const auto* column) { finite &= std::isfinite(double(column[i])); });
      if (!finite) FAIL("frame " << k << ", track " << i);
    }
    bench.publish_at(stamp_ns + int64_t(any(draw(-1, 1)) > 0 ? 3e9 : -3e9));
    REQUIRE(bench.told.count == bench.rows.count);
    for (int32_t i = 0; i < bench.told.count; ++i) {
      const OptionalTrackTable& t = bench.told;
      const bool in_limits = t.existence[i] > 0 && t.existence[i] < 1 && t.unseen_s[i] >= 0 && t.unseen_s[i] < 100 &&
                             t.heading_sigma_rad[i] > 0 && t.heading_sigma_rad[i] <= kPi;
      if (!in_limits) FAIL("frame " << k << ", track " << i << ": existence, time or heading");
    }
    const TrackerCounts c = bench.tracker->counts();
    REQUIRE(c.births == bench.rows.count + c.deaths);
  }
  CHECK(bench.tracker->counts().hits > 1000);
}

TEST_CASE("lane tracker: the error of a car seen in part lasts near the ego vehicle, so its detection counts less") {
  const auto variance_at = [](double x_m, double var, double y_m = 0) {
    LaneBench bench;
    Measurement z = seen_car(x_m, y_m, 0);
    z.var_x = z.var_y = var;
    bench.step(0, {z});
    return bench.state().estimate.covariance[0][0];
  };
  const double share = LaneTrackerParams{}.part_share;
  CHECK(variance_at(20, 0.25) == doctest::Approx(0.25 * (1 + share)));
  CHECK(variance_at(50, 0.25) == doctest::Approx(0.25 * (1 + share)));
  CHECK(variance_at(100, 0.25) == doctest::Approx(0.25 * (1 + 0.25 * share)));
  CHECK(variance_at(20, 0.025) == doctest::Approx(0.025 * (1 + 0.1 * share)));
  CHECK(variance_at(20, 2.5) == doctest::Approx(2.5 * (1 + share)));
  // Behind the own rear wing.
  CHECK(variance_at(-60, 0.25) == doctest::Approx(0.25 * (1 + share * 10 / 3)));
  CHECK(variance_at(-120, 0.25) == doctest::Approx(0.25 * (1 + share * 10 / 3 / 16)));
  CHECK(variance_at(-60, 0.25, 20) == doctest::Approx(0.25 * (1 + share * 10 / 3)).epsilon(0.3));
  CHECK(variance_at(-60, 0.25, 30) < 0.25 * (1 + share));  // beside it
}

TEST_CASE("lane tracker: the error of a car in smoke is another one in each frame, and counts once") {
  LaneBench bench;
  Measurement z = seen_car(20, 0, 0);
  z.var_x = z.var_y = 0.25, z.in_smoke = 1;
  bench.step(0, {z});
  CHECK(bench.state().estimate.covariance[0][0] == doctest::Approx(0.25));
}

TEST_CASE("lane tracker: a car that is lost off the map goes on, also when its course has become unknown") {
  constexpr double kSpeed_mps = 10;
  constexpr int32_t kSeen = 5, kLast = kSeen + 180;
  LaneBench bench;
  for (int32_t k = 0; k <= kLast; ++k) {
    const double way_m = kSpeed_mps * k * kFrame_s;
    bench.input.ego = {true, way_m - 30, 0, 0, kSpeed_mps};
    bench.step(k, k <= kSeen ? std::vector{seen_car(way_m, 0, k)} : std::vector<Measurement>{});
  }
  const TrackEstimate& e = bench.state().estimate;
  CHECK(e.covariance[3][3] > kPi * kPi);
  CHECK(e.mean.x_m == doctest::Approx(kSpeed_mps * kLast * kFrame_s).epsilon(0.1));
}

TEST_CASE("lane tracker: a car that stands at exactly one place for an hour keeps its track") {
  LaneBench bench;
  bench.input.ego = {true, -30, 0, 0, 0};
  Measurement z = seen_car(1.5, -2.25, 0);
  z.points = 0, z.var_x = z.var_y = 0.04;
  TrackId id = kNobody;
  int32_t others = 0;
  for (int32_t k = 0; k < 72'000; ++k) {
    z.stamp_ns = seen_car(0, 0, k).stamp_ns;
    const TrackId taken = bench.step(k, {z})[0];
    if (k == 0) id = taken;
    others += taken != id;
  }
  CHECK(others == 0);
  CHECK(bench.is_confirmed());
  CHECK(bench.state().estimate.mean.speed_mps == 0);
  CHECK(bench.state().estimate.covariance[0][0] < 1);
}

TEST_CASE("lane tracker: in a hairpin of more than half a turn the yaw rate has the sign of the lane") {
  // Radius 12 m, 189 deg, between straights.
  static constexpr double kRadius = 12, kTurn = 3.3, kStraight = 200, kSpeed = 13;
  struct Pose {
    double x, y, yaw;
  };
  const auto pose_at = [](double s_m) {
    const double angle = std::clamp((s_m - kStraight) / kRadius, 0.0, kTurn);
    const double in_m = std::min(s_m, kStraight), out_m = std::max(s_m - kStraight - kTurn * kRadius, 0.0);
    return Pose{in_m + kRadius * std::sin(angle) + out_m * std::cos(angle),
                kRadius * (1 - std::cos(angle)) + out_m * std::sin(angle), wrap_angle(angle)};
  };
  std::vector<double> x, y, half;
  for (double s_m = 0; s_m < 2 * kStraight + kTurn * kRadius; s_m += 1)
    x.push_back(pose_at(s_m).x), y.push_back(pose_at(s_m).y), half.push_back(8);
  CircuitMap map;
  const char* error = nullptr;
  REQUIRE(map.build(x.data(), y.data(), half.data(), half.data(), nullptr, int32_t(x.size()), false, &error));
  LaneBench bench(&map);
  for (int32_t k = 0; k < 380; ++k) {
    const double s_m = 120 + kSpeed * kFrame_s * k;
    const Pose ego = pose_at(s_m - 15), car = pose_at(s_m);
    bench.input.ego = {true, ego.x, ego.y, ego.yaw, kSpeed};
    bench.step(k, {seen_car(car.x, car.y, k)});
    CAPTURE(s_m);
    REQUIRE(bench.rows.count == 1);
    if (s_m > kStraight + 10 && s_m < kStraight + kTurn * kRadius)
      CHECK(std::fabs(bench.state().estimate.mean.yaw_rate_rps - kSpeed / kRadius) < 0.5);
    if (s_m > kStraight + kTurn * kRadius + 40) break;
  }
}

TEST_CASE("lane tracker: beyond the end of an open line a car goes straight on, and comes back with its id") {
  static constexpr double kRadius = 250, kEnd_m = 300, kSpeed = 50;
  const auto pose_at = [](double s_m) {
    const Place at = on_ring(kRadius, std::min(s_m, kEnd_m));
    const double yaw = std::min(s_m, kEnd_m) / kRadius, out_m = std::max(s_m - kEnd_m, 0.0);
    return TrackerEgo{true, at.x_m + out_m * std::cos(yaw), at.y_m + out_m * std::sin(yaw), yaw, kSpeed};
  };
  std::vector<double> x, y, half;
  for (double s_m = 0; s_m <= kEnd_m; s_m += 2)
    x.push_back(pose_at(s_m).x_m), y.push_back(pose_at(s_m).y_m), half.push_back(8);
  CircuitMap map;
  const char* error = nullptr;
  REQUIRE(map.build(x.data(), y.data(), half.data(), half.data(), nullptr, int32_t(x.size()), false, &error));
  LaneBench bench(&map);
  TrackId first = kNobody;
  for (int32_t k = 0; k < 160; ++k) {
    const double s_m = 40 + kSpeed * kFrame_s * k;
    const TrackerEgo car = pose_at(s_m);
    bench.input.ego = pose_at(s_m - 25);
    const bool is_hidden = s_m > kEnd_m + 4 && s_m < kEnd_m + 70;
    const auto& ids =
        bench.step(k, is_hidden ? std::vector<Measurement>{} : std::vector{seen_car(car.x_m, car.y_m, k)});
    CAPTURE(s_m);
    REQUIRE(bench.rows.count == 1);
    if (s_m > kEnd_m) CHECK(std::hypot(bench.rows.x_m[0] - car.x_m, bench.rows.y_m[0] - car.y_m) < 6.0);
    if (k == 20) first = ids[0];
    if (!ids.empty() && k > 20) CHECK(ids[0] == first);
  }
}

TEST_CASE("lane tracker: a car that is first seen while it drives across its lane keeps its track") {
  constexpr double kRadius = 400, kHeading = 0.5, kFrom_m = 7, kWidth_m = 14;
  const test::CircleRoad ring = make_ring(kRadius);
  const Place middle = on_ring(kRadius, kHeading * kRadius);
  for (const double turn_rad : {0.3, 0.5, 0.7, 1.0, -0.7, -1.0})
    for (const double speed : {12.0, 20.0}) {
      CAPTURE(turn_rad);
      CAPTURE(speed);
      LaneBench bench(&ring.map);
      const double course = kHeading + turn_rad, from_m = turn_rad > 0 ? -kFrom_m : kFrom_m;
      const auto frames = int32_t(kWidth_m / (speed * std::sin(std::fabs(turn_rad)) * kFrame_s));
      TrackId id = kNobody;
      for (int32_t k = 0; k < frames; ++k) {
        const double way_m = speed * kFrame_s * k, ego_m = 25 * kFrame_s * k - 40;
        bench.input.ego = {true, middle.x_m + ego_m * std::cos(kHeading), middle.y_m + ego_m * std::sin(kHeading),
                           kHeading, 50};
        const double x_m = middle.x_m - from_m * std::sin(kHeading) + way_m * std::cos(course);
        const double y_m = middle.y_m + from_m * std::cos(kHeading) + way_m * std::sin(course);
        const TrackId now = bench.step(k, {seen_car(x_m, y_m, k)})[0];
        CAPTURE(k);
        if (k > 0) CHECK(now == id);
        id = now;
        CHECK(bench.rows.count == 1);
        if (k > 5) CHECK(std::fabs(wrap_angle(bench.rows.course_rad[0] - course)) < 0.25);
      }
    }
}

TEST_CASE("lane tracker: a car that is not seen in a curve is where its lane leads, also after a gap between frames") {
  for (const double radius_m : {150.0, 300.0}) {
    CAPTURE(radius_m);
    const test::CircleRoad ring = make_ring(radius_m);
    const double v_mps = radius_m < 200 ? 50 : 60;
    LaneBench bench(&ring.map);
    TrackId id = kNobody;
    for (int32_t k = 0; k < 62; ++k) {
      if (k >= 43 && k < 61) continue;
      const double way_m = v_mps * kFrame_s * k;
      const Place at = on_ring(radius_m, way_m), ego = on_ring(radius_m, way_m - 30);
      bench.input.ego = {true, ego.x_m, ego.y_m, wrap_angle((way_m - 30) / radius_m), v_mps, v_mps / radius_m};
      const bool is_seen = k < 40 || k == 61;
      bench.step(k, is_seen ? std::vector{seen_car(at.x_m, at.y_m, k)} : std::vector<Measurement>{});
      if (k == 39) id = bench.ids[0];
      if (k == 61) CHECK(bench.ids[0] == id);
    }
    CHECK(bench.rows.count == 1);
  }
}

TEST_CASE("lane tracker: the errors of a car that stands do not turn its published course round") {
  std::mt19937_64 random(5);
  std::normal_distribution<double> error(0, 0.1);
  const test::CircleRoad ring = make_ring(1e5);
  for (const bool with_map : {false, true}) {
    CAPTURE(with_map);
    LaneBench bench(with_map ? &ring.map : nullptr);
    double way_m = 0, v_mps = 20;
    bool was_turned = false;
    for (int32_t k = 0; k < 200; ++k) {
      v_mps = std::max(0.0, v_mps - 10 * kFrame_s);
      way_m += v_mps * kFrame_s;
      const Place at = on_ring(1e5, way_m);
      bench.step(k, {seen_car(at.x_m + error(random), at.y_m + error(random), k)});
      if (k < 10) continue;
      CHECK(std::fabs(bench.rows.course_rad[0]) < 0.5);
      CHECK(bench.rows.speed_mps[0] >= 0);
      was_turned = was_turned || std::fabs(bench.state().estimate.mean.course_rad) > 2.6;
    }
    CHECK(was_turned);
    // A car that reverses drives the other way.
    for (int32_t k = 200; k < 260; ++k) {
      way_m -= 5 * kFrame_s;
      const Place at = on_ring(1e5, way_m);
      bench.step(k, {seen_car(at.x_m + error(random), at.y_m + error(random), k)});
    }
    CHECK(std::fabs(bench.rows.course_rad[0]) > 2.6);
    CHECK(bench.rows.speed_mps[0] == doctest::Approx(5).epsilon(0.2));
  }
}

TEST_CASE("lane tracker: where the ego pose jumps, the tracks of its sensors move with it, and those of rows do not") {
  for (const bool of_rows : {false, true})
    for (const double jump_m : {-3.0, 0.0, 2.0}) {
      CAPTURE(of_rows);
      CAPTURE(jump_m);
      LaneBench bench;
      for (int32_t k = 0; k < 21; ++k) {
        const double wrong_m = k < 20 ? 0.0 : jump_m;  // of the ego pose
        bench.ego_at(50 * kFrame_s * k - 30 + wrong_m);
        bench.input.ego.y_m = wrong_m;
        Measurement z = seen_car(50 * kFrame_s * k, 0, k);
        if (of_rows) z.points = 0;
        bench.step(k, k < 20 ? std::vector{z} : std::vector<Measurement>{});
      }
      CHECK(bench.rows.x_m[0] == doctest::Approx(50 * kFrame_s * 20 + (of_rows ? 0.0 : jump_m)).epsilon(0.002));
      CHECK(std::fabs(bench.rows.y_m[0] - (of_rows ? 0.0 : jump_m)) < 0.1);
    }
}
