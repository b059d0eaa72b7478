// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// The evaluation without a simulator's truth: pose histories of two cars, automatic labels, recorded data sets.
#include <doctest/doctest.h>

#include <cmath>
#include <filesystem>
#include <functional>
#include <nlohmann/json.hpp>
#include <set>

#include "tests/support/bags.h"
#include "tests/support/recorded.h"
#include "tests/support/simulated_race.h"
#include "tests/support/temp_folder.h"
#include "tools/evaluation/figures.h"
#include "tools/evaluation/odometry_log.h"
#include "tools/evaluation/pose_history.h"
#include "tools/evaluation/recorded.h"
#include "tools/evaluation/recorded_tracks.h"
#include "tools/evaluation/report.h"
#include "tools/evaluation/simulated_log.h"
#include "tools/evaluation/tune.h"
#include "tools/evaluation/variant.h"
#include "tools/io/error.h"
#include "tools/io/text.h"

using namespace overtake;
using namespace overtake::evaluation;
using doctest::Approx;

namespace {

io::EgoRow row_at(double time_s, double x_m, double y_m, double yaw_rad) {
  io::EgoRow row;
  row.stamp_ns = int64_t(std::llround(time_s * 1e9)), row.x_m = x_m, row.y_m = y_m, row.yaw_rad = yaw_rad;
  return row;
}

}  // namespace

