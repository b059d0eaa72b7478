// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// The figures of tracks on logs made by hand: every expected number is counted in the rows.
#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "tests/support/temp_folder.h"
#include "tools/evaluation/detection_columns.h"
#include "tools/evaluation/figures.h"
#include "tools/evaluation/figures_parts.h"
#include "tools/evaluation/metrics/calibration.h"
#include "tools/evaluation/path_judge.h"
#include "tools/evaluation/places.h"
#include "tools/evaluation/report_html.h"
#include "tools/evaluation/track_quality.h"
#include "tools/io/angles.h"
#include "tools/sim/material.h"

using namespace overtake;
using namespace overtake::evaluation;
using doctest::Approx;

namespace {

constexpr int64_t kSecond = 1'000'000'000;

Run empty_run() { return {"best", "log", {{"scenario", "hand"}, {"period_s", "0.05"}}, make_tables()}; }

TrackQuality quality_of_tracks(const Run& run) {
  const std::vector<TrackQuality> all = find_track_quality({run});
  REQUIRE(all.size() == 1);
  return all[0];
}

void add_car_row(Run& run, double frame, double car, double ahead_m, double points, double confirmed) {
  run.tables["cars"].add({frame, 0.05 * frame, car, ahead_m, 0, ahead_m, 0, points, 1, 1, 1, 0, confirmed});
}
void add_track_row(Run& run, double frame, double id, double car, double ahead_m, double along, double across,
                   double speed = 0, double heading = 0, double course = 0, double nees = 5) {
  run.tables["tracks"].add({frame, 0.05 * frame, id, 1, car, ahead_m, ahead_m, 0, 0, 0, along, across, speed, heading,
                            course, 0, nees, 0.05});
}

// The path of one track: `points` of a step, with one covariance.
struct PathColumns {
  std::vector<double> x_m, y_m, var_x, var_y, cov_xy;
  ovt_tracks tracks{};
  PathColumns(double step_s, const std::vector<double>& x, const std::vector<double>& y, double xx, double xy,
              double yy)
      : x_m(x), y_m(y), var_x(x.size(), xx), var_y(x.size(), yy), cov_xy(x.size(), xy) {
    tracks.count = 1, tracks.path_points = int32_t(x.size()), tracks.path_step_s = step_s;
    tracks.path_x_m = x_m.data(), tracks.path_y_m = y_m.data();
    tracks.path_var_x = var_x.data(), tracks.path_var_y = var_y.data(), tracks.path_cov_xy = cov_xy.data();
  }
};

double cell(const Table& table, std::size_t row, const char* column) { return table.at(row, table.column(column)); }

// Rows of a car every 0.5 s, all with 20 points and a confirmed track of id 7.
std::vector<CarRow> drive(const std::vector<double>& ahead_m) {
  std::vector<CarRow> rows;
  for (const double ahead : ahead_m) rows.push_back({0.5 * double(rows.size()), ahead, 2, 20, true, 7, 0.9});
  return rows;
}

}  // namespace

TEST_CASE("calibration: bins of a tenth, expected error and Brier score of cases counted by hand") {
  metrics::Calibration c;
  CHECK(std::isnan(c.brier()));
  CHECK(std::isnan(c.expected_error()));
  CHECK(std::isnan(c.bins()[0].share()));
  for (const bool hit : {true, true, false, true}) c.add(0.95, hit);
  c.add(0.05, false), c.add(0.05, true);
  c.add(1.0, true), c.add(0.0, false);
  c.add(NAN, true);
  CHECK(c.count() == 8);
  CHECK(c.bins()[9].count == 5);  // with 1.0
  CHECK(c.bins()[9].share() == Approx(0.8));
  CHECK(c.bins()[0].count == 3);
  CHECK(c.bins()[0].share() == Approx(1.0 / 3));
  // | hits - sum of probabilities |: | 4 - 4.8 | and | 1 - 0.1 |
  CHECK(c.expected_error() == Approx((0.8 + 0.9) / 8));
  CHECK(c.brier() == Approx((3 * 0.0025 + 0.9025 + 0.0025 + 0.9025 + 0 + 0) / 8));
}

TEST_CASE("paths: the error is in the axes of the true course at the horizon, and later points wait for the truth") {
  // A car at (100, 0) turns from x to y: at a horizon h it is at (100, 10 h) with course 90 deg.
  PathJudge judge;
  const CarTruth now{3, false, 100, 0, 0, 0, 0, 0, 0, 10, 0};
  PathColumns path(0.5, {101, 102, 103, 104, 105, 106}, {4, 8, 12, 16, 20, 24}, 4, 0, 1);
  path.tracks.publish_ns = kSecond;
  const PathJudge::CarsAt truth = [](int64_t stamp_ns) {
    const double s = double(stamp_ns - kSecond) * 1e-9;
    return std::vector<CarTruth>{{1, true}, {3, false, 100, 10 * s, 0, 0, 0, 0, M_PI / 2, 10, 0}};
  };
  Table out = make_tables()["paths"];
  judge.add(8, path.tracks, 0, now);
  judge.advance(kSecond + kSecond / 2 - 1, truth, out);
  CHECK(out.rows() == 0);
  judge.advance(kSecond + kSecond / 2, truth, out);
  REQUIRE(out.rows() == 1);
  CHECK(cell(out, 0, "frame") == 8);
  CHECK(cell(out, 0, "car") == 3);
  CHECK(cell(out, 0, "horizon_s") == 0.5);
  CHECK(cell(out, 0, "along_m") == Approx(-1));         // y: 4 where the car is at 5
  CHECK(cell(out, 0, "across_m") == Approx(-1));        // x: 101, to the right of a car that drives along y
  CHECK(cell(out, 0, "square") == Approx(0.25 + 1.0));  // 1^2 / 4 + 1^2 / 1
  CHECK(std::isnan(cell(out, 0, "offset_change_m")));   // no circuit
  CHECK(std::isnan(cell(out, 0, "steady_square")));     // not published
  judge.advance(3 * kSecond, truth, out);
  REQUIRE(out.rows() == 3);
  CHECK(cell(out, 1, "horizon_s") == 1);
  CHECK(cell(out, 2, "horizon_s") == 2);
  CHECK(cell(out, 2, "along_m") == Approx(-4));
  CHECK(cell(out, 2, "across_m") == Approx(-4));
  // The truth ends, or the car leaves it: the last horizon has no row, not even later.
  judge.advance(
      4 * kSecond, [](int64_t) { return std::vector<CarTruth>{}; }, out);
  judge.advance(9 * kSecond, truth, out);
  CHECK(out.rows() == 3);
}

