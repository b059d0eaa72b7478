// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// The figures of tracks on logs made by hand: every expected number is counted in the rows.
#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "tests/support/track_rows.h"
#include "tools/evaluation/detection_columns.h"
#include "tools/evaluation/figures.h"
#include "tools/evaluation/figures_parts.h"
#include "tools/evaluation/metrics/calibration.h"
#include "tools/evaluation/places.h"
#include "tools/evaluation/report_html.h"
#include "tools/evaluation/track_quality.h"
#include "tools/sim/material.h"

using namespace overtake;
using namespace overtake::evaluation;
using namespace overtake::test;
using doctest::Approx;

namespace {

constexpr int64_t kSecond = 1'000'000'000;

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
  CHECK(std::isnan(covariance_in_map(d, 0, io::axes_of(0, 0, 0))[0]));
  d.var_x = xx, d.var_y = yy, d.cov_xy = xy;
  const auto check = [&](double roll, double yaw, std::array<double, 3> expected) {
    const auto found = covariance_in_map(d, 0, io::axes_of(roll, 0, yaw));
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
