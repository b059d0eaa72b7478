// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// The rule pose_by_view: centre by the side that is seen, covariance, class, height over the road.
#include <doctest/doctest.h>

#include <cmath>
#include <vector>

#include "tests/support/rules_bench.h"

namespace {

using namespace overtake;
using namespace overtake::test;

constexpr float kLength = 4.921f, kWidth = 1.886f;
constexpr CarSize kSize = {kLength, kWidth, 4.2f};

Solid car_at(double x_m, double y_m, double yaw_deg = 0) { return {x_m, y_m, yaw_deg, 4.921, 1.886, 0.1, 1.1, 1}; }

// The bench after all rules; each solid must give one detection, in the order of their clusters.
struct Looked : RulesBench {
  explicit Looked(const std::vector<Solid>& solids, double row_pitch_rad = 0.0035) {
    look(solids, row_pitch_rad);
    run();
  }
};

TEST_CASE("anchor_car: along the heading, the end that the sensor sees, or the middle") {
  const auto center = [](float low, float high, float sensor) {
    return anchor_car(kSize, {low, high, -0.5f, 0.5f}, sensor, 0).center_1;
  };
  CHECK(center(20, 25, 0) == 22.5f);                                       // both ends
  CHECK(center(20, 21, 0) == doctest::Approx(20 + 0.5f * kLength));        // rear
  CHECK(center(-21, -20, 0) == doctest::Approx(-20.5f));                   // front, the nose not seen
  CHECK(center(-24.3f, -20, 0) == doctest::Approx(-20 - 0.5f * kLength));  // front with its nose
  CHECK(center(-24.1f, -20, 0) == doctest::Approx(-22.05f));
  CHECK(anchor_car(kSize, {20, 21, 0, 1}, 0, 0).view == CarView::kRear);
  CHECK(anchor_car(kSize, {-21, -20, 0, 1}, 0, 0).view == CarView::kFront);
  CHECK(anchor_car(kSize, {-1, 2, 3, 4}, 0, 0).view == CarView::kSide);
  CHECK(anchor_car(kSize, {20, 25, 0, 1}, 0, 0).unseen_1 == 0.0f);
  CHECK(anchor_car(kSize, {20, 21, 0, 1}, 0, 0).unseen_1 == 0.0f);  // the rear end is known
  CHECK(anchor_car(kSize, {-21, -20, 0, 1}, 0, 0).unseen_1 == doctest::Approx(kLength - 1));
}

TEST_CASE("anchor_car: across the heading, the middle of what is seen; beside the car, from the near flank") {
  const auto center = [](OrientedBox seen) { return anchor_car(kSize, seen, 0, 0).center_2; };
  CHECK(center({20, 21, 2, 3}) == 2.5f);
  CHECK(center({20, 25, 2, 3}) == 2.5f);
  CHECK(center({-2, 2, 3, 3.5f}) == doctest::Approx(3 + 0.5f * kWidth));
  CHECK(center({-2, 2, -3.5f, -3}) == doctest::Approx(-3 - 0.5f * kWidth));
  CHECK(center({-2, 2, 3, 5}) == 4.0f);      // all of its width
  CHECK(center({-1, 1, 3, 3.5f}) == 3.25f);  // too little of the flank
}

TEST_CASE("anchor_car: less than a length beside its ends the near flank is seen, too") {
  const auto center = [](OrientedBox seen) { return anchor_car(kSize, seen, 0, 0).center_2; };
  CHECK(center({2.4f, 7.3f, 3, 4.4f}) == doctest::Approx(3 + 0.5f * kWidth));    // ahead of the sensor
  CHECK(center({-7.3f, -2.4f, 3, 4.4f}) == doctest::Approx(3 + 0.5f * kWidth));  // behind it
  CHECK(center({2.4f, 7.3f, -4.4f, -3}) == doctest::Approx(-3 - 0.5f * kWidth));
  CHECK(center({2.6f, 7.5f, 3, 4.4f}) == 3.7f);         // farther
  CHECK(center({2.4f, 7.3f, -0.5f, 0.75f}) == 0.125f);  // straight ahead no flank is seen
  CHECK(center({2.4f, 5.3f, 3, 4.4f}) == 3.7f);         // too little of the flank
  CHECK(center({2.4f, 7.3f, 3, 5}) == 4.0f);            // all of its width
}

TEST_CASE("anchor_car: an end that is cut off is not the car's; the other one is, if it is seen") {
  const auto center = [](OrientedBox seen, float sensor_2, CutEnds cut) {
    return anchor_car(kSize, seen, 0, sensor_2, cut);
  };
  constexpr CutEnds kLow = {.low_1 = true}, kHigh = {.high_1 = true}, kBoth = {.low_1 = true, .high_1 = true};
  // From behind and beside: the rear end is cut off, the flank shows the front one.
  CHECK(center({2, 4, 3, 4}, 0, kLow).center_1 == doctest::Approx(4 - 0.5f * kLength));
  CHECK(center({2, 4, 3, 4}, 0, kLow).unseen_1 == doctest::Approx(0.3f * (kLength - 2)));
  CHECK(center({2, 4, 3, 4}, 0, kLow).center_2 == doctest::Approx(3 + 0.5f * kWidth));
  CHECK(center({-4, -2, 3, 4}, 0, kHigh).center_1 == doctest::Approx(-4 + 0.5f * kLength));  // from ahead
  CHECK(center({4, 6, 3, 4}, 0, kHigh).center_1 == doctest::Approx(4 + 0.5f * kLength));     // the near end is seen
  CHECK(center({4, 6, 3, 4}, 0, kHigh).unseen_1 == 0.0f);
  // Straight behind no flank is seen, and of an end on both sides nothing is known.
  CHECK(center({20, 22, -0.5f, 0.5f}, 0, kLow).center_1 == 21.0f);
  CHECK(center({20, 22, -0.5f, 0.5f}, 0, kLow).knows_no_end);
  CHECK(center({-22, -20, -0.5f, 0.5f}, 0, kHigh).knows_no_end);
  CHECK(center({2, 4, 3, 4}, 0, kBoth).center_1 == 3.0f);
  CHECK(center({2, 4, 3, 4}, 0, kBoth).knows_no_end);
  CHECK_FALSE(center({2, 4, 3, 4}, 0, {}).knows_no_end);
  // A side that is cut off.
  CHECK(center({20, 21, -0.2f, 1}, 0, {.low_2 = true}).center_2 == doctest::Approx(1 - 0.5f * kWidth));
  CHECK(center({20, 21, -1, 0.2f}, 0, {.high_2 = true}).center_2 == doctest::Approx(-1 + 0.5f * kWidth));
  CHECK(center({20, 21, -1, 0.2f}, 0, {.high_2 = true}).unseen_2 == doctest::Approx(0.3f * (kWidth - 1.2f)));
  CHECK(center({20, 21, -1, -0.2f}, 0, {.high_2 = true}).center_2 == doctest::Approx(-0.6f));  // too little of it
  CHECK(center({20, 21, -1, 0.2f}, 0, {.low_2 = true, .high_2 = true}).center_2 == doctest::Approx(-0.4f));
}

TEST_CASE("pose by view: of a car at the edge of all fields of view the end that is seen counts") {
  // Sensor 0 sees 60 deg to both sides, sensor 1 what is to the left of that; to the right nothing does.
  struct Error {
    double x_m, y_m, sigma_x_m;
  };
  const auto look = [](double x_m, double y_m, bool others) {
    RulesBench bench(false);
    bench.look({car_at(x_m, y_m)});
    bench.frame.sensors[1].present = others;
    bench.run();
    REQUIRE(bench.frame.detections.count == 1);
    const DetectionTable& d = bench.frame.detections;
    return Error{double(d.x_m[0]) - x_m, double(d.y_m[0]) - y_m, std::sqrt(double(bench.frame.views.var_x[0]))};
  };
  for (const double x_m : {1.5, 2.5, 3.5, 4.5}) {
    CAPTURE(x_m);
    const Error right = look(x_m, -5, true), left = look(x_m, 5, false), covered = look(x_m, 5, true);
    for (const Error& e : {right, left}) {
      CHECK(std::fabs(e.x_m) < 0.1);
      CHECK(std::fabs(e.y_m) < 0.2);
      CHECK(e.sigma_x_m < 0.4);
    }
    CHECK(covered.x_m > 0.25);  // sensor 1 sees that nothing is there
  }
  CHECK(look(14, -26, true).x_m > 0.4);  // too far away
  const Error whole = look(9, -5, true);
  CHECK(std::fabs(whole.x_m) < 0.1);
  CHECK(whole.sigma_x_m < 0.1);
}

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

TEST_CASE("pose by view: of a car at a gap of all views the end that is seen counts") {
  // Dirt on the window of sensor 0 stops the light from from_deg to to_deg, on one side.
  const auto look = [](double side, double from_deg, double to_deg, bool others, bool all_are_dirty = false) {
    constexpr double kFar_m = 0.6;
    const double middle_deg = side * (from_deg + to_deg) / 2, half = std::tan((to_deg - from_deg) / 2 * kPi / 180);
    RulesBench bench(false);
    bench.look({car_at(7, 5 * side),
                {kFar_m * std::cos(middle_deg * kPi / 180), kFar_m * std::sin(middle_deg * kPi / 180), middle_deg,
                 0.002, 2 * kFar_m * half, 0, 2, -2}});
    if (others) {  // sensor 1 looks to the same place
      bench.context.sensors[1] = bench.context.sensors[0];
      bench.frame.sensors[1].present = true;
    } else {
      bench.frame.sensors[1].present = false;
    }
    for (const FrameRule& rule : bench.context.method->frame) {
      rule.run(bench.context, bench.frame);
      if (all_are_dirty && rule.run == &find_view_gaps) bench.frame.gaps[1] = bench.frame.gaps[0];
    }
    REQUIRE(bench.frame.gaps[0].count == 1);
    REQUIRE(bench.frame.detections.count == 1);
    return double(bench.frame.detections.x_m[0]) - 7;
  };
  for (const double side : {-1.0, 1.0}) {
    CAPTURE(side);
    CHECK(std::fabs(look(side, 32, 55, false)) < 0.15);  // its rear
    CHECK(std::fabs(look(side, 10, 27, false)) < 0.15);  // its nose
    CHECK(look(side, 32, 55, true) > 0.25);
    CHECK(std::fabs(look(side, 32, 55, true, true)) < 0.15);
    CHECK(std::fabs(look(side, 5, 15, false)) < 0.1);  // beside it
  }
}

TEST_CASE("pose by view: at the edge of all fields of view, an end that something nearer hides is not the car's") {
  struct Error {
    double x_m, sigma_x_m;
  };
  // Beside the car, nearer to the sensor, stands an object as long as the car, with its rear end at rear_m.
  const auto look = [](double x_m, double side, double rear_m) {
    RulesBench bench(false);
    bench.look({car_at(x_m, 5.8 * side), {rear_m + 2.45, 3.2 * side, 0, 4.9, 1.9, 0.05, 1.3, 2}});
    bench.frame.sensors[1].present = false;
    bench.run();
    REQUIRE(bench.frame.detections.count == 2);
    return Error{double(bench.frame.detections.x_m[0]) - x_m, std::sqrt(double(bench.frame.views.var_x[0]))};
  };
  for (const double side : {-1.0, 1.0}) {
    CAPTURE(side);
    CHECK(std::fabs(look(5.5, side, 4.4).x_m) < 0.15);  // the rear end begins inside of the view
    CHECK(std::fabs(look(5.5, side, 5.2).x_m) < 0.15);
    CHECK(look(4.5, side, 4.4).x_m < 0.1);     // it does not
    const Error flank = look(4.0, side, 2.9);  // the view begins at the flank: neither end is known
    CHECK(flank.sigma_x_m > 0.4);
    CHECK(std::fabs(flank.x_m) < 3.0 * flank.sigma_x_m);
    const Error seen = look(4.0, side, 8.0);
    CHECK(std::fabs(seen.x_m) < 0.1);
    CHECK(seen.sigma_x_m < 0.4);
  }
}

TEST_CASE("pose by view: on the other side of a sensor of more than half a turn is no edge of its view") {
  double worst_m = 0;
  for (double y_m = -9; y_m < -3; y_m += 0.05) {
    RulesBench bench(false);
    const double half =
        135 * kPi / 180;  // an edge of it looks back to the left, from the car that is ahead to the right
    bench.context.sensors[0] = make_sensor_model(RulesBench::kRows, RulesBench::kCols, half, -half, false, 0.5, 400);
    bench.context.sensors[0].T_vehicle_sensor = make_transform(0, 0, RulesBench::kSensorHeight_m, 0, 0, 0);
    bench.look({{7, y_m, 0, 4.9, 1.2, 0.1, 1.1, 1}});
    bench.frame.sensors[1].present = false;
    bench.run();
    REQUIRE(bench.frame.detections.count == 1);
    worst_m = std::max(worst_m, std::fabs(double(bench.frame.detections.y_m[0]) - y_m));
  }
  CHECK(worst_m < 0.15);
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

TEST_CASE("pose by view: a box or a tyre is debris where a car would show more, and nowhere else") {
  const auto class_of = [](const std::vector<Solid>& solids, double row_pitch_rad = 0.0035) {
    const Looked bench(solids, row_pitch_rad);
    REQUIRE(bench.frame.detections.count == 1);
    return bench.frame.views.object_class[0];
  };
  for (const double x_m : {8.0, 15.0, 25.0})
    for (const double size_m : {0.4, 0.6, 0.75}) {
      CAPTURE(x_m);
      CAPTURE(size_m);
      CHECK(class_of({{x_m, 0.5, 20, size_m, size_m, 0.0, size_m, 1}}) == OVT_CLASS_DEBRIS);
    }
  // At an angle to the circuit, 1 m is 1.4 m along it.
  for (const double yaw_deg : {0.0, 30.0, 45.0, 75.0}) {
    CAPTURE(yaw_deg);
    CHECK(class_of({{10, 0.5, yaw_deg, 0.95, 0.95, 0.0, 0.9, 1}}) == OVT_CLASS_DEBRIS);
    if (yaw_deg > 0) CHECK(class_of({{10, 0.5, yaw_deg, 1.5, 0.3, 0.0, 0.9, 1}}) == OVT_CLASS_CAR);
  }
  for (const double x_m : {8.0, 15.0, 25.0, 40.0, 60.0}) {
    CAPTURE(x_m);
    CHECK(class_of({car_at(x_m, 0.5)}) == OVT_CLASS_CAR);
    CHECK(class_of({car_at(x_m, 0.5, 90)}) == OVT_CLASS_CAR);
  }
  // Hidden by a nearer object but for 0.7 m.
  CHECK(class_of({car_at(25, 0), {12, -0.6, 0, 0.2, 1.6, 0.0, 1.5, 0}}) == OVT_CLASS_UNKNOWN);
  // It does not touch the road: the top of a car behind a crest.
  CHECK(class_of({{25, 0.5, 20, 0.6, 0.4, 0.75, 1.0, 1}}) == OVT_CLASS_UNKNOWN);
  // Farther away than the columns tell, with fine rows; and with too few rows.
  CHECK(class_of({{80, 0, 0, 0.75, 0.75, 0.0, 0.75, 1}}, 0.001) == OVT_CLASS_UNKNOWN);
  CHECK(class_of({{15, 0, 0, 0.75, 0.75, 0.0, 0.75, 1}}, 0.02) == OVT_CLASS_UNKNOWN);
  CHECK(class_of({{15, 0, 0, 0.75, 0.75, 0.0, 0.75, 1}}, 0.01) == OVT_CLASS_DEBRIS);
}

TEST_CASE("pose by view: what is left between pixels of smoke has no class") {
  const auto class_of = [](const Solid& beside, double x_m = 25.0) {
    const Looked bench({car_at(x_m, 0), beside});
    REQUIRE(bench.frame.detections.count == 1);
    return bench.frame.views.object_class[0];
  };
  // Smoke over the middle of a car, half as wide as the car; a fifth; and as much of a solid object.
  CHECK(class_of({22, 0, 0, 0.1, 0.9, 0.0, 1.5, -1}) == OVT_CLASS_UNKNOWN);
  CHECK(class_of({22, 0, 0, 0.1, 0.3, 0.0, 1.5, -1}) == OVT_CLASS_CAR);
  CHECK(class_of({22, 0, 0, 0.1, 0.9, 0.0, 1.5, 0}) == OVT_CLASS_CAR);
  // Smoke in front of the car, but not near it.
  CHECK(class_of({14, 0, 0, 0.1, 0.6, 0.0, 1.3, -1}) == OVT_CLASS_CAR);
  // All around a distant car; and farther behind it.
  CHECK(class_of({62.9, 0, 0, 0.1, 6.0, 0.0, 2.5, -1}, 60) == OVT_CLASS_UNKNOWN);
  CHECK(class_of({65.9, 0, 0, 0.1, 6.0, 0.0, 2.5, -1}, 60) == OVT_CLASS_CAR);
}

TEST_CASE("pose by view: rows that the ground beside them continues are road, whatever their size") {
  const auto class_of = [](const std::vector<Solid>& solids) {
    const Looked bench(solids);
    REQUIRE(bench.frame.detections.count == 1);
    return bench.frame.views.object_class[0];
  };
  // As large as a car, and no higher than the road; also where something nearer hides one side, but not both.
  const Solid road = {22, 0, 0, 2.0, 1.6, -0.5, 0.002, 1}, step = {22, 0, 0, 2.0, 1.6, -0.5, 0.2, 1};
  CHECK(class_of({road}) == OVT_CLASS_UNKNOWN);
  CHECK(class_of({road, {12, 0.83, 0, 0.1, 1.0, 0.0, 1.5, 0}}) == OVT_CLASS_UNKNOWN);
  CHECK(class_of({road, {12, -0.83, 0, 0.1, 1.0, 0.0, 1.5, 0}}) == OVT_CLASS_UNKNOWN);
  CHECK(class_of({road, {12, 0.88, 0, 0.1, 1.0, 0.0, 1.5, 0}, {12, -0.88, 0, 0.1, 1.0, 0.0, 1.5, 0}}) == OVT_CLASS_CAR);
  // A step over the road; and a car whose lowest row lies on it.
  CHECK(class_of({step}) == OVT_CLASS_CAR);
  CHECK(class_of({road, {23.5, 0, 0, 1.0, 1.6, 0.0, 0.35, 1}}) == OVT_CLASS_CAR);
  // A wall beside a wall is no road.
  CHECK(class_of({road, {22, 1.8, 0, 2.0, 2.0, -0.5, 0.002, 0}, {22, -1.8, 0, 2.0, 2.0, -0.5, 0.002, 0}}) ==
        OVT_CLASS_CAR);
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

TEST_CASE("pose by view: nothing in an incomplete scan is debris") {
  for (const uint32_t mask : {0u, 1u, 2u}) {
    RulesBench bench;
    bench.look({{15, 0.5, 20, 0.6, 0.6, 0.0, 0.6, 1}});
    bench.frame.incomplete_mask = mask;
    bench.run();
    REQUIRE(bench.frame.detections.count == 1);
    CHECK(bench.frame.views.object_class[0] == (mask == 1 ? OVT_CLASS_UNKNOWN : OVT_CLASS_DEBRIS));
  }
}

TEST_CASE("pose by view: what two sensors see is no debris if the scan of either is incomplete") {
  for (const uint32_t mask : {0u, 1u, 2u, 4u}) {
    RulesBench bench;
    bench.look({{15, 0.5, 20, 0.6, 0.6, 0.0, 0.6, 1}});
    bench.add({{14.8f, 0.5f, 0.3f}, {14.8f, 0.6f, 0.3f}, {14.8f, 0.5f, 0.4f}}, 1);
    bench.frame.incomplete_mask = mask;
    bench.run();
    REQUIRE(bench.frame.detections.count == 1);
    CHECK(bench.frame.merged.sensor_mask[0] == 3);
    CHECK(bench.frame.views.object_class[0] == (mask & 3u ? OVT_CLASS_UNKNOWN : OVT_CLASS_DEBRIS));
  }
}

TEST_CASE("pose by view: a distant car with three points in a row is never debris") {
  for (const double x_m : {60.0, 80.0, 95.0, 110.0})
    for (const double width_m : {0.5, 0.8, 1.886}) {
      CAPTURE(x_m);
      CAPTURE(width_m);
      RulesBench bench;
      bench.look({{x_m, 0, 0, 1.5, width_m, 0.9, 1.1, 1}});  // the cockpit alone
      bench.run();
      for (int32_t i = 0; i < bench.frame.detections.count; ++i)
        CHECK(bench.frame.views.object_class[i] != OVT_CLASS_DEBRIS);
    }
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