TEST_CASE("paths: a steady car's deviations are in the axes of the predicted course") {
  PathJudge judge;
  PathColumns path(0.5, {103}, {4}, 4, 0, 1);
  const double course_rad = M_PI / 2, along_m = 2, across_m = 0.5;
  path.tracks.path_course_rad = &course_rad;
  path.tracks.path_steady_along_m = &along_m, path.tracks.path_steady_across_m = &across_m;
  Table out = make_tables()["paths"];
  judge.add(0, path.tracks, 0, {3, false, 100, 0, 0, 0, 0, 0, 0, 10, 0});
  judge.advance(
      kSecond,
      [](int64_t) {
        return std::vector<CarTruth>{{3, false, 102, 0, 0, 0, 0, 0, 0, 10, 0}};
      },
      out);
  REQUIRE(out.rows() == 1);
  CHECK(cell(out, 0, "steady_square") == Approx(4.0 + 4.0));  // 4 m along, 1 m across
}

TEST_CASE("paths: a horizon uses the nearest point at that point's own time; a path that is too short has none") {
  PathJudge judge;
  PathColumns path(0.4, {4.1, 8.2, 12.3, 16.4}, {0, 0, 0, 0}, 1, 0, 1);  // at 0.4, 0.8, 1.2, 1.6 s
  const PathJudge::CarsAt truth = [](int64_t stamp_ns) {
    return std::vector<CarTruth>{{3, false, 1e-8 * double(stamp_ns) + 0.5, 0, 0, 0, 0, 0, 0, 10, 0}};
  };
  Table out = make_tables()["paths"];
  judge.add(0, path.tracks, 0, {3});
  judge.advance(10 * kSecond, truth, out);
  REQUIRE(out.rows() == 2);                        // 0.5 s: the point at 0.4; 1 s: that at 1.2; 2 s would be at 2.0
  CHECK(cell(out, 0, "along_m") == Approx(-0.4));  // the car drives 10 m/s, 0.5 m ahead
  CHECK(cell(out, 1, "along_m") == Approx(-0.2));
  CHECK(cell(out, 0, "horizon_s") == 0.5);
  CHECK(cell(out, 1, "horizon_s") == 1);
  judge.add(0, ovt_tracks{}, 0, {3});  // a method without paths
  judge.advance(10 * kSecond, truth, out);
  CHECK(out.rows() == 2);
}

TEST_CASE("paths: the changes of speed and offset are the largest ones until the horizon") {
  const TempFolder folder;
  PathJudge judge;
  judge.use_circuit(folder.write("map.csv", "0,0,9,9\n100,0,9,9\n200,0,9,9\n300,0,9,9\n"));
  PathColumns path(0.5, std::vector<double>(6, 50), std::vector<double>(6, 0), 1, 0, 1);
  // Brakes by 6 m/s until 1 s and is as fast as before at 2 s; between 2 and 3 s it moves from 1 to 3 m left.
  const PathJudge::CarsAt truth = [](int64_t stamp_ns) {
    const double s = double(stamp_ns) * 1e-9;
    const double speed = s < 1 ? 40 - 6 * s : s < 2 ? 34 + 6 * (s - 1) : 40;
    return std::vector<CarTruth>{{3, false, 50, s < 2 ? 1 : 1 + 2 * (s - 2), 0, 0, 0, 0, 0, speed, 0}};
  };
  Table out = make_tables()["paths"];
  judge.add(0, path.tracks, 0, truth(0)[0]);
  judge.advance(3 * kSecond, truth, out);
  REQUIRE(out.rows() == 4);
  const double speeds[] = {-3, -6, -6, -6}, offsets[] = {0, 0, 0, 2};
  for (std::size_t r = 0; r < 4; ++r) {
    CHECK(cell(out, r, "speed_change_mps") == Approx(speeds[r]));
    CHECK(cell(out, r, "offset_change_m") == Approx(offsets[r]));
  }
}

TEST_CASE("paths: the offset is that of the truth where the log has it, not that from the map") {
  const TempFolder folder;
  PathJudge judge;
  judge.use_circuit(folder.write("map.csv", "0,0,9,9\n100,0,9,9\n200,0,9,9\n300,0,9,9\n"));
  PathColumns path(0.5, {50}, {0}, 1, 0, 1);
  // 1 m away from the map's line, where the true one bends away.
  const PathJudge::CarsAt truth = [](int64_t stamp_ns) {
    const double s = double(stamp_ns) * 1e-9;
    return std::vector<CarTruth>{{3, false, 50, 1, 0, 0, 0, 0, 0, 40, 0, 2 + 4 * s}};
  };
  Table out = make_tables()["paths"];
  judge.add(0, path.tracks, 0, truth(0)[0]);
  judge.advance(kSecond, truth, out);
  REQUIRE(out.rows() == 1);
  CHECK(cell(out, 0, "offset_change_m") == Approx(2));
}

