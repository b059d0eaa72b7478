// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// Predicted paths against the truth, and their figures, on paths made by hand.
#include <doctest/doctest.h>

#include <cmath>

#include "tests/support/temp_folder.h"
#include "tests/support/track_rows.h"
#include "tools/evaluation/figures.h"
#include "tools/evaluation/path_judge.h"
#include "tools/evaluation/places.h"
#include "tools/evaluation/track_quality.h"

using namespace overtake;
using namespace overtake::evaluation;
using namespace overtake::test;
using doctest::Approx;

namespace {

constexpr int64_t kSecond = 1'000'000'000;

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

}  // namespace

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
