// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// The gates of preset `best`: each removes what it should, keeps every car, and counts.
#include <doctest/doctest.h>

#include <algorithm>
#include <vector>

#include "tests/support/rules_bench.h"

namespace {

using namespace overtake;
using namespace overtake::test;

// Number of candidates that remain of one cluster.
int32_t keep(const Spots& spots, int32_t Frame::*counter = nullptr, bool with_map = true) {
  RulesBench bench(with_map);
  bench.add(spots);
  gate(bench);
  if (counter) CHECK(bench.frame.*counter == 1 - bench.frame.kept_count);
  return bench.frame.kept_count;
}

TEST_CASE("car gates: fewer than three points, and the points of the own car") {
  CHECK(keep({{20, 0, 0.5f}, {20, 0.5f, 0.5f}}, &Frame::gated_points) == 0);
  CHECK(keep({{20, 0, 0.5f}, {20, 0.5f, 0.5f}, {20, 0.2f, 0.5f}}, &Frame::gated_points) == 1);
  CHECK(keep(corners(-1.4f, 4.4f, -1.1f, 1.1f, 0, 1), &Frame::gated_own) == 0);
  CHECK(keep(corners(3, 4.4f, -0.5f, 0.5f, 0, 1), &Frame::gated_own) == 0);
  CHECK(keep(corners(3, 4.6f, -0.5f, 0.5f, 0, 1), &Frame::gated_own) == 1);  // a rear that touches the own nose
  CHECK(keep(corners(0, 3, 1.0f, 1.3f, 0, 1), &Frame::gated_own) == 1);      // a flank beside
  CHECK(keep(corners(-1.6f, 0, -1, 1, 0, 1), &Frame::gated_own) == 1);
}

TEST_CASE("car gates: two points far away on the circuit are faint, and no detection") {
  const auto faint = [](const Spots& spots, bool with_map = true, double ego_y_m = 0.0) {
    RulesBench bench(with_map);
    if (ego_y_m != 0.0) bench.clear(ego_y_m);
    bench.add(spots);
    bench.run();
    CHECK(bench.frame.gated_points == 1);
    CHECK(bench.frame.detections.count == 0);
    CHECK(bench.frame.views.count == 0);
    if (bench.frame.faint_count == 1) {
      CHECK(bench.frame.detections.x_m[0] == doctest::Approx(double(spots[0].x)).epsilon(0.05));
      CHECK(bench.frame.detections.y_m[0] == doctest::Approx(double(spots[0].y)).epsilon(0.05));
      CHECK(bench.frame.views.var_x[0] > 0.1f);
      CHECK(bench.frame.views.object_class[0] == OVT_CLASS_UNKNOWN);
    }
    return bench.frame.faint_count;
  };
  const auto pair = [](float x, float y, float z = 0.5f) { return Spots{{x, y, z}, {x, y + 0.1f, z}}; };
  CHECK(faint(pair(60, 1)) == 1);
  CHECK(faint({{60, 1, 0.5f}}) == 1);
  CHECK(faint(pair(38, 1)) == 0);                     // a near car shows more
  CHECK(faint(pair(60, 1), false) == 0);              // without a map anything may be there
  CHECK(faint(pair(60, 7)) == 0);                     // outside of the bounds
  CHECK(faint(pair(260, 1)) == 0);                    // out of range
  CHECK(faint({{60, 1, 0.5f}, {60, 1, 2.4f}}) == 0);  // higher than a car
  CHECK(faint(pair(60, 1), true, 40) == 0);           // the ego vehicle is not on the map

  RulesBench full;
  full.context.candidate_capacity = 4;
  full.add(corners(60, 61, -0.5f, 0.5f, 0.2f, 0.9f));
  for (int32_t i = 0; i < 6; ++i) full.add(pair(70.0f + 8.0f * float(i), 0));
  full.run();
  CHECK(full.frame.detections.count == 1);
  CHECK(full.frame.faint_count == 3);
}

TEST_CASE("car gates: length, width and height along psi_REF") {
  CHECK(keep(corners(20, 25.4f, -0.5f, 0.5f, 0.1f, 1), &Frame::gated_size) == 1);
  CHECK(keep(corners(20, 25.5f, -0.5f, 0.5f, 0.1f, 1), &Frame::gated_size) == 0);
  CHECK(keep(corners(20, 24.9f, -1.1f, 1.2f, 0.1f, 1), &Frame::gated_size) == 1);
  CHECK(keep(corners(20, 24.9f, -1.3f, 1.3f, 0.1f, 1), &Frame::gated_size) == 0);
  CHECK(keep(corners(20, 22, -0.5f, 0.5f, 0, 1.59f), &Frame::gated_size) == 1);
  CHECK(keep(corners(20, 22, -0.5f, 0.5f, 0, 1.61f), &Frame::gated_size) == 0);
  // Wide and short: a car across the circuit. It needs the points of a heading.
  CHECK(keep(corners(20, 22, -2.4f, 2.4f, 0, 1), &Frame::gated_size) == 1);
  CHECK(keep(corners(20, 20.2f, -2.4f, 2.4f, 0, 1), &Frame::gated_size) == 1);  // a flank
  CHECK(keep({{20, -2, 0.5f}, {21, 0, 0.5f}, {20, 2, 0.5f}, {22, 1, 0.5f}}, &Frame::gated_size) == 0);
}

// The flank of a car, or of what is longer: points every 0.1 m from x0 on.
Spots flank(float x0, int32_t columns, float y = 1.0f) {
  Spots spots;
  for (int32_t i = 0; i < columns; ++i)
    for (const float z : {0.2f, 0.5f, 0.9f}) spots.push_back({x0 + 0.1f * float(i), y, z});
  return spots;
}

TEST_CASE("car gates: a few returns of rain before a car, in one cluster with it, make it no longer or wider") {
  const Spots car = flank(20, 49);
  CHECK(keep(car) == 1);
  const auto with = [&](Spots spots, const Spots& strays) {
    spots.insert(spots.end(), strays.begin(), strays.end());
    return spots;
  };
  CHECK(keep(with(car, {{18, 0.9f, 0.5f}})) == 1);
  CHECK(keep(with(car, {{18, 0.9f, 0.5f}, {17, 0.8f, 0.5f}, {15, 0.5f, 0.4f}})) == 1);
  CHECK(keep(with(car, {{22, -1.9f, 0.5f}})) == 1);
  CHECK(keep(with(car, {{18, -1.9f, 0.5f}})) == 1);
  CHECK(keep(with(car, flank(17, 3)), &Frame::gated_size) == 0);  // 9 of 156 points: a part of something longer
  CHECK(keep(flank(20, 60), &Frame::gated_size) == 0);            // a wall
  CHECK(keep(with(flank(20, 60), {{18, 0.9f, 0.5f}}), &Frame::gated_size) == 0);

  RulesBench bench;
  bench.add(with(car, {{18, 0.9f, 0.5f}, {22, -1.9f, 0.5f}}));
  bench.run();
  REQUIRE(bench.frame.detections.count == 1);
  CHECK(bench.frame.detections.length_m[0] == doctest::Approx(4.8).epsilon(0.01));
  CHECK(bench.frame.detections.width_m[0] < 0.1f);
}

TEST_CASE("car gates: a beam over the circuit is no car, and neither is the top of something higher than a car") {
  const auto kept = [](double low_m, double high_m, double x_m = 65) {
    RulesBench bench;
    bench.look({{x_m, 0, 0, 0.4, 4.8, low_m, high_m}});
    gate(bench);
    CAPTURE(x_m);
    CHECK(bench.frame.gated_size == 1 - bench.frame.kept_count);
    return bench.frame.kept_count;
  };
  CHECK(kept(0.1, 1.1) == 1);  // the flank of a car
  CHECK(kept(0.8, 1.3) == 1);  // its lower part is hidden
  CHECK(kept(1.1, 1.9) == 0);
  CHECK(kept(4.5, 5.1, 90) == 0);
  CHECK(kept(0.7, 2.2) == 0);
  // Behind the end of the road's returns its height is less certain: up to 1 m * (90 / 70)^2.
  CHECK(kept(1.3, 1.9, 90) == 1);
  CHECK(kept(1.75, 1.95, 90) == 0);
}

TEST_CASE("car gates: a running ground that errs below a few columns of a car makes it no higher") {
  // The heights of so many columns, from the left end of the car on, are 1.5 m too large.
  const auto kept = [](int32_t columns) {
    RulesBench bench;
    bench.look({{20, 0, 0, 4, 1.8, 0.1, 1.1}});
    const ClusterTable& table = bench.frame.sensors[0].clusters;
    SegmentViews& views = bench.frame.sensors[0].kept;
    const int32_t stride = views.images.pixel_point.stride;
    int32_t first = stride;
    const auto for_each_pixel = [&](auto&& f) {
      for (int32_t k = 0; k < table.point_count[0]; ++k)
        f(views.points.pixel[bench.frame.sensors[0].cluster_points.point[k]]);
    };
    for_each_pixel([&](int32_t pixel) { first = std::min(first, pixel % stride); });
    for_each_pixel([&](int32_t pixel) {
      if (pixel % stride < first + columns) views.images.height_m.data[pixel] += 1.5f;
    });
    gate(bench);
    return bench.frame.kept_count;
  };
  CHECK(kept(0) == 1);
  CHECK(kept(2) == 1);
  CHECK(kept(15) == 0);
}

TEST_CASE("car gates: without a map, pieces of a wall and what is behind it are no cars; a car at the wall is one") {
  const Solid wall_1 = {22, 8, 0, 36, 0.2, 0, 0.7, 1}, wall_2 = {62, 8, 0, 36, 0.2, 0, 0.7, 2};
  const auto kept = [&](const Solid& solid, const std::vector<Solid>& others) {
    std::vector<Solid> solids = others;
    solids.push_back(solid);
    solids.back().cluster = 3;
    RulesBench bench(false);
    bench.look(solids);
    gate(bench);
    CHECK(bench.frame.gated_map == 1 - bench.frame.kept_count);
    return bench.frame.kept_count;
  };
  const std::vector<Solid> walls = {wall_1, wall_2};
  const Solid piece = {42, 8, 0, 1.6, 0.2, 0, 0.7, 3};
  CHECK(kept(piece, walls) == 0);
  CHECK(kept(piece, {}) == 1);
  for (const double x_m : {12.0, 20.0, 35.0, 75.0}) {
    CAPTURE(x_m);
    CHECK(kept({x_m, 6.8, 0, 4.9, 1.886, 0.1, 1.1}, walls) == 1);  // touches the wall
    CHECK(kept({x_m, 12, 0, 0.4, 2.0, 0.5, 1.5}, walls) == 0);     // stands out over it
    CHECK(kept({x_m, 12, 0, 0.4, 2.0, 0.5, 1.5}, {}) == 1);
  }
  // Abeam, a panel of a fence on a wall is 0.8 m behind its face as the sensor sees it: less than what the wall hides.
  const auto panel = [](double y_m) { return Solid{6, y_m, 0, 1.2, 0.1, 0.8, 1.2}; };
  CHECK(kept(panel(8.6), walls) == 0);
  CHECK(kept(panel(8.6), {}) == 1);
  CHECK(kept(panel(6.8), walls) == 1);  // before the wall
  const std::vector<Solid> right = {{22, -8, 0, 36, 0.2, 0, 0.7, 1}, {62, -8, 0, 36, 0.2, 0, 0.7, 2}};
  CHECK(kept(panel(-8.6), right) == 0);
  CHECK(kept(panel(-6.8), right) == 1);
  // A beam over the road hides nothing.
  CHECK(kept({60, 0, 0, 4.9, 1.886, 0.1, 1.1}, {{30, 0, 0, 0.5, 20, 1.2, 1.6, 1}}) == 1);
  // Deep along the line of sight and narrow across it.
  CHECK(kept({60, 2, 0, 4, 0.1, 0, 0.7}, {}) == 0);
  CHECK(kept({60, 2, 0, 4, 1.8, 0, 0.7}, {}) == 1);
  RulesBench bench;  // with a map its bounds decide
  bench.look({{60, 2, 0, 4, 0.1, 0, 0.7, 3}});
  gate(bench);
  CHECK(bench.frame.kept_count == 1);
}

TEST_CASE("car gates: without a map, a near car whose sides the own shadow cuts off is no piece of a wall") {
  // Two parts of the own car, 2 m away, with a gap between them.
  const auto kept = [](double x_m, bool left, bool right, bool with_smoke = false) {
    const double slope = 0.1, half = 0.012;  // of the gap, y over x
    std::vector<Solid> solids = {{x_m, slope * x_m, 0, 4, 0.1, 0, 0.7}};
    if (left) solids.push_back({2, 2 * (slope + half) + 0.5, 0, 0.01, 1.0, 0, 3, -2});
    if (right) solids.push_back({2, 2 * (slope - half) - 0.5, 0, 0.01, 1.0, 0, 3, -2});
    if (with_smoke) solids.push_back({10, -8, 0, 1, 2, 0, 2, -1});
    RulesBench bench(false);
    bench.look(solids);
    gate(bench);
    CHECK(bench.frame.merged.count == 1);
    return bench.frame.kept_count;
  };
  CHECK(kept(20, true, true) == 1);
  CHECK(kept(20, false, false) == 0);
  CHECK(kept(20, true, false) == 0);  // the ground on the other side shows where it ends
  CHECK(kept(20, true, true, true) == 0);
  CHECK(kept(36, true, true) == 0);
}

TEST_CASE("car gates: a car at any angle to the circuit passes, at any place") {
  for (const double x : {12.0, 25.0, 40.0})
    for (int32_t yaw = 0; yaw < 360; yaw += 15) {
      CAPTURE(x);
      CAPTURE(yaw);
      RulesBench bench;
      bench.look({{x, 2.0, double(yaw), 4.921, 1.886, 0.1, 1.1}});
      gate(bench);
      CHECK(bench.frame.kept_count == 1);
    }
}

TEST_CASE("car gates: a car at the wall passes, also on a map that is wrong by 0.3 m; the wall itself does not") {
  for (const double wrong_m : {-0.3, 0.0, 0.3})
    for (const double side : {-1.0, 1.0})
      for (const double x : {15.0, 30.0, 50.0}) {
        CAPTURE(wrong_m);
        CAPTURE(side);
        CAPTURE(x);
        RulesBench bench;
        bench.clear(wrong_m);
        const double wall_y = 6.0 * side;  // true bounds: 6 m to both sides of the ego vehicle
        bench.look({{x, wall_y - 0.943 * side, 0, 4.921, 1.886, 0.1, 1.1, 1}});
        gate(bench);
        CHECK(bench.frame.kept_count == 1);
        bench.clear(wrong_m);
        bench.look({{x, wall_y + 0.1 * side, 0, 4.0, 0.2, 0.0, 1.0, 1}});
        gate(bench);
        CHECK(bench.frame.gated_map == 1);
      }
}

TEST_CASE("car gates: where the ego heading is wrong by a degree, the walls put a far car back on the circuit") {
  for (const double side : {-1.0, 1.0})
    for (const bool sees_walls : {false, true}) {
      CAPTURE(side);
      CAPTURE(sees_walls);
      RulesBench bench;
      bench.frame.ego.poses[0].yaw_rad = side * kPi / 180;
      std::vector<Solid> solids = {{80, 4.4 * side, 0, 4.921, 1.886, 0.1, 1.1, 1}};
      if (sees_walls) solids.insert(solids.end(), {{60, 7.1, 0, 140, 0.2, 0, 1, 2}, {60, -7.1, 0, 140, 0.2, 0, 1, 3}});
      bench.look(solids);
      gate(bench);
      CHECK(bench.frame.walls[0].valid == sees_walls);
      CHECK(bench.frame.kept_count == int32_t(sees_walls));
    }
}

TEST_CASE(
    "car gates: what the walls show of a sensor's heading turns what this sensor sees, an error of its mounting too") {
  const auto keeps = [](int32_t sensor, double own_deg, double other_deg, bool sees_walls) {
    RulesBench bench;
    bench.add(corners(80, 84, 4.0f, 5.8f, 0.1f, 1), sensor);
    bench.run("keep_car_shaped");
    bench.frame.walls[sensor] = {sees_walls, own_deg * kPi / 180, 1e-6, 20};
    bench.frame.walls[1 - sensor] = {true, other_deg * kPi / 180, 1e-6, 60};
    keep_inside_bounds(bench.context, bench.frame);
    return bench.frame.kept_count == 1;
  };
  for (const int32_t sensor : {0, 1}) {
    CAPTURE(sensor);
    CHECK(keeps(sensor, 0, 0, true));
    CHECK(!keeps(sensor, 1, -1, true));  // it is a piece of the wall on the left
    CHECK(keeps(sensor, -1, 1, true));
    CHECK(keeps(sensor, 0, 1, true));
    CHECK(!keeps(sensor, -1, 1, false));  // it does not see them: the other one does
    CHECK(keeps(sensor, 1, -1, false));
  }
}

TEST_CASE(
    "car gates: where the walls stand inside of a bound, it moves to them, on their side and where they are seen") {
  const auto keeps = [](float y_m, double right_m, double left_m, double reach_m = 100.0) {
    RulesBench bench;  // bounds 6 m to both sides
    bench.add(corners(20, 24, y_m - 0.9f, y_m + 0.9f, 0.1f, 1));
    bench.run("keep_car_shaped");
    bench.context.detect.walls.reach_m = reach_m;
    bench.frame.walls[0] = {true, 0.0, 1e-6, 40, {right_m, left_m}, {20, 20}};
    bench.frame.walls[1] = {true, 0.0, 1e-6, 60, {-1.5, -1.5}, {15, 15}};  // sees less of both sides
    keep_inside_bounds(bench.context, bench.frame);
    return bench.frame.kept_count == 1;
  };
  CHECK(keeps(4.9f, 0.0, 0.0));
  CHECK(!keeps(4.9f, 0.0, -1.5));
  CHECK(!keeps(-4.9f, -1.5, 0.0));
  CHECK(keeps(4.9f, -1.5, 0.0));
  CHECK(keeps(-4.9f, 0.0, -1.5));
  CHECK(keeps(4.9f, 0.0, -0.45));  // an error of the ego pose
  CHECK(keeps(6.5f, 0.0, 2.0) == keeps(6.5f, 0.0, 0.0));
  CHECK(!keeps(4.9f, 0.0, WallHeading::kNoSide));  // the other sensor sees this side
  CHECK(keeps(4.9f, 0.0, -1.5, 15.0));
}

TEST_CASE("car gates: without a map, and with the ego vehicle far off it, no candidate is off the circuit") {
  const Spots off = corners(20, 24, 9, 10.5f, 0.1f, 1);
  CHECK(keep(off, &Frame::gated_map) == 0);
  CHECK(keep(off, &Frame::gated_map, false) == 1);
  for (const double ego_y_m : {6.5, 7.5, 9.0}) {
    CAPTURE(ego_y_m);
    RulesBench bench;
    bench.clear(ego_y_m);
    bench.add(corners(20, 24, 0.2f, 1.6f, 0.1f, 1));  // beside the ego vehicle: farther out by a car's width at most
    gate(bench);
    CHECK(bench.frame.uses_map == (ego_y_m < 8.0));
    CHECK(bench.frame.kept_count == 1);
    bench.clear(ego_y_m);
    bench.add(corners(20, 24, 3, 5, 0.1f, 1));  // much farther out
    gate(bench);
    CHECK(bench.frame.kept_count == (ego_y_m < 8.0 ? 0 : 1));
  }
}

TEST_CASE("car gates: beyond the end of an open circuit nothing is on it") {
  for (const double ego_x_m : {370.0, 381.0, 390.0}) {
    CAPTURE(ego_x_m);
    RulesBench bench;  // the circuit ends at 400 m
    bench.frame.ego.poses[0].x_m = ego_x_m;
    bench.add(corners(20, 24, -0.8f, 0.8f, 0.1f, 1));
    gate(bench);
    CHECK(bench.frame.gated_map == (ego_x_m > 380.0 ? 1 : 0));
  }
}

TEST_CASE("car gates: beyond gate.range_m nothing is a detection, without bounds beyond gate.free_range_m") {
  const auto kept_at = [](float x, bool with_map) {
    return keep(corners(x, x + 1, -0.5f, 0.5f, 0, 1), &Frame::gated_range, with_map);
  };
  for (const float side : {-1.0f, 1.0f}) {
    CAPTURE(side);
    CHECK(kept_at(side * 245, true) == 1);
    CHECK(kept_at(side * 256, true) == 0);
    CHECK(kept_at(side * 156, false) == 1);
    CHECK(kept_at(side * 166, false) == 0);
  }
}

}  // namespace