TEST_CASE("path figures: bias, deviation, 95 % and ellipses by what the car does") {
  Run run = empty_run();
  const auto add = [&](double horizon, double along, double across, double square, double speed, double offset) {
    run.tables["paths"].add({0, 1, horizon, along, across, square, speed, offset, NAN});
  };
  // At 2 s: cruising up to 2 m/s and 0.4 m, hard above 6 m/s, a lane change above 1 m.
  add(2, 1, 0.5, 2.4, 2, -0.4);
  add(2, -3, 0.25, 5.9, -2, 0.4);
  add(2, 4, 0, 6.0, -6.1, 0);
  add(2, 0, 2, NAN, 0, 1.1);
  add(2, 0, 0, 1, 6.1, -1.1);
  add(2, 7, 7, 1, 2.1, 0);  // neither
  add(1, 5, 5, 1, 0, NAN);  // without a circuit
  const TrackQuality q = quality_of_tracks(run);
  const auto at_2_s = [&](Manoeuvre m) -> const PathFigures& { return q.paths[2][std::size_t(m)]; };
  const PathFigures& cruising = at_2_s(Manoeuvre::kCruising);
  CHECK(cruising.along_m.error.count == 2);
  CHECK(cruising.along_m.error.mean == Approx(-1));
  CHECK(cruising.along_m.error.deviation == Approx(std::sqrt(8.0)));
  CHECK(cruising.along_m.size_p95 == Approx(2.9));  // of 1 and 3
  CHECK(cruising.across_m.size_p95 == Approx(0.4875));
  CHECK(cruising.in_70.value == Approx(0.5));  // chi-square 2.408
  CHECK(cruising.in_95.value == Approx(1));    // 5.991
  // Where the deviations of a steady car are published, they tell the 70 %.
  Run steady = empty_run();
  for (const double square : {1.0, 2.3, 2.5}) steady.tables["paths"].add({0, 1, 2, 0, 0, 5.9, 0, 0, square});
  const PathFigures& of_steady = quality_of_tracks(steady).paths[2][std::size_t(Manoeuvre::kCruising)];
  CHECK(of_steady.in_70.value == Approx(2.0 / 3));
  CHECK(of_steady.in_95.value == Approx(1));
  const PathFigures& hard = at_2_s(Manoeuvre::kSpeedChange);
  CHECK(hard.along_m.error.count == 2);
  CHECK(hard.along_m.error.mean == Approx(2));
  CHECK(hard.in_95.hits == 1);
  const PathFigures& lanes = at_2_s(Manoeuvre::kLaneChange);
  CHECK(lanes.across_m.error.count == 2);
  CHECK(lanes.across_m.error.mean == Approx(1));
  CHECK(lanes.in_95.trials == 1);  // the other one has no covariance
  CHECK(at_2_s(Manoeuvre::kAll).along_m.error.count == 6);
  CHECK(q.paths[1][std::size_t(Manoeuvre::kAll)].along_m.error.count == 1);
  for (const Manoeuvre m : {Manoeuvre::kCruising, Manoeuvre::kLaneChange})
    CHECK(q.paths[1][std::size_t(m)].along_m.error.count == 0);
  CHECK(q.paths[3][0].along_m.error.count == 0);
}

TEST_CASE("existence: a table of thresholds with false tracks an hour and delay, and the least one for the goal") {
  Run run = empty_run();
  const auto add = [&](double frame, double id, double existence, double car) {
    run.tables["existence"].add({frame, 0.05 * frame, id, existence, 0, car});
  };
  for (int32_t k = 0; k < 20; ++k) {
    run.tables["clusters"].add({double(k), 1, 0, 0});
    add_car_row(run, k, 1, 60, k < 2 ? 2 : 3, 0);  // detectable from frame 2 on
    if (k >= 4) add(k, 5, k < 8 ? 0.75 : k < 14 ? 0.96 : 0.985, 1);
    if (k < 5) add(k, 9, k == 3 ? 0.7 : 0.2, -1);  // a false one that reaches 0.7
    if (k < 3) add(k, 11, 0.999, -1);              // on a parked vehicle while confirmed
    if (k == 6) add(k, 5, 0.99, -1);               // the car's own, for a moment away from it
  }
  run.tables["parked_tracks"].add({4, 11, 1});
  const TrackQuality q = quality_of_tracks(run);
  CHECK(q.hours == Approx(1.0 / 3600));
  const auto at = [&](double existence) {
    return *std::find_if(q.thresholds.begin(), q.thresholds.end(),
                         [&](const Threshold& t) { return t.existence == existence; });
  };
  CHECK(at(0.7).false_tracks == 1);
  CHECK(at(0.7).false_per_hour == Approx(3600));
  CHECK(at(0.7).delay.median_s == Approx(0.1));  // frame 2 to 4
  CHECK(at(0.8).false_tracks == 0);
  CHECK(at(0.8).delay.median_s == Approx(0.3));  // frame 8
  CHECK(at(0.98).delay.median_s == Approx(0.6));
  CHECK(at(0.99).delay.never == 1);
  CHECK(std::isnan(at(0.99).delay.median_s));
  const Rows rows = track_rows({q});
  CHECK(rows[rows.size() - 2][1] == "0.30, 0.30 (1, never: 0)");
  CHECK(rows.back()[1] == "0.8; 0.000");
  CHECK(threshold_rows({q}).back()[1] == "0.0 (0); never (1)");
  REQUIRE(q.least_threshold());
  CHECK(q.least_threshold()->existence == 0.8);
  CHECK(q.existence.count() == 16 + 5 + 3 + 1);

  run.tables["existence"] = make_tables()["existence"];  // a method that publishes none
  CHECK(quality_of_tracks(run).thresholds.empty());
  CHECK(!quality_of_tracks(run).least_threshold());
}