TEST_CASE("pose_history: constant acceleration is reproduced exactly, also between stamps") {
  PoseHistory history(0.15);
  for (int32_t k = 100; k >= 0; --k) {            // any order
    const double t = 0.02 * k + (k % 3) * 0.002;  // uneven intervals
    history.add(row_at(t, 1e5 + 40 * t + 2 * t * t, -3 * t, 3.1 + 0.2 * t));
  }
  const auto car = history.at(1'013'000'000);
  REQUIRE(car);
  const double t = 1.013;
  CHECK(car->x_m == Approx(1e5 + 40 * t + 2 * t * t).epsilon(1e-10));
  CHECK(car->y_m == Approx(-3 * t).epsilon(1e-6));
  CHECK(car->speed_mps == Approx(std::hypot(40 + 4 * t, 3)).epsilon(1e-6));
  CHECK(car->course_rad == Approx(std::atan2(-3, 40 + 4 * t)).epsilon(1e-6));
  CHECK(car->heading_rad == Approx(std::remainder(3.1 + 0.2 * t, 2 * M_PI)).epsilon(1e-6));  // across the jump at pi
  CHECK(car->yaw_rate_rps == Approx(0.2).epsilon(1e-6));
  CHECK(!history.at(-500'000'000));
  CHECK(!history.at(2'500'000'000));
}

TEST_CASE("pose_history: noise is smoothed, a gap gives no result, a standing car keeps its heading") {
  PoseHistory noisy(0.15);
  double raw = 0, smooth = 0;
  for (int32_t k = 0; k < 400; ++k)
    if (k < 200 || k > 260) noisy.add(row_at(0.01 * k, 0.4 * k + (k % 2 ? 0.1 : -0.1), 0, 0));
  for (int32_t k = 20; k < 180; ++k) {
    raw += 0.1 * 0.1;
    smooth += std::pow(noisy.at(k * 10'000'000)->x_m - 0.4 * k, 2);
  }
  CHECK(smooth < raw / 20);
  CHECK(!noisy.at(2'300'000'000));
  PoseHistory still(0.15);
  for (int32_t k = 0; k < 100; ++k) still.add(row_at(0.01 * k, 5, 6, 1.2));
  CHECK(still.at(500'000'000)->course_rad == Approx(1.2));
  CHECK(still.at(500'000'000)->speed_mps == Approx(0));
}

TEST_CASE("recordings: with a message that cannot be decoded there are no measures; the error names it") {
  const TempFolder folder;
  const io::Rig rig = test::swept_rig(16);
  std::vector<test::Recorded> messages;
  for (int32_t k = 0; k < 3; ++k)
    messages.push_back(test::cloud_of(test::swept_cloud(16, 20, 0), "/front/points", k * 50'000'000));
  for (const char* topic : {"/ego/odometry", "/opponent/odometry"})
    for (test::Recorded& pose : test::straight_drive(topic, 0, 200'000'000)) messages.push_back(std::move(pose));
  for (const std::size_t bad : {std::size_t(1), std::size_t(4), messages.size() - 1}) {
    auto some = messages;
    some[bad].data.resize(10);
    test::write_mcap(folder.path("race.mcap"), some);
    const std::string error = error_of([&] {
      OdometryLog log(folder.path("race.mcap"), rig, "");
      for (LogFrame frame; log.next(frame);) continue;
    });
    CHECK_MESSAGE(error.starts_with(folder.path("race.mcap") + ": message "), error);
    CHECK_MESSAGE(error.find("message " + std::to_string(bad)) != std::string::npos, error);
  }
}

TEST_CASE("recordings: a simulated log read as a recording, with odometry as truth, gives the same cars") {
  const TempFolder folder;
  const std::string log = folder.path("race.mcap"), rig_file = folder.path("rig.toml");
  test::write_race(sim::load_scenario("spin_near"), 1, 0.8, log);
  SimulatedLog truth(log);
  OdometryLog recorded(log, truth.rig(), "");
  LogFrame a, b;
  int32_t frames = 0, compared = 0;
  while (truth.next(a) && recorded.next(b)) {
    ++frames;
    REQUIRE(a.scans.scans.size() == b.scans.scans.size());
    CHECK(b.surface.empty());
    const int64_t stamp = a.scans.scans[0].stamp_ns;
    const auto exact = truth.cars_at(stamp), smoothed = recorded.cars_at(stamp);
    if (smoothed.empty()) continue;  // at the ends there are poses on one side only
    ++compared;
    REQUIRE(smoothed.size() == 2);
    CHECK(std::hypot(exact[1].x_m - smoothed[1].x_m, exact[1].y_m - smoothed[1].y_m) < 0.02);
    CHECK(std::hypot(exact[0].x_m - smoothed[0].x_m, exact[0].y_m - smoothed[0].y_m) <
          0.15);  // error of the localisation
    CHECK(std::fabs(exact[1].speed_mps - smoothed[1].speed_mps) < 0.3);
    CHECK(std::fabs(wrap_angle(exact[1].heading_rad - smoothed[1].heading_rad)) < 0.01);
  }
  CHECK(frames >= 15);
  CHECK(compared >= 10);

  CHECK(OdometryLog(log, truth.rig(), log).map_text() == truth.map_text());
  const std::string bound = folder.path("bound.csv");
  io::write_whole_file(bound, "0,0\n1,0\n2,0\n3,0\n");
  CHECK_THROWS_WITH_AS(OdometryLog(log, truth.rig(), bound + "," + bound), doctest::Contains("two bounds"), io::Error);

  io::write_whole_file(folder.path("map.csv"), truth.map_text());
  io::write_whole_file(rig_file, io::format_rig(truth.rig()));
  RunOptions options;
  options.logs = {log}, options.presets = {"paper"}, options.out = folder.path("out"), options.quiet = true;
  options.rig = rig_file, options.map = folder.path("map.csv"), options.every = 5;
  REQUIRE(run_logs(options));
  const std::vector<Figures> figures = make_figures(read_runs(options.out));
  REQUIRE(figures.size() == 1);
  CHECK(figures[0].ground.tpr.empty());  // unknown
  CHECK(figures[0].ground_auto.tpr.size() >= 6);
  CHECK(metrics::summarize(figures[0].ground_auto.f1).mean > 0.7);
  CHECK(figures[0].tracks.mot.objects > 5);
  for (const char* unknown : {"points", "clusters"}) {
    const Table cars = read_runs(options.out)[0].tables.at("cars");
    REQUIRE(cars.rows() > 0);
    for (std::size_t r = 0; r < cars.rows(); ++r) CHECK(std::isnan(cars.at(r, cars.column(unknown))));
  }

  // The report of a recording names its origin, shows what the paper's rule can measure, and claims no missing truth.
  write_report(options.out, false);
  const nlohmann::json json = nlohmann::json::parse(io::read_whole_file(options.out + "/metrics.json"));
  CHECK(json["simulated"] == false);
  CHECK(json["figures"][0]["clustering"]["clusters_per_car"]["mean"].is_null());
  CHECK(json["figures"][0]["clustering"]["clusters_in_box_per_car"]["count"] > 0);
  CHECK(json["figures"][0]["euclidean"][0]["clusters_per_car"]["mean"].is_null());
  CHECK(json["figures"][0]["euclidean"][0]["clusters_in_box_per_car"]["count"] > 0);
  std::set<std::string> unmeasured;
  for (const auto& claim : json["judgements"][0]["claims"])
    if (claim["verdict"] == "not measured") unmeasured.insert(claim["name"]);
  for (const char* name : {"clusters_by_truth", "ground_tpr_higher_by_truth", "mounting"})
    CHECK_MESSAGE(unmeasured.count(name) == 1, name);
  CHECK(unmeasured.count("ground_tpr_higher_by_labels") == 0);
  const std::string html = io::read_whole_file(options.out + "/report.html");
  for (const char* said :
       {"class=\"recorded\"", "The recorded race from above", "Recorded: race", ">not measured",
        "no log says what each point lies on", "(c) Clusters in a car", "confirmed track (recorded)"})
    CHECK_MESSAGE(html.find(said) != std::string::npos, said);
  for (const char* untrue :
       {"class=\"simulated\"", "No number here", "The simulated race", "Simulated:", "figures (simulated)", "no data",
        "against the truth: TPR", "(a) Clusters per car", "10 to 25 m away"})
    CHECK_MESSAGE(html.find(untrue) == std::string::npos, untrue);

  // Together with a simulated log, the report names both origins.
  RunOptions simulated;
  simulated.logs = {log}, simulated.presets = {"paper"}, simulated.out = folder.path("simulated");
  simulated.quiet = true, simulated.most_frames = 2;
  REQUIRE(run_logs(simulated));
  std::filesystem::rename(simulated.out + "/runs/paper/race", options.out + "/runs/paper/other");
  write_report(options.out, false);
  CHECK(nlohmann::json::parse(io::read_whole_file(options.out + "/metrics.json"))["simulated"] == "some");
  CHECK(io::read_whole_file(options.out + "/report.html").find(">simulated and recorded<") != std::string::npos);

  options.presets = {"paper:ground"};
  CHECK_THROWS_WITH_AS(run_logs(options), doctest::Contains("does not say what each point lies on"), io::Error);
}

namespace {

// A car that stands for 2 s and then drives a circle of 200 m at 20 m/s, as a file of a recorded drive; `change` makes
// a row of time, x, y, vx, vy, phi, omega wrong.
std::string drive_text(const std::function<void(double (&row)[7])>& change) {
  std::string text = "time(s),x(m),y(m),vx(m/s),vy(m/s),phi(rad),omega(rad/s)\n";
  for (int32_t k = 0; k < 500; ++k) {
    const double speed = k < 50 ? 0 : 20, turned = 20 * 0.04 * std::max(0, k - 50) / 200;
    double row[7] = {100 + 0.04 * k, 200 * std::sin(turned), 200 - 200 * std::cos(turned), speed, 0, turned,
                     speed / 200};
    change(row);
    for (int32_t i = 0; i < 7; ++i) text += (i > 0 ? "," : "") + std::to_string(row[i]);
    text += "\n";
  }
  return text;
}

}  // namespace

TEST_CASE("recordings: a drive's errors are those of speed, course, yaw rate and place while the car drives") {
  const TempFolder folder;
  const auto errors = [&](const std::function<void(double(&row)[7])>& change) {
    return evaluate_drive(folder.write("drive.csv", drive_text(change)), "none", options_of("paper", {}));
  };
  const nlohmann::json as_driven = errors([](double(&)[7]) {});
  CHECK(as_driven["followed"].get<double>() > 0.99);
  CHECK(as_driven["tracks"] == 1);
  CHECK(as_driven["place_rmse_m"].get<double>() < 0.9);  // contains the jump of the speed
  const double speed = as_driven["speed_rmse_mps"], course = as_driven["course_rmse_deg"];
  CHECK(as_driven["course_with_slip_rmse_deg"] == Approx(course));
  // The tracker sees the places only, so a wrong truth shows as it is.
  const nlohmann::json faster = errors([](double(&row)[7]) { row[3] += row[3] > 0 ? 50 : 2.9; });
  CHECK(faster["speed_rmse_mps"].get<double>() == Approx(std::hypot(50, speed)).epsilon(0.1));
  CHECK(faster["course_rmse_deg"] == Approx(course));
  const nlohmann::json turned = errors([](double(&row)[7]) { row[5] += 1; });
  CHECK(turned["course_rmse_deg"].get<double>() == Approx(180 / M_PI).epsilon(0.1));
  CHECK(turned["course_with_slip_rmse_deg"] == Approx(turned["course_rmse_deg"].get<double>()));
  const nlohmann::json slips = errors([](double(&row)[7]) { row[5] += 1, row[4] = -std::tan(1.0) * row[3]; });
  CHECK(slips["course_with_slip_rmse_deg"].get<double>() == Approx(course).epsilon(1e-3));
  const nlohmann::json spins = errors([](double(&row)[7]) { row[6] += 3; });
  CHECK(spins["yaw_rate_rmse_rps"].get<double>() == Approx(3).epsilon(0.05));
}

TEST_CASE("recordings: sequences together count each object once, ids by seed") {
  const nlohmann::json all =
      sum_tracks({{"a", {{"objects", 100}, {"misses", 10}, {"false_positives", 4}, {"switches", 2}, {"fragments", 8}}},
                  {"b", {{"objects", 300}, {"misses", 0}, {"false_positives", 0}, {"switches", 4}, {"fragments", 0}}}});
  CHECK(all == nlohmann::json{{"mota", 0.95}, {"switches", 1.5}, {"fragments", 2.0}});
}

TEST_CASE("recordings: all scans of a data set count together; boxes without a stamp are refused") {
  const TempFolder folder;
  // Points at `x_m`, a box of a car around them.
  const auto write = [&](const std::string& name, double x_m) {
    std::string points;
    for (int32_t i = 0; i < 40; ++i)
      points += std::to_string(x_m + 0.1 * (i % 10)) + " 0 " + std::to_string(0.2 * (i / 10) - 1) + " 1 " +
                std::to_string(i / 10) + "\n";
    folder.write("data/nuscenes/" + name + ".pcd",
                 "VERSION 0.7\nFIELDS x y z intensity ring\nSIZE 4 4 4 4 2\nTYPE F F F F U\nCOUNT 1 1 1 1 1\nWIDTH 40\n"
                 "HEIGHT 1\nVIEWPOINT 0 0 0 1 0 0 0\nPOINTS 40\nDATA ascii\n" +
                     points);
    folder.write("data/nuscenes/" + name + "_boxes.csv",
                 "category,x_m,y_m,z_m,length_m,width_m,height_m,yaw_rad,points\ncar," + std::to_string(x_m) +
                     ",0,0,4.5,1.9,1.5,0,40\n");
  };
  write("2", 10), write("1", 30);
  const auto evaluate = [&] {
    return evaluate_recordings(folder.path("data"), {"paper"}, {}, folder.path("out"), false)["nuscenes_sweep"];
  };
  const nlohmann::json both = evaluate();
  CHECK(both["summary"]["cars_to_60_m"] == 2);
  REQUIRE(both["by_range"].size() == 2);
  for (const auto& range : both["by_range"]) CHECK(range["boxes"] == 1);
  std::filesystem::remove(folder.path("data/nuscenes/2.pcd"));
  CHECK(evaluate()["summary"]["cars_to_60_m"] == 1);

  const std::string boxes = folder.write("data/av2/log_boxes.csv",
                                         "category,x_m,y_m,z_m,length_m,width_m,yaw_rad,points\nBUS,9,0,0,4,2,0,9\n");
  folder.write("data/av2/log_17.pcd", "");
  CHECK(error_of(evaluate).starts_with(boxes));
}

TEST_CASE("recorded: the opponent is found in the racecar frames, and the tracker follows real traffic") {
  OVT_NEED_RECORDED("racecar");
  OVT_NEED_RECORDED("kitti/tracking");
  const TempFolder folder;
  const std::map<std::string, std::string> configs = {
      {"sparse", folder.write("sparse.toml", "map = \"none.csv\"\n[gate]\nmin_points = 40\n")}};
  const nlohmann::json json =
      evaluate_recordings(recorded(""), {"paper", "sparse"}, configs, folder.path("out"), false);
  CHECK(std::filesystem::exists(folder.path("out") + "/recordings.json"));
  REQUIRE(json["racecar"]["frames"].size() == 4);
  for (const auto& frame : json["racecar"]["frames"]) {
    CHECK(frame["detections_within_4_m"] == 1);
    CHECK(frame["of_them_outside_the_box"] == 0);
    if (frame["frame"] == 3) continue;  // its box is 2.2 m too far ahead
    CHECK(frame["clusters_in_box"] == 1);
    CHECK(std::fabs(frame["off_along_m"].get<double>()) < 1);
    CHECK(std::fabs(frame["off_across_m"].get<double>()) < 0.6);
    CHECK(frame["ground_by_auto_label"]["pipeline"]["f1"].get<double>() > 0.85);
  }
  for (const auto& [sequence, tracks] : json["kitti_tracks"].items()) {
    const std::string name = sequence;  // clang 14 cannot capture a structured binding
    CAPTURE(name);
    CHECK(tracks["mota"].get<double>() > 0.7);
    CHECK(tracks["hota"].get<double>() > 0.6);
  }
  const nlohmann::json &paper = json["racecar"]["summary"], &sparse = json["others"][0]["racecar"]["summary"];
  CHECK(paper["opponent_as_one_detection"] == 1);
  CHECK(paper["ground_f1_by_auto_label"].get<double>() > 0.85);
  // Fewer detections of few points: fewer on the road, and the opponent in the frames where it has 40 points.
  CHECK(sparse["other_detections_on_the_road"].get<double>() < paper["other_detections_on_the_road"].get<double>());
  CHECK(sparse["opponent_as_one_detection"].get<double>() > 0);
  CHECK(json["others"][0]["preset"] == "sparse");
  const Rows rows = recording_rows(json);
  CHECK(rows[0] == std::vector<std::string>{"recorded", "paper", "sparse"});
  std::set<std::string> sets;
  for (std::size_t r = 1; r < rows.size(); ++r) sets.insert(rows[r][0].substr(0, rows[r][0].find(':')));
  CHECK(sets.count("RACECAR") == 1);
  CHECK(sets.count("KITTI") == 1);
  CHECK(sets.count("KITTI, label centres") == 1);
  CHECK(sets.count("AV-21 drive (LVMS)") == std::filesystem::exists(recorded("lvms/LVMS_23_01_04_B.csv")));
  const nlohmann::json& kitti = json["kitti_frames"]["summary"];
  CHECK(kitti["cars_to_60_m"] == 12);  // one in each frame: the boxes lie where the points are
  CHECK(kitti["cars_detected"].get<double>() > 0.9);
  CHECK(kitti["centre_error_median_m"].get<double>() < 1);
  CHECK_THROWS_AS(evaluate_recordings(folder.path("nothing"), {"paper"}, {}, folder.path("out"), false), io::Error);
}
