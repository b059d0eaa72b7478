// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// The rule pose_by_view: place and heading of a car, covariance, marks, height over the road.
#include <doctest/doctest.h>

#include <array>
#include <cmath>
#include <vector>

#include "tests/support/rules_bench.h"

namespace {

using namespace overtake;
using namespace overtake::test;

TEST_CASE("pose by view: a driver that compensates for the motion of the vehicle tells whose pose a place belongs to") {
  RulesBench bench;
  bench.look({car_at(20, 0)});
  for (int32_t i = 0; i < bench.frame.sensors[0].scan.count; ++i)
    bench.frame.sensors[0].scan.time_offset_ns[i] = 30'000'000;
  bench.frame.sensors[0].clusters.sum_offset_ns[0] =
      int64_t(bench.frame.sensors[0].clusters.point_count[0]) * 30'000'000;
  bench.run("merge_seams");
  REQUIRE(bench.frame.merged.count == 1);
  const int64_t stamp_ns = bench.frame.sensors[0].stamp_ns;
  CHECK(bench.frame.merged.stamp_ns[0] == stamp_ns + 30'000'000);
  CHECK(find_pose_time(bench.context, bench.frame, 0, stamp_ns + 30'000'000) == stamp_ns + 30'000'000);
  bench.context.sensors[0].is_compensated = true;
  for (const int64_t to_ns : {int64_t(0), int64_t(-20'000'000), int64_t(50'000'000)}) {
    bench.context.sensors[0].compensated_to_ns = to_ns;
    CHECK(find_pose_time(bench.context, bench.frame, 0, stamp_ns + 30'000'000) == stamp_ns + to_ns);
  }
  CHECK(bench.frame.merged.stamp_ns[0] == stamp_ns + 30'000'000);
}

TEST_CASE(
    "pose by view: a car that the shadow of the own car hides in part is half a width from the side that is seen") {
  // A plate near the sensor that returns nothing: it hides the car on one side of the line of sight, and the ground
  // below from low_m on.
  const auto find_y = [](double x_m, double side, double low_m, double ego_yaw_rad) {
    RulesBench bench;
    const double half_m = 0.15, y_m = side * (half_m + 0.01);
    bench.look({car_at(x_m, 0), {2.0, y_m, 0, 0.1, 2 * half_m, low_m, 1.2, -2}});
    bench.frame.ego.poses[0].yaw_rad = ego_yaw_rad;
    bench.run();
    REQUIRE(bench.frame.detections.count == 1);
    CHECK(bench.frame.views.view[0] == (ego_yaw_rad == 0.0 ? OVT_VIEW_REAR : OVT_VIEW_FRONT));
    return double(bench.frame.detections.y_m[0]);
  };
  for (const double ego_yaw_rad : {0.0, kPi})
    for (const double side : {-1.0, 1.0}) {
      CAPTURE(ego_yaw_rad);
      CAPTURE(side);
      CHECK(std::fabs(find_y(25, side, 0.5, ego_yaw_rad)) < 0.15);
      CHECK(-side * find_y(25, side, 0.91, ego_yaw_rad) >
            0.3);  // ground on both sides: nothing says that a part is hidden
    }
  CHECK(find_y(45, -1, 0.5, 0.0) > 0.25);  // too far: the middle of what is seen
}

TEST_CASE("pose by view: a near car whose sides the own shadow cuts off is marked") {
  const auto is_marked = [](double x_m, bool with_gap) {
    std::vector<Solid> solids = {car_at(x_m, 0)};
    for (const double side : {-1.0, 1.0})
      if (with_gap) solids.push_back({2.0, side * 0.53, 0, 0.01, 1.0, 0, 3, -2});
    const Looked bench(solids);
    REQUIRE(bench.frame.detections.count == 1);
    return bench.frame.views.in_shadow[0] != 0;
  };
  CHECK(is_marked(18, true));
  CHECK_FALSE(is_marked(18, false));
  CHECK_FALSE(is_marked(34, true));
  CHECK_FALSE(is_marked(7, false));  // down to the lowest row: what is below is not known
}

TEST_CASE("pose by view: a strip of a car behind, which some rows hit, is marked, but not fewer rows, and not smoke") {
  const auto is_marked = [](double x_m, double y_m, double high_m, bool with_map = true, bool with_smoke = false,
                            double length_m = 0.3, double row_pitch_rad = 0.0035) {
    RulesBench bench(with_map);
    bench.clear(y_m < -5.0 ? 5.0 : 0.0);
    bench.turn_to_rear();
    std::vector<Solid> solids = {{x_m, y_m, 0, length_m, 0.4, 0.3, high_m}};
    if (with_smoke) solids.push_back({-20, 5, 0, 1, 1, 0, 1, -1, 0.1f});
    bench.look(solids, row_pitch_rad);
    bench.run();
    REQUIRE(bench.frame.detections.count == 1);
    return bench.frame.views.in_shadow[0] != 0;
  };
  CHECK(is_marked(-45, 1, 1.0));
  CHECK(is_marked(-45, -5, 1.0));
  CHECK_FALSE(is_marked(-45, 1, 0.48));  // one row: a misjudged road looks like this
  CHECK_FALSE(is_marked(-35, -8, 1.0));  // beside the shadow
  CHECK_FALSE(is_marked(-45, 1, 1.0, false));
  CHECK_FALSE(is_marked(-45, 1, 1.0, true, true));
  // Near, where the own car has just driven.
  CHECK(is_marked(-28, 1, 1.0));
  CHECK(is_marked(-18, 1, 0.6, false));
  CHECK_FALSE(is_marked(-18, 1, 0.6, false, true));
  CHECK_FALSE(is_marked(-25, 1, 0.72, false, false, 0.3, 0.009));  // two rows
  CHECK_FALSE(is_marked(-28, 2, 1.0));                             // beside its way
  CHECK_FALSE(is_marked(-18, 1, 0.6, true, false, 4.0));           // flat
}

TEST_CASE("pose by view: a box seen from behind, from beside and at any angle has its true centre and heading") {
  for (const double y_m : {-3.0, 0.0, 3.0})
    for (const double x_m : {12.0, 20.0, 35.0}) {
      CAPTURE(x_m);
      CAPTURE(y_m);
      const Looked bench({car_at(x_m, y_m)});
      const DetectionTable& d = bench.frame.detections;
      REQUIRE(d.count == 1);
      CHECK(std::fabs(double(d.x_m[0]) - x_m) < 0.15);
      CHECK(std::fabs(double(d.y_m[0]) - y_m) < 0.15);
      CHECK(d.heading_rad[0] == doctest::Approx(0));
      CHECK(bench.frame.views.view[0] == OVT_VIEW_REAR);
      CHECK(d.heading_source[0] == 0);
    }
}

TEST_CASE("pose by view: a car that stands across the circuit takes the heading of its points, and its near flank") {
  for (const double x_m : {15.0, 25.0, 35.0})
    for (const double yaw_deg : {70.0, 90.0, 110.0}) {
      CAPTURE(x_m);
      CAPTURE(yaw_deg);
      const Looked bench({car_at(x_m, 0.5, yaw_deg)});
      const DetectionTable& d = bench.frame.detections;
      REQUIRE(d.count == 1);
      CHECK(d.heading_source[0] == 1);
      const double line = std::fabs(std::remainder(double(d.heading_rad[0]) - yaw_deg * kPi / 180, kPi));
      CHECK(line < 5 * kPi / 180);
      if (yaw_deg == 90.0) CHECK(bench.frame.views.view[0] == OVT_VIEW_SIDE);
      CHECK(std::hypot(double(d.x_m[0]) - x_m, double(d.y_m[0]) - 0.5) < 0.5);
    }
}

TEST_CASE("pose by view: psi_VAR needs three points more than psi_REF, and five in a hundred") {
  // A line at 30 deg: psi_VAR holds all of its points. `more` of them lie beyond the rectangle at psi_REF.
  const auto source = [](int32_t near, int32_t more) {
    RulesBench bench;
    Spots spots;
    for (int32_t i = 0; i < near; ++i) spots.push_back({20.0f + 0.004f * float(i), 0.0023f * float(i), 0.5f});
    for (int32_t i = 0; i < more; ++i) spots.push_back({23.9f, 2.25f, 0.5f});
    bench.add(spots);
    bench.run();
    REQUIRE(bench.frame.detections.count == 1);
    const DetectionTable& d = bench.frame.detections;
    CHECK(d.inliers_var[0] - d.inliers_ref[0] == more);
    return d.heading_source[0];
  };
  CHECK(source(10, 2) == 0);
  CHECK(source(10, 3) == 1);
  CHECK(source(100, 4) == 0);
  CHECK(source(100, 6) == 1);
}

TEST_CASE("pose by view: the covariance is valid, grows smoothly with range, and holds the error of the ego heading") {
  double before_along = 0, before_across = 0;
  for (float x = 10; x < 120; x += 0.5f) {
    CAPTURE(x);
    RulesBench bench(false);
    bench.add(corners(x, x + 1, -0.8f, 0.8f, 0.2f, 0.9f));
    bench.run();
    REQUIRE(bench.frame.detections.count == 1);
    const DetectionViewTable& v = bench.frame.views;
    const double along = double(v.var_x[0]), across = double(v.var_y[0]);
    CHECK(along > 0);
    CHECK(along * across > double(v.cov_xy[0]) * double(v.cov_xy[0]));
    if (before_along > 0) {
      CHECK(along >= before_along);
      CHECK(across >= before_across);
      CHECK(along < 1.1 * before_along);
      CHECK(across < 1.15 * before_across);
    }
    before_along = along, before_across = across;
  }

  const auto covariance = [](float x, float y, double sigma_deg) {
    ovt_params params;
    REQUIRE(ovt_params_init(&params, sizeof params, "best") == OVT_OK);
    params.pose_angle_sigma_rad = sigma_deg * kPi / 180;
    RulesBench bench(false, &params);
    bench.add(corners(x, x + 1, y, y + 1, 0.2f, 0.9f));
    bench.run();
    REQUIRE(bench.frame.detections.count == 1);
    const Frame& f = bench.frame;
    return std::array<double, 5>{double(f.views.var_x[0]), double(f.views.var_y[0]), double(f.views.cov_xy[0]),
                                 double(f.detections.x_m[0]), double(f.detections.y_m[0])};
  };
  const auto without = covariance(40, 30, 0), with = covariance(40, 30, 1);
  const double turn = std::pow(kPi / 180, 2), x = with[3], y = with[4];
  CHECK(with[0] - without[0] == doctest::Approx(turn * y * y).epsilon(1e-3));
  CHECK(with[1] - without[1] == doctest::Approx(turn * x * x).epsilon(1e-3));
  CHECK(with[2] - without[2] == doctest::Approx(-turn * x * y).epsilon(1e-3));
}

// A race car of boxes, that drives along x, with or without its rear wing.
std::vector<Solid> race_car(double x_m, double y_m, bool with_wing) {
  std::vector<Solid> parts = {{x_m + 1.3, y_m, 0, 0.66, 1.85, 0.05, 0.66},
                              {x_m + 0.3, y_m, 0, 1.2, 0.5, 0.3, 0.7},
                              {x_m - 0.5, y_m, 0, 0.5, 0.4, 0.6, 1.0},
                              {x_m - 1.5, y_m, 0, 0.66, 1.85, 0.05, 0.6}};
  if (with_wing) parts.push_back({x_m - 2.3, y_m, 0, 0.3, 1.2, 0.55, 0.75});
  return parts;
}

TEST_CASE("pose by view: far away, the heights of its parts place a race car") {
  ovt_params params;
  REQUIRE(ovt_params_init(&params, sizeof params, "best") == OVT_OK);
  const auto error_of = [&](const std::vector<Solid>& solids, double x_m) {
    RulesBench bench(false, &params);
    bench.look(solids, 0.0018);
    bench.run();
    REQUIRE(bench.frame.detections.count == 1);
    return std::fabs(double(bench.frame.detections.x_m[0]) - x_m);
  };
  for (const double x_m : {53.0, 60.0, 70.0}) {
    CAPTURE(x_m);
    params.pose_profile_points = 3;
    CHECK(error_of(race_car(x_m, 1, true), x_m) < 0.3);
    const double without_wing = error_of(race_car(x_m, 1, false), x_m);
    CHECK(without_wing < 0.35);
    params.pose_profile_points = 0;
    CHECK(without_wing < error_of(race_car(x_m, 1, false), x_m) - 0.1);
  }
  // A higher car, and a vehicle of another length, keep the centre by the end that is seen.
  const auto keeps_end = [&](double length_m, double high_m) {
    params.vehicle_length_m = length_m;
    params.pose_profile_points = 3;
    const std::vector<Solid> box = {{60, 1, 0, length_m, 1.8, 0.15, high_m}};
    const double with = error_of(box, 60);
    params.pose_profile_points = 0;
    return with == error_of(box, 60);
  };
  CHECK(keeps_end(4.921, 1.45));
  CHECK(keeps_end(4.2, 0.7));
  CHECK(!keeps_end(4.921, 0.7));
}

TEST_CASE("pose by view: the less of a car is seen, and the fewer points, the larger its covariance") {
  const auto var_x = [](float x0, float x1, int32_t more) {
    RulesBench bench(false);
    bench.add(corners(x0, x1, -0.8f, 0.8f, 0.2f, 0.9f, more));
    bench.run();
    REQUIRE(bench.frame.detections.count == 1);
    return double(bench.frame.views.var_x[0]);
  };
  CHECK(var_x(-32, -30, 0) > 1.3 * var_x(-33, -30, 0));
  CHECK(var_x(-31, -30, 0) == doctest::Approx(var_x(-32, -30, 0)).epsilon(0.02));  // the middle of the car, mostly
  CHECK(var_x(-33, -30, 0) > 2 * var_x(-35, -30, 0));
  CHECK(var_x(-31, -30, 0) > 2 * var_x(30, 31, 0));  // from ahead, the nose may be missing
  CHECK(var_x(30, 31, 0) > var_x(30, 31, 100));
}

TEST_CASE("pose by view: a box that is wider than a car leaves open where across it the car is") {
  const auto var_y = [](float width_m) {
    RulesBench bench(false);
    bench.add(corners(20, 24.8f, -0.5f * width_m, 0.5f * width_m, 0.2f, 0.9f, 50));
    bench.run();
    REQUIRE(bench.frame.detections.count == 1);
    REQUIRE(bench.frame.detections.heading_rad[0] == doctest::Approx(0));
    return double(bench.frame.views.var_y[0]);
  };
  CHECK(var_y(1.98f) == doctest::Approx(var_y(1.9f)).epsilon(1e-3));
  CHECK(std::sqrt(var_y(2.2f) - var_y(1.98f)) == doctest::Approx(0.5 * (2.2 - 1.886 - 0.1)).epsilon(0.05));
}

TEST_CASE("pose by view: dark points, and rough ones that are almost as dark, do not move the centre in smoke") {
  // A car, and specks behind it that are one cluster with it: on columns apart, or side by side.
  const auto error_m = [](float intensity, int32_t columns_apart, bool with_smoke = true) {
    constexpr double kAt_m = 21.5;
    std::vector<Solid> solids = {car_at(25, 0)};
    const double column_m = kAt_m * 2.0 * kPi / 3.0 / double(RulesBench::kCols);
    for (int32_t k = -2; k <= 2; ++k)
      solids.push_back({kAt_m, k * columns_apart * column_m, 0, 0.02, column_m, 0.3, 0.5, 1, intensity});
    if (with_smoke) solids.push_back({25, -8, 0, 0.1, 2.0, 0.2, 1.4, -1, 0.01f});
    const Looked bench(solids);
    REQUIRE(bench.frame.detections.count == 1);
    return std::abs(bench.frame.detections.x_m[0] - 25.0);
  };
  CHECK(error_m(0.05f, 1) < 0.1);
  CHECK(error_m(0.05f, 3) < 0.1);
  CHECK(error_m(0.15f, 3) < 0.1);
  CHECK(error_m(0.15f, 1) > 0.3);  // a surface
  CHECK(error_m(0.25f, 3) > 0.3);  // too bright
  CHECK(error_m(0.05f, 1, false) > 0.3);
}

TEST_CASE("pose by view: a few points among smoke are smoke, not faint points of a car") {
  const auto faint = [](double smoke_x_m, int32_t cluster) {
    RulesBench bench;
    bench.look({{60, 0, 0, 0.1, 0.1, 0.6, 0.75, 1}, {smoke_x_m, 0, 0, 0.1, 6.0, 0.0, 2.5, cluster}});
    bench.run();
    CHECK(bench.frame.detections.count == 0);
    return bench.frame.faint_count;
  };
  CHECK(faint(66.5, -1) == 1);  // far behind them
  CHECK(faint(62.5, -1) == 0);
  CHECK(faint(62.5, 0) == 1);
}

TEST_CASE("pose by view: smoke beside a car makes its ends doubtful, not smoke far away, and not of a near car") {
  struct Told {
    bool in_smoke;
    double along_m, across_m;  // deviations
  };
  const auto look = [](double x_m, const std::vector<Solid>& smoke) {
    std::vector<Solid> solids = {car_at(x_m, 0)};
    solids.insert(solids.end(), smoke.begin(), smoke.end());
    const Looked bench(solids);
    REQUIRE(bench.frame.detections.count == 1);
    const DetectionViewTable& v = bench.frame.views;
    return Told{v.in_smoke[0] != 0, std::sqrt(double(v.var_x[0])), std::sqrt(double(v.var_y[0]))};
  };
  const auto at = [](double x_m, double y_m) { return Solid{x_m, y_m, 0, 0.1, 4.0, 0.0, 1.5, -1, 0.05f}; };
  for (const double side : {-1.0, 1.0}) {
    const Told told = look(30, {at(27, side * 5.5)});
    CHECK(told.in_smoke);
    CHECK(told.along_m == doctest::Approx(0.8).epsilon(0.05));
    CHECK(told.across_m > 0.25);
    CHECK_FALSE(look(30, {at(27, side * 12)}).in_smoke);
    CHECK_FALSE(look(30, {at(18, side * 5.5)}).in_smoke);
    CHECK_FALSE(look(13, {at(11, side * 5.5)}).in_smoke);
  }
  CHECK(look(17, {at(14, 5.5)}).in_smoke);
  const Told clear = look(30, {});
  CHECK_FALSE(clear.in_smoke);
  CHECK(clear.along_m < 0.3);
  CHECK(clear.across_m < 0.2);
  CHECK(look(30, {at(18, 5.5)}).along_m == clear.along_m);
}

TEST_CASE("pose by view: height over the road, and the road under the car") {
  RulesBench bench(false);
  bench.add(corners(20, 21, -0.8f, 0.8f, 0.3f, 1.0f));
  bench.run();
  REQUIRE(bench.frame.detections.count == 1);
  CHECK(bench.frame.views.road_z_m[0] == 0.3f);
  CHECK(bench.frame.views.height_m[0] == doctest::Approx(0.7));
}

TEST_CASE("pose by view: paper has none of these columns") {
  FrameSizes sizes;
  sizes.cluster_capacity = sizes.candidate_capacity = 16;
  Frame frame;
  REQUIRE(build_frame(frame, sizes, default_allocator()));
  CHECK(frame.views.var_x == nullptr);
  CHECK(frame.views.view == nullptr);
  CHECK(frame.places.known == nullptr);
}

}  // namespace