TEST_CASE("track figures: errors by range, of speed while cruising and braking, of the heading in a spin") {
  Run run = empty_run();
  const auto add = [&](double frame, double ahead, double left, double error, double accel, double yaw_rate,
                       double slip, double speed) {
    run.tables["cars"].add({frame, 0, 1, ahead, left, 0, 0, 20, 1, 1, 1, 0, 1});
    run.tables["motion"].add({frame, 1, speed, accel, yaw_rate, slip});
    add_track_row(run, frame, 5, 1, ahead, error, 2 * error, 3 * error, 4 * error, 5 * error);
  };
  add(0, 24, -32, 1, -1, 0, 0, 50);            // 40 m
  add(1, -39, 0, 2, 0.5, 0.69, 0.17, 50);      // not yet a spin
  add(2, 79, 0, 3, -3.1, 0, -0.18, 50);        // a spin by its slip
  add(3, 109, 0, 4, -2, 0.71, 0, 2);           // by its yaw rate, almost standing; neither cruising nor braking
  add(4, 111, 0, 5, NAN, 0, 1.5, 2);           // stands across
  add_track_row(run, 4, 6, -1, 50, NAN, NAN);  // false
  const TrackQuality q = quality_of_tracks(run);
  CHECK(q.along_m[0].error.count == 1);
  CHECK(q.along_m[0].error.mean == 2);
  CHECK(q.across_m[1].error.mean == Approx(4));  // 2 (1 + 3) / 2
  CHECK(q.along_m[1].error.deviation == Approx(std::sqrt(2.0)));
  CHECK(q.along_m[2].error.mean == 4);
  CHECK(q.speed_mps.error.count == 5);
  CHECK(q.speed_cruising_mps.error.count == 2);
  CHECK(q.speed_cruising_mps.error.mean == Approx(4.5));
  CHECK(q.speed_cruising_mps.rms == Approx(std::sqrt((9 + 36) / 2.0)));  // contains the bias
  CHECK(std::isnan(spread_of({NAN}).rms));
  CHECK(q.speed_braking_mps.error.count == 1);
  CHECK(q.speed_braking_mps.size_p95 == Approx(9));
  CHECK(q.course_rad.error.count == 3);  // of a moving car
  CHECK(q.spin_heading_rad.error.count == 2);
  CHECK(q.spin_heading_rad.error.mean == Approx(14));
  CHECK(q.spin_axis_rad.error.mean == Approx((12 - 4 * M_PI + 16 - 5 * M_PI) / 2));
}

TEST_CASE("places: the mean acceleration of a car is its change of speed over the time between") {
  std::vector<CarTruth> before(3), after(2);
  for (int32_t k = 0; k < 3; ++k) before[std::size_t(k)].car = k, before[std::size_t(k)].speed_mps = 10 * k;
  after[0].car = 2, after[0].speed_mps = 19;
  after[1].car = 1, after[1].speed_mps = 11.5;
  CHECK(mean_acceleration(2, before, after, 0.05) == Approx(-20));
  CHECK(mean_acceleration(1, before, after, 0.5) == Approx(3));
  CHECK(std::isnan(mean_acceleration(0, before, after, 0.05)));
}

TEST_CASE("places: the rate of a track's course is compared with that of the car's course, not with its body's") {
  std::vector<CarTruth> before(2), after(1);
  before[0].car = 4, before[1].car = 3, before[1].course_rad = M_PI - 0.01, after[0].car = 3;
  after[0].course_rad = -M_PI + 0.01;
  CHECK(mean_course_rate(3, before, after, 0.05) == Approx(0.4));
  CHECK(std::isnan(mean_course_rate(4, before, after, 0.05)));

  CarTruth car;  // spins: the body turns by 6 rad/s, the course by 0.5
  car.x_m = 10, car.y_m = 20, car.speed_mps = 30, car.course_rad = 3, car.yaw_rate_rps = 6;
  const double x[] = {11}, y[] = {18}, speed[] = {33}, course[] = {-3}, rate[] = {0.75};
  ovt_tracks t{};
  t.count = 1, t.x_m = x, t.y_m = y, t.speed_mps = speed, t.course_rad = course, t.yaw_rate_rps = rate;
  const std::array<double, 5> e = state_error(t, 0, car, 0.5), expected = {1, -2, 3, 2 * M_PI - 6, 0.25};
  for (std::size_t k = 0; k < 5; ++k) CHECK(e[k] == Approx(expected[k]));
  car.speed_mps = 3;  // no course any more
  CHECK(std::isnan(state_error(t, 0, car, 0.5)[4]));
}

TEST_CASE("places: beyond the last published pose the ego drives on its arc") {
  io::EgoRow last;
  last.stamp_ns = kSecond, last.x_m = 100, last.speed_mps = 50, last.yaw_rate_rps = 0.5;
  const std::vector<PublishedPose> poses = {{last, 0}};
  // A circle of 100 m with its centre at (100, 100).
  for (const double s : {-1.0, -0.2, 0.0, 0.2, 1.0}) {
    const io::EgoRow row = pose_at(poses, kSecond + int64_t(s * 1e9));
    CHECK(row.yaw_rad == Approx(0.5 * s));
    CHECK(row.x_m == Approx(100 + 100 * std::sin(0.5 * s)));
    CHECK(row.y_m == Approx(100 - 100 * std::cos(0.5 * s)));
  }
  last.yaw_rate_rps = 0;
  CHECK(pose_at({{last, 0}}, 3 * kSecond).x_m == Approx(200));
}

TEST_CASE("identity: a whole overtake keeps one id if the same track is at the car on both sides") {
  const auto overtakes = [](const std::vector<CarRow>& rows) { return count_kept_ids(rows).overtakes; };
  std::vector<CarRow> rows = drive({80, 59, 30, 1, -20, -59, -70});
  CHECK(overtakes(rows).trials == 1);
  CHECK(overtakes(rows).hits == 1);
  rows[3].id = 0;  // a miss alongside
  CHECK(overtakes(rows).hits == 1);
  rows[0].id = rows[6].id = 8;  // another id beyond 60 m
  CHECK(overtakes(rows).hits == 1);
  rows[4].id = 8;
  CHECK(overtakes(rows).hits == 0);
  rows[4].id = rows[5].id = 0;  // never behind
  CHECK(overtakes(rows).hits == 0);
  CHECK(overtakes(rows).trials == 1);
  std::reverse(rows.begin(), rows.end());
  for (std::size_t k = 0; k < rows.size(); ++k) rows[k].time_s = 0.5 * double(k), rows[k].id = 7;
  CHECK(overtakes(rows).hits == 1);  // the other way

  CHECK(overtakes(drive({80, 59, 30, 1, -20, -59})).trials == 0);     // the log ends
  CHECK(overtakes(drive({80, 59, 30, 1, -20, 10, 61})).trials == 0);  // falls back again
  CHECK(overtakes(drive({59, 30, 1, -20, -59, -70})).trials == 0);    // begins within
  rows = drive({80, 59, 30, 1, -20, -59, -70});
  rows[3].left_m = 31;  // another part of the circuit
  CHECK(overtakes(rows).trials == 0);
  rows[3].left_m = 2;
  for (std::size_t k = 3; k < rows.size(); ++k) rows[k].time_s += 2;  // away in between
  CHECK(overtakes(rows).trials == 0);
}

TEST_CASE("identity: a gap of 3 s counts if the car had an id before it, and is kept if it has the same one after") {
  const auto gaps = [](const std::vector<CarRow>& rows) { return count_kept_ids(rows).gaps; };
  const auto hidden = [](std::size_t from, std::size_t to) {
    std::vector<CarRow> rows = drive(std::vector<double>(20, 40));
    for (std::size_t k = from; k < to; ++k) rows[k].points = 2, rows[k].id = 0;
    return rows;
  };
  std::vector<CarRow> rows = hidden(4, 9);  // detectable in row 3 and row 9: 3 s
  CHECK(gaps(rows).trials == 1);
  CHECK(gaps(rows).hits == 1);
  CHECK(gaps(hidden(4, 8)).trials == 0);  // 2.5 s
  for (std::size_t k = 9; k < 13; ++k) rows[k].id = 0;
  CHECK(gaps(rows).hits == 1);  // back 2 s after the gap
  rows[13].id = 0;
  CHECK(gaps(rows).hits == 0);  // too late
  CHECK(gaps(rows).trials == 1);
  rows = hidden(4, 9);
  for (std::size_t k = 9; k < 20; ++k) rows[k].id = 8;
  CHECK(gaps(rows).hits == 0);
  rows = hidden(4, 9);
  rows[3].id = rows[2].id = 0;
  CHECK(gaps(rows).hits == 1);  // 1 s before the gap it had one
  rows[1].id = 0;
  CHECK(gaps(rows).trials == 0);
  rows = hidden(4, 9);
  rows[6].ahead_m = -101;  // out of reach meanwhile
  CHECK(gaps(rows).trials == 0);
  rows = hidden(4, 18);  // the log ends 0.5 s after the gap
  CHECK(gaps(rows).hits == 1);
  rows[18].id = rows[19].id = 0;
  CHECK(gaps(rows).trials == 0);
  rows = hidden(4, 9);
  for (CarRow& row : rows) row.points = NAN;  // a log that does not say
  CHECK(gaps(rows).trials == 0);
}

TEST_CASE("identity: after 3 s without a confirmed track the id is the same or another one, or there is none") {
  const auto losses = [](const std::vector<CarRow>& rows) { return count_kept_ids(rows).losses; };
  std::vector<CarRow> rows = drive(std::vector<double>(20, 40));
  CHECK(losses(rows).trials == 0);
  for (std::size_t k = 4; k < 9; ++k) rows[k].id = 0;  // rows 3 to 9: 3 s
  CHECK(losses(rows).trials == 1);
  CHECK(losses(rows).hits == 1);
  for (std::size_t k = 9; k < 20; ++k) rows[k].id = 8;
  CHECK(losses(rows).trials == 1);
  CHECK(losses(rows).hits == 0);
  rows[8].id = 8;  // 2.5 s
  CHECK(losses(rows).trials == 0);
  for (std::size_t k = 8; k < 20; ++k) rows[k].id = 0;
  CHECK(losses(rows).trials == 0);  // never again
  rows = drive(std::vector<double>(20, 40));
  for (std::size_t k = 4; k < 9; ++k) rows[k].id = 0;
  rows[6].left_m = 150;  // elsewhere on the circuit meanwhile
  CHECK(losses(rows).trials == 0);
}

TEST_CASE("confirmation: the delay runs from the first 3 points, the distance is that of a car that comes from afar") {
  const auto is_confirmed = [](const CarRow& row) { return row.confirmed; };
  std::vector<CarRow> rows = drive({160, 149, 130, 125, 90, 79});
  for (std::size_t k = 0; k < 4; ++k) rows[k].confirmed = false;
  rows[1].points = 2;
  CHECK(delays_to(rows, is_confirmed).seconds == std::vector<double>{1.0});  // rows 2 and 4
  rows[2].confirmed = true;
  rows[2].points = 2;
  CHECK(delays_to(rows, is_confirmed).seconds == std::vector<double>{0.0});  // before it is detectable
  rows[1].confirmed = true;  // its first row in reach: it had a track before
  CHECK(delays_to(rows, is_confirmed).seconds.empty());
  CHECK(delays_to(rows, is_confirmed).already_found == 1);
  rows[1].begins_log = true;  // no track is older: found at once
  CHECK(delays_to(rows, is_confirmed).seconds == std::vector<double>{0.0});
  rows[1].begins_log = false;
  for (CarRow& row : rows) row.confirmed = false;
  REQUIRE(delays_to(rows, is_confirmed).seconds.size() == 1);
  CHECK(std::isnan(delays_to(rows, is_confirmed).seconds[0]));
  for (CarRow& row : rows) row.points = 2, row.confirmed = true;
  CHECK(delays_to(rows, is_confirmed).seconds.empty());
  CHECK(delays_to(rows, is_confirmed).already_found == 0);  // never detectable

  // Not confirmed in rows 0 and 1; out of reach for 1.5 s the car is the same presence, for 2 s it comes anew.
  rows = drive({149, 140, 160, 155, 149, 140, 130});
  rows[0].confirmed = rows[1].confirmed = false;
  CHECK(delays_to(rows, is_confirmed).seconds == std::vector<double>{2.0});
  CHECK(delays_to(rows, is_confirmed).already_found == 0);
  rows = drive({149, 140, 160, 155, 151, 149, 140, 130});
  rows[0].confirmed = rows[1].confirmed = false;
  REQUIRE(delays_to(rows, is_confirmed).seconds.size() == 1);
  CHECK(std::isnan(delays_to(rows, is_confirmed).seconds[0]));
  CHECK(delays_to(rows, is_confirmed).already_found == 1);
  CHECK(delays_to(rows, is_confirmed, 2.0).seconds == std::vector<double>{2.5});

  const FoundAfter found = found_after({{0.1, NAN, 0.3, 0.2}, 5});
  CHECK(found.presences == 4);
  CHECK(found.already_found == 5);
  CHECK(found.never == 1);
  CHECK(found.median_s == Approx(0.2));
  CHECK(found.p99_s == Approx(0.298));

  rows = drive({260, 160, 120, 100, 80});
  for (std::size_t k = 0; k < 3; ++k) rows[k].confirmed = false;
  for (CarRow& row : rows) row.left_m = 0;
  REQUIRE(find_approaches(rows).size() == 1);
  CHECK(find_approaches(rows)[0].ahead);
  CHECK(find_approaches(rows)[0].confirmed_m == Approx(100));
  rows[3].confirmed = rows[4].confirmed = false;
  CHECK(std::isnan(find_approaches(rows)[0].confirmed_m));
  rows[4].ahead_m = 81;  // does not come near
  CHECK(find_approaches(rows).empty());
  CHECK(find_approaches(drive({119, 90, 70})).empty());  // does not come from afar
  rows = drive({-85, -70, -50.0, -40});
  rows[0].confirmed = false;
  REQUIRE(find_approaches(rows).size() == 1);
  CHECK(!find_approaches(rows)[0].ahead);
  CHECK(find_approaches(rows)[0].confirmed_m == Approx(std::hypot(70, 2)));
}

TEST_CASE("car rows: the id is that of the track that CLEAR MOT gives the car, the existence the largest at it") {
  Run run = empty_run();
  for (int32_t k = 0; k < 3; ++k) {
    run.tables["clusters"].add({double(k), 1, 0, 0});
    add_car_row(run, k, 1, 60, 20, 1);
    add_track_row(run, k, 5, 1, k == 2 ? 60.5 : 60, 0, 0);
    add_track_row(run, k, 6, 1, k == 2 ? 60 : 62, 0, 0);  // a second one, nearer in the last frame
    run.tables["existence"].add({double(k), 0, 5, 0.4, 1, 1});
    run.tables["existence"].add({double(k), 0, 6, 0.8, 1, 1});
    run.tables["existence"].add({double(k), 0, 7, 0.99, 1, -1});
  }
  const auto rows = car_rows(run);
  REQUIRE(rows.size() == 1);
  REQUIRE(rows.at(1).size() == 3);
  CHECK(rows.at(1)[0].begins_log);
  CHECK_FALSE(rows.at(1)[1].begins_log);
  for (const CarRow& row : rows.at(1)) {
    CHECK(row.id == 5);
    CHECK(row.existence == 0.8);
    CHECK(row.confirmed);
  }
}

TEST_CASE(
    "every N-th frame: a step longer than the limits of a pause does not end a presence, an overtake, an approach") {
  Run run = empty_run();
  run.about["compared"] = "40";  // 2 s
  const double ahead_m[] = {140, 110, 70, 30, -30, -70, -90};
  for (int32_t k = 0; k < 7; ++k) {
    const double frame = 40 * k;
    run.tables["clusters"].add({frame, 1, 0, 0});
    add_car_row(run, frame, 1, ahead_m[k], 20, k > 0);
    if (k > 0) add_track_row(run, frame, 5, 1, ahead_m[k], 0, 0);
  }
  const TrackQuality q = quality_of_tracks(run);
  CHECK(q.confirmed.presences == 1);
  CHECK(q.confirmed.already_found == 0);
  CHECK(q.confirmed.median_s == Approx(2));
  CHECK(q.overtakes.trials == 1);
  CHECK(q.overtakes.hits == 1);
  CHECK(q.from_ahead.approaches == 1);
  CHECK(q.hours == Approx(14.0 / 3600));
  const TrackFigures t = make_figures({run})[0].tracks;
  CHECK(t.cars_seen == 1);
  CHECK(t.time_to_confirm_s.mean == Approx(2));
  run.tables["cars"].add({320, 16, 2, 140, 0, 140, 0, 20, 1, 1, 1, 0, 1});  // has had its track before
  CHECK(make_figures({run})[0].tracks.cars_seen == 2);
  CHECK(make_figures({run})[0].tracks.time_to_confirm_s.mean == Approx(2));
}

TEST_CASE("false tracks: the seconds of confirmed tracks at no car count also of a track that was at a car once") {
  Run run = empty_run();
  for (int32_t k = 0; k < 10; ++k) {
    run.tables["clusters"].add({double(k), 1, 0, 0});
    add_track_row(run, k, 5, k == 0 ? 1 : -1, 60, k == 0 ? 0 : NAN, NAN);
  }
  TrackFigures t = make_figures({run})[0].tracks;
  CHECK(t.false_tracks == 0);
  CHECK(t.false_s == Approx(0.45));
  CHECK(t.false_s_per_hour == Approx(0.45 / 0.5 * 3600));
  run.about["compared"] = "2";
  t = make_figures({run})[0].tracks;
  CHECK(t.false_s == Approx(0.9));
  CHECK(t.false_s_per_hour == Approx(0.45 / 0.5 * 3600));
}

TEST_CASE("GOSPA: its mean leaves out frames with neither a car nor a track") {
  Run run = empty_run();
  for (int32_t k = 0; k < 4; ++k) run.tables["clusters"].add({double(k), 1, 0, 0});
  add_car_row(run, 1, 1, 60, 20, 1);
  add_track_row(run, 1, 5, 1, 61, 0, 0);
  add_track_row(run, 2, 6, -1, 40, NAN, NAN);
  const TrackFigures t = make_figures({run})[0].tracks;
  CHECK(t.gospa_m.count == 2);
  CHECK(t.gospa_m.mean == Approx((1 + std::sqrt(2.0)) / 2));
  CHECK(t.gospa_located_m2 == Approx(0.5));
  CHECK(t.gospa_false_m2 == Approx(1));
}

TEST_CASE("HOTA: the mean localisation is that of the runs with a pair; frames without a car have their own time") {
  Run one = empty_run(), other = empty_run();
  for (Run* run : {&one, &other}) {
    run->tables["clusters"].add({0, 1, 0, 0});
    add_car_row(*run, 0, 1, 60, 20, 1);
  }
  add_track_row(one, 0, 5, 1, 60, 0, 0);
  const TrackFigures t = make_figures({one, other})[0].tracks;
  CHECK(t.hota.hota == Approx(0.5));
  CHECK(t.hota.localisation == Approx(1));
  CHECK(t.hota_window.localisation == Approx(1));

  one.tables["clusters"].add({500, 1, 0, 0});
  one.tables["ego"].add({500, 25, 0, 0});
  CHECK(mot_frames(one).at(500).time_s == 25);
}

TEST_CASE("consistency: the share of single NEES and NIS values within their 95 % bounds") {
  Run run = empty_run();
  run.tables["clusters"].add({0, 1, 0, 0});
  add_car_row(run, 0, 1, 60, 20, 1);
  for (const double nees : {0.82, 0.84, 5.0, 12.8, 12.9, double(NAN)})
    add_track_row(run, 0, 5 + nees, 1, 60, 0, 0, 0, 0, 0, nees);
  for (const double nis : {0.05, 0.06, 7.3, 7.4}) run.tables["innovations"].add({0, 1, nis});
  run.tables["innovations"].add({0, -1, 1.0});
  for (const double nis : {0.04, 2.0, 4.0}) run.tables["innovations_own"].add({0, 1, nis});
  run.tables["innovations_own"].add({0, -1, 9.0});
  const TrackFigures t = make_figures({run})[0].tracks;
  CHECK(t.nees_inside.trials == 5);
  CHECK(t.nees.left_out == 1);
  CHECK(t.nees_inside.hits == 3);
  CHECK(t.nis_inside.trials == 4);
  CHECK(t.nis_inside.hits == 2);
  CHECK(t.nis_own.mean == Approx(6.04 / 3));
  CHECK(t.nis_own_inside.trials == 3);
  CHECK(t.nis_own_inside.hits == 2);
}

TEST_CASE("consistency: the covariance of a detection turns with the vehicle into the map") {
  const float xx[] = {4}, yy[] = {1}, xy[] = {0.5f};
  ovt_detections d{};
  CHECK(std::isnan(covariance_in_map(d, 0, axes_of(0, 0, 0))[0]));
  d.var_x = xx, d.var_y = yy, d.cov_xy = xy;
  const auto check = [&](double roll, double yaw, std::array<double, 3> expected) {
    const auto found = covariance_in_map(d, 0, axes_of(roll, 0, yaw));
    for (std::size_t k = 0; k < 3; ++k) CHECK(found[k] == Approx(expected[k]));
  };
  check(0, 0, {4, 0.5, 1});
  check(0, M_PI / 2, {1, -0.5, 4});
  check(0, M_PI / 4, {2, 1.5, 3});      // (4 + 1) / 2 -+ 0.5; (4 - 1) / 2
  check(M_PI / 3, 0, {4, 0.25, 0.25});  // on a bank of 60 deg
}

TEST_CASE("parked vehicles: a track stays on one until its next detection lies elsewhere") {
  const int32_t clusters[] = {0, 1, 2, 3}, classes[] = {1, 1, OVT_CLASS_DEBRIS, 1};
  ovt_detections d{};
  d.count = 4, d.cluster = clusters, d.object_class = classes;
  const auto surface_of = [](int32_t cluster) {
    return int32_t(cluster == 1 ? sim::Surface::outer_wall : sim::Surface::parked_vehicle);
  };
  const uint64_t ids[] = {10, 11, 12, 13};
  int32_t rows[] = {0, 1, 2, -1};
  ovt_tracks t{};
  t.count = 4, t.id = ids, t.detection = rows;
  std::set<uint64_t> parked = {11, 13};
  note_parked(t, d, surface_of, parked);
  CHECK(parked == std::set<uint64_t>{10, 13});  // debris on a parked vehicle is false, as for detections
  rows[0] = -1, rows[3] = 4;                    // coasting; a row that this frame does not have
  note_parked(t, d, surface_of, parked);
  CHECK(parked == std::set<uint64_t>{10, 13});
  rows[0] = 1;
  d.cluster = nullptr;  // a log that does not say
  note_parked(t, d, surface_of, parked);
  CHECK(parked == std::set<uint64_t>{10, 13});
}

TEST_CASE("parked vehicles: a track that was confirmed on one is not a false track") {
  Run run = empty_run();
  run.tables["clusters"].add({0, 1, 0, 0});
  for (const double id : {5.0, 6.0, 7.0}) add_track_row(run, 0, id, -1, 30, NAN, NAN);
  run.tables["parked_tracks"].add({1, 6, 1});
  run.tables["parked_tracks"].add({1, 7, 0});  // only tentative there
  CHECK(make_figures({run})[0].tracks.false_tracks == 2);
}

TEST_CASE("track tables: a column for each preset and the goal; values that no preset has give no row") {
  Run best = empty_run(), paper = empty_run();
  paper.variant = "paper";
  for (Run* run : {&best, &paper}) {
    run->tables["clusters"].add({0, 1, 0, 0});
    add_car_row(*run, 0, 1, 30, 20, 1);
    run->tables["motion"].add({0, 1, 60, 0, 0, 0});
    add_track_row(*run, 0, 5, 1, 30, run == &best ? 0.25 : 1.5, 0, 0.5);
    run->tables["paths"].add({0, 1, 1, run == &best ? 0.5 : 2, 0.25, 1, 0, 0, NAN});
  }
  best.tables["existence"].add({0, 0, 5, 0.75, 1, 1});
  const std::vector<TrackQuality> columns = track_quality_of(find_track_quality({best, paper}), "hand");
  REQUIRE(columns.size() == 2);
  const Rows tracks = track_rows(columns), paths = path_rows(columns);
  CHECK(tracks[0] == std::vector<std::string>{"scenario: hand", "best", "paper", "goal"});
  CHECK(tracks[1] == std::vector<std::string>{"position along m, 0 to 40 m: rms (deviation, bias, 95 %)",
                                              "0.25 (0.00, 0.25, 0.25)", "1.50 (0.00, 1.50, 1.50)", "0.08"});
  const auto has = [](const Rows& rows, const char* word) {
    return std::any_of(rows.begin(), rows.end(),
                       [&](const auto& row) { return row[0].find(word) != std::string::npos; });
  };
  CHECK(has(tracks, "cruising"));
  CHECK(!has(tracks, "braking"));
  CHECK(!has(tracks, "overtakes"));
  const auto cruising = std::find_if(paths.begin(), paths.end(), [](const auto& row) {
    return row[0] == "cruising, 1 s: along m, 95 % (bias, deviation)";
  });
  REQUIRE(cruising != paths.end());
  CHECK((*cruising)[1] == "0.50 (0.50, 0.00)");
  CHECK((*cruising)[2] == "2.00 (2.00, 0.00)");
  CHECK((*cruising)[3] == "0.6");
  CHECK(calibration_rows(columns).size() == 2);
  CHECK(calibration_rows(columns)[1][1] == "1.000 (mean 0.750, 1 tracks)");
  CHECK(calibration_rows(columns)[1][2] == "-");
  CHECK(threshold_rows(columns).size() > 5);
  const nlohmann::json json = json_of(columns[0]);
  CHECK(json["paths"][1]["horizon_s"] == 1);
  CHECK(json["paths"][1]["cruising"]["along_m"]["p95_of_size"] == Approx(0.5));
  CHECK(json["position"][0]["along_m"]["rms"] == Approx(0.25));
  CHECK(json["existence"]["brier"] == Approx(0.0625));
  CHECK(json["existence"]["at_0_1_false_an_hour"]["existence"] == 0.5);
  CHECK(!json_of(columns[1]).contains("existence"));
  const std::string html = track_section(find_track_quality({best, paper}), "hand");
  for (const char* part : {"id=\"tracks\"", "<th>goal</th>", "Predicted paths", "Probability of existence"})
    CHECK_MESSAGE(html.find(part) != std::string::npos, part);
}
