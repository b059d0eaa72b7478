// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// The quality figures of runs made by hand: every expected number is counted in the rows. Configurations beside
// presets.
#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "tests/support/simulated_race.h"
#include "tests/support/temp_folder.h"
#include "tools/evaluation/detection_columns.h"
#include "tools/evaluation/figures.h"
#include "tools/evaluation/quality.h"
#include "tools/evaluation/racecar_wall.h"
#include "tools/evaluation/recorded.h"
#include "tools/evaluation/report.h"
#include "tools/evaluation/run_logs.h"
#include "tools/evaluation/simulated_log.h"
#include "tools/evaluation/variant.h"
#include "tools/io/angles.h"
#include "tools/io/error.h"
#include "tools/io/mcap_reader.h"
#include "tools/io/mcap_writer.h"
#include "tools/io/text.h"
#include "tools/sim/material.h"

using namespace overtake;
using namespace overtake::evaluation;
using doctest::Approx;

namespace {

void add_car(Run& run, double frame, double car, double ahead_m, double points, double clusters, double detections) {
  run.tables["cars"].add({frame, 0.05 * frame, car, ahead_m, 0, 0, 0, points, clusters, 1, detections, 0, 0});
}

// A car at 45 m in frames 0 to 9: 2, 3 or 4 points in frames 0 to 2 (only the one of 4 is found), 20 from then on
// (found but in frame 3). A second one at -95 m in frames 0 to 3 with 4 points, never found. No car in frames 10 to 14.
Run quality_run() {
  Run run{"paper", "log", {{"scenario", "hand"}, {"period_s", "0.05"}}, make_tables()};
  for (int32_t k = 0; k < 15; ++k) run.tables["clusters"].add({double(k), 7, k == 5 ? 2.0 : 0.0, k == 6 ? 1.0 : 0.0});
  for (int32_t k = 0; k < 10; ++k) add_car(run, k, 1, 45, k < 3 ? 2 + k : 20, k < 5 ? 1 : 2, k == 2 || k > 3 ? 1 : 0);
  for (int32_t k = 0; k < 4; ++k) add_car(run, k, 2, -95, 4, 0, 0);
  return run;
}

Quality quality_of_run(const Run& run) {
  const std::vector<Quality> all = find_quality({run});
  REQUIRE(all.size() == 1);
  return all[0];
}

}  // namespace

TEST_CASE("quality: the detected share counts cars with enough points, over all and by 20 m") {
  const Quality q = quality_of_run(quality_run());
  CHECK(q.frames == 15);
  CHECK(q.near.all == 14);
  CHECK(q.near.seen == std::array<int64_t, 2>{13, 7});     // 3 points and more: 9 + 4; 5 and more: 7
  CHECK(q.near.detected == std::array<int64_t, 2>{7, 6});  // frames 2, 4 .. 9
  CHECK(q.near.detected_share(0) == Approx(7.0 / 13));
  CHECK(q.near.detected_share(1) == Approx(6.0 / 7));
  CHECK(q.near.bound(0) == Approx(13.0 / 14));
  CHECK(q.detected.hits == 7);
  CHECK(q.detected.trials == 13);
  REQUIRE(q.by_distance.size() == 13);  // -100 to +150 m
  CHECK(q.by_distance[0].seen[0] == 4);
  CHECK(q.by_distance[0].detected_share(0) == 0);
  CHECK(q.by_distance[7].all == 10);  // 40 to 60 m
  CHECK(q.by_distance[7].detected_share(0) == Approx(7.0 / 9));
  CHECK(std::isnan(q.by_distance[1].detected_share(0)));

  Run far = quality_run();
  add_car(far, 0, 3, 150, 50, 1, 1);
  add_car(far, 0, 4, -100.5, 50, 1, 1);
  CHECK(quality_of_run(far).near.all == 14);  // outside of the distances
}

TEST_CASE("quality: first lap and later laps divide at the length of the map") {
  Run run = quality_run();
  for (int32_t k = 0; k < 15; ++k) run.tables["ego"].add({double(k), 0.05 * k, 40, 0});  // 2 m a frame
  run.about["lap_m"] = "9.5";                                                            // driven in frame 5
  const Quality q = quality_of_run(run);
  CHECK(q.first_lap.all == 9);  // frames 0 to 4 and the second car's
  CHECK(q.first_lap.detected[0] == 2);
  CHECK(q.later_laps.all == 5);
  CHECK(q.later_laps.detected[0] == 5);
  run.about.erase("lap_m");
  CHECK(quality_of_run(run).later_laps.all == 0);
}

TEST_CASE("quality: false detections by distance, surface, banking and place") {
  Run run = quality_run();
  const auto add = [&](double frame, double ahead_m, double range_m, sim::Surface surface, double lap_m, double bank) {
    run.tables["false_detections"].add({frame, ahead_m, 0, range_m, 5, double(surface), lap_m, 0, bank});
  };
  add(1, 30, 30, sim::Surface::road, 250, 20);
  add(1, 120, 120, sim::Surface::road, 399, -20);
  add(12, -120, 120, sim::Surface::outer_wall, NAN, 2);  // without a car in its frame, and beyond -100 m
  run.tables["false_detections"].add({13, 5, 0, 5, 5, -1, NAN, NAN, NAN});
  const Quality q = quality_of_run(run);
  CHECK(q.false_detections == Approx(3.0 / 15));
  CHECK(q.false_anywhere == Approx(4.0 / 15));
  CHECK(q.by_surface.at("road") == Approx(2.0 / 15));
  CHECK(q.by_surface.at("outer_wall") == Approx(1.0 / 15));
  CHECK(q.by_surface.at("unknown") == Approx(1.0 / 15));
  CHECK(q.by_range.at("0 to 20 m") == Approx(1.0 / 15));
  CHECK(q.by_range.at("20 to 50 m") == Approx(1.0 / 15));
  CHECK(q.by_range.at("100 to 150 m") == Approx(2.0 / 15));
  CHECK(q.by_bank.at("from 16 deg") == Approx(2.0 / 15));
  CHECK(q.by_bank.at("0 to 3 deg") == Approx(1.0 / 15));
  CHECK(q.by_lap.size() == 1);
  CHECK(q.by_lap.at("200 to 400 m") == Approx(2.0 / 15));
  CHECK(q.frames_without_car == 5);
  CHECK(q.false_without_car == Approx(1.0 / 5));  // that of frame 12 is too far away
}

TEST_CASE("quality: clusters, ground, centre errors and ellipses") {
  Run run = quality_run();
  for (const double ppv : {0.5, 0.9, 1.0}) run.tables["scans"].add({0, 0, 90 * ppv, 90 * (1 - ppv), 10, 100, 0});
  run.tables["scans"].add({1, 0, 0, 0, 0, 100, 0});  // nothing to find, nothing found
  const double errors[][3] = {{-1, 0.1, 1}, {2, -0.2, 5.9}, {0.5, 0.3, 6.1}, {0, 0.4, NAN}};
  for (const auto& [along, across, square] : errors) run.tables["centres"].add({1, 1, along, across, square});
  run.tables["debris"].add({1, 2, 1});
  run.tables["debris"].add({2, 3, 0});
  run.tables["debris"].add({3, 9, 2});
  run.tables["ego_heading"].add({0, io::rad(0.3), io::rad(0.1)});
  run.tables["ego_heading"].add({1, io::rad(-0.4), io::rad(-0.1)});
  const Quality q = quality_of_run(run);
  CHECK(q.heading_rms_deg[0] == Approx(std::sqrt(0.125)));
  CHECK(q.heading_rms_deg[1] == Approx(0.1));
  CHECK(q.cars_judged == 7);                      // frames 3 to 9 of the first car
  CHECK(q.clusters_per_car == Approx(12.0 / 7));  // 2 frames with one, 5 with two
  CHECK(q.mixed_per_car == Approx(3.0 / 7));      // 2 in frame 5, one in frame 6
  CHECK(q.ppv == Approx(0.8));
  CHECK(q.ppv_p5 == Approx(0.54));  // a tenth of the way from 0.5 to 0.9
  CHECK(q.tpr == Approx((45.0 / 55 + 81.0 / 91 + 0.9) / 3));
  CHECK(q.along_m.median == Approx(0.75));
  CHECK(q.along_m.p95 == Approx(1.85));
  CHECK(q.across_m.median == Approx(0.25));
  CHECK(q.in_ellipse.trials == 3);
  CHECK(q.in_ellipse.hits == 2);  // chi-square 5.99
  CHECK(q.without_cluster == 0);
  add_car(run, 7, 3, 20, 30, 0, 0);  // without a cluster: not a mean of fewer clusters
  CHECK(quality_of_run(run).clusters_per_car == Approx(12.0 / 7));
  CHECK(quality_of_run(run).without_cluster == Approx(1.0 / 8));
  const Figures f = make_figures({run})[0];
  CHECK(metrics::summarize(f.clusters_per_car).mean == Approx(12.0 / 7));
  CHECK(f.with_cluster.hits == 7);
  CHECK(f.with_cluster.trials == 8);
  CHECK(q.debris_frames == 2);
  CHECK(q.debris_found == Approx(0.5));
}

TEST_CASE("quality: several scenarios are also pooled, and the tables have a column for each variant") {
  Run other = quality_run(), best = quality_run(), sweep = quality_run();
  other.about["scenario"] = "other", other.tables["cars"] = make_tables()["cars"];
  add_car(other, 0, 1, 45, 20, 1, 1);
  best.variant = "best", sweep.variant = "paper@x=1";
  const std::vector<Quality> all = find_quality({quality_run(), other, best, sweep});
  REQUIRE(all.size() == 5);  // best, paper on each and both, the sweep
  CHECK(main_scenario(all) == "all");
  const std::vector<Quality> both = quality_of(all, "all");
  REQUIRE(both.size() == 1);
  CHECK(both[0].near.seen[0] == 14);
  CHECK(both[0].near.detected[0] == 8);
  CHECK(both[0].frames == 30);
  const Rows rows = quality_rows(quality_of(all, "hand"));
  CHECK(rows[0] == std::vector<std::string>{"scenario: hand", "best", "paper"});
  CHECK(rows[1] == std::vector<std::string>{"frames", "15", "15"});
  CHECK(rows[2][1] == "0.538");
  for (const auto& row : rows) CHECK(row[0].find("ellipse") == std::string::npos);  // no value: no row
  const Rows scenarios = scenario_rows(all);
  REQUIRE(scenarios.size() == 3);
  CHECK(scenarios[1] == std::vector<std::string>{"hand", "0.538; 0.000", "0.538; 0.000"});
  CHECK(scenarios[2] == std::vector<std::string>{"other", "-", "1.000; 0.000"});
  const nlohmann::json json = json_of(both[0]);
  CHECK(json["detected_of_3_points"] == Approx(8.0 / 14));
  CHECK(json["by_distance"][7]["from_m"] == 40);
}

TEST_CASE("columns that a method leaves out: the height of the road, the class, the covariance in the vehicle frame") {
  const float z[] = {0.5f}, road[] = {-0.25f}, var_x[] = {4}, var_y[] = {0.25f}, none[] = {0};
  const int32_t debris[] = {2}, car[] = {1};
  ovt_frame_info info{};
  info.ego_heading_offset_rad = -0.125;
  io::EgoRow pose;
  pose.yaw_rad = 0.5;
  CHECK(corrected(pose, info).yaw_rad == 0.375);
  CHECK(corrected(pose, ovt_frame_info{}).yaw_rad == 0.5);
  ovt_detections d{};
  CHECK(corrected(pose, info, d, 1).yaw_rad == 0.375);
  const float offsets[2] = {0.25f, -0.5f};
  d.ego_offset_rad = offsets;
  CHECK(corrected(pose, info, d, 1).yaw_rad == 0.0);
  d.z_m = z;
  const io::Rotation level = io::axes_of(0, 0, M_PI / 2), banked = io::axes_of(M_PI / 3, 0, 0);
  CHECK(height_of(d, 0) == 0.5);
  CHECK(!is_debris(d, 0));
  const int32_t parked = int32_t(sim::Surface::parked_vehicle), thing = int32_t(sim::Surface::debris);
  CHECK(is_on_obstacle(d, 0, parked));
  CHECK(!is_on_obstacle(d, 0, thing));
  CHECK(std::isnan(square_of(d, 0, level, 1, 1)));
  d.road_z_m = road, d.object_class = debris;
  d.var_x = var_x, d.var_y = var_y, d.cov_xy = none;
  CHECK(height_of(d, 0) == -0.25);
  CHECK(is_debris(d, 0));
  CHECK(!is_on_obstacle(d, 0, parked));
  d.object_class = car;
  CHECK(!is_debris(d, 0));
  CHECK(is_on_obstacle(d, 0, parked));
  CHECK(!is_on_obstacle(d, 0, thing));
  const int32_t unknown[] = {OVT_CLASS_UNKNOWN};
  d.object_class = unknown;
  CHECK(is_on_obstacle(d, 0, parked));
  CHECK(is_on_obstacle(d, 0, thing));
  for (const int32_t surface : {int32_t(sim::Surface::road), int32_t(sim::Surface::outer_wall), -1})
    CHECK(!is_on_obstacle(d, 0, surface));
  d.object_class = car;
  CHECK(square_of(d, 0, level, 0, 2) == Approx(1));     // 2 m along: one standard deviation
  CHECK(square_of(d, 0, level, -1, 0) == Approx(4));    // 1 m to the left: two
  CHECK(square_of(d, 0, banked, 0, 0.5) == Approx(4));  // on a bank of 60 deg 0.5 m of the map are 1 m of the vehicle's

  // In the map: by the corrected pose, at the height of the road. The ego looks along y and leans by 30 deg.
  pose.x_m = 100, pose.y_m = 200, pose.roll_rad = M_PI / 6, pose.yaw_rad = M_PI / 2 - 0.25;
  const float x[] = {10}, y[] = {0}, turn[] = {0};
  const int64_t stamp[] = {7};
  d.x_m = x, d.y_m = y, d.heading_rad = turn, d.stamp_ns = stamp;
  const MapPlace at = place_in_map({{pose, 0}}, info, d, 0);
  CHECK(at.x_m == Approx(100 - 0.25 * std::sin(M_PI / 6)));
  CHECK(at.y_m == Approx(210));
  CHECK(at.heading_rad == Approx(M_PI / 2));
}

TEST_CASE("recorded: the wall of the racecar frames bounds the road, and the own body is not on it") {
  CHECK(behind_racecar_wall(0, -9.52) == Approx(0).epsilon(0.01));  // between (-5, -9.6) and (20, -9.2)
  CHECK(behind_racecar_wall(20, -11.2) == Approx(2).epsilon(0.01));
  CHECK(behind_racecar_wall(111, 0) == -100);
  CHECK(is_on_racecar_road(20, 0));
  CHECK(!is_on_racecar_road(20, -9));  // 0.2 m inside of the wall
  CHECK(!is_on_racecar_road(20, 8));
  CHECK(!is_on_racecar_road(2, 0.5));
  CHECK(is_on_racecar_road(-90, 3));
  CHECK(!is_on_racecar_road(-110, 8));
}

TEST_CASE("recordings: evaluated are the presets, or that of a variant, never another one") {
  using Names = std::vector<std::string>;
  CHECK(names_for_recordings({}) == Names{"paper"});
  CHECK(names_for_recordings({"best:no_map", "best", "strict"}) == Names{"best", "strict"});
  CHECK(names_for_recordings({"best:no_map", "paper:ego"}) == Names{"best"});
}

TEST_CASE("recordings: the table has a column for each preset, a row for each figure that one of them has") {
  const nlohmann::json json = {
      {"preset", "a"},
      {"racecar", {{"summary", {{"frames", 4}, {"opponent_as_one_detection", 0.75}}}}},
      {"others", {{{"preset", "b"}, {"av2_sweep", {{"summary", {{"cars_to_60_m", 7}, {"cars_detected", nullptr}}}}}}}}};
  CHECK(recording_rows(json) == Rows{{"recorded", "a", "b"},
                                     {"RACECAR: frames", "4", "-"},
                                     {"RACECAR: opponent as exactly one detection", "0.750", "-"},
                                     {"Argoverse 2: labelled cars to 60 m", "-", "7"}});
}

namespace {

// A copy of a log that says it is without the map and the ego poses, and is.
void strip(const std::string& from, const std::string& to) {
  io::McapReader reader(from);
  io::McapWriter writer(to);
  std::map<uint16_t, uint16_t> channels;
  io::McapMessage message;
  for (bool begun = false; reader.next(message); begun = true) {
    if (!begun) {
      auto about = reader.metadata().at("overtake");
      about["without"] = "map poses";
      writer.add_metadata("overtake", about);
      for (const io::McapAttachment& a : reader.attachments())
        if (a.name == "rig.toml") writer.add_attachment(a.name, a.media_type, a.data);
    }
    const io::McapChannel& channel = reader.channels().at(message.channel_id);
    if (channel.topic == "/ego/odometry") continue;
    const io::McapSchema& schema = reader.schemas().at(channel.schema_id);
    if (channels.count(message.channel_id) == 0)
      channels[message.channel_id] = writer.add_channel(writer.add_schema(schema.name, schema.encoding, schema.data),
                                                        channel.topic, channel.message_encoding);
    writer.write(channels[message.channel_id], message.log_ns, message.data, message.publish_ns);
  }
  writer.close();
}

void simulate(const std::string& path) { test::write_race(sim::load_scenario("overtake"), 1, 0.4, path); }

// Simulates a race into the folder; options to evaluate it quickly.
RunOptions options_for_race(const TempFolder& folder) {
  RunOptions options;
  options.logs = {folder.path("race.mcap")};
  options.quiet = options.only_figures = true;
  simulate(options.logs[0]);
  return options;
}

}  // namespace

TEST_CASE(
    "configurations: named by their files, run beside presets; parameters take effect, and the log keeps its map") {
  const TempFolder folder;
  RunOptions options = options_for_race(folder);
  options.presets = {"paper", "strict:no_map"};
  options.configs = {
      folder.write("strict.toml",
                   "preset = \"paper\"\nmap = \"none.csv\"\nego = \"none.csv\"\n[gate]\nmin_points = 6\n"),
      folder.write("same.toml", "preset = \"paper\"\n")};
  options.out = folder.path("out");
  REQUIRE(run_logs(options));
  std::map<std::string, Run> runs;
  for (Run& run : read_runs(options.out)) runs[run.variant] = std::move(run);
  REQUIRE(runs.size() == 4);
  const auto detections = [&](const char* name) { return runs.at(name).tables.at("detections").rows(); };
  CHECK(detections("paper") > 10);
  CHECK(runs.at("same").tables.at("detections").cells.size() == runs.at("paper").tables.at("detections").cells.size());
  CHECK(detections("strict") < detections("paper"));
  CHECK(detections("strict") > 0);
  CHECK(detections("strict:no_map") > detections("strict"));  // the walls are not left out
  CHECK(runs.at("strict").about.at("config") == "preset = paper\ngate.min_points = 6");
  CHECK(runs.at("same").about.at("config") == "preset = paper");
  CHECK(runs.at("paper").about.at("config") == "");

  // Changed contents of a file of the same name: run again.
  folder.write("strict.toml", "preset = \"paper\"\n[gate]\nmin_points = 5\n");
  REQUIRE(run_logs(options));
  for (Run& run : read_runs(options.out)) runs[run.variant] = std::move(run);
  CHECK(runs.at("strict").about.at("config") == "preset = paper\ngate.min_points = 5");
  folder.write("strict.toml", "preset = \"paper\"\n[gate]\nmin_points = 5\n[capacities]\nclusters = 16\n");
  REQUIRE(run_logs(options));
  const int64_t before = detections("strict");
  for (Run& run : read_runs(options.out)) runs[run.variant] = std::move(run);
  CHECK(runs.at("strict").about.at("config").find("clusters = 16") != std::string::npos);
  CHECK(detections("strict") < before);

  const auto error = [&](const std::vector<std::string>& files) { return error_of([&] { read_configs(files); }); };
  CHECK(error({"a/x.toml", "b/x.toml"}) == "--config b/x.toml: two configurations have the name 'x'");
  CHECK(error({"a/paper.toml"}) == "--config a/paper.toml: has the name of a preset");
  CHECK(error({"a:b.toml"}).find("without :") != std::string::npos);
  options.presets = {"paper"};
  options.configs = {folder.write("bad.toml", "[gate]\nnonsense = 1\n")};
  CHECK(error_of([&] { run_logs(options); }).find("bad.toml:2") != std::string::npos);
}

TEST_CASE("drop-out of the poses: detections of these frames are compared by the true pose") {
  const TempFolder folder;
  sim::Scenario scenario = sim::load_scenario("overtake");
  scenario.localisation.drop_outs = {{0, 0.3}};
  test::write_race(scenario, 1, 0.6, folder.path("race.mcap"));
  RunOptions options;
  options.logs = {folder.path("race.mcap")}, options.presets = {"paper"}, options.out = folder.path("out");
  options.quiet = options.only_figures = true;
  REQUIRE(run_logs(options));
  const std::vector<Run> runs = read_runs(options.out);
  REQUIRE(runs.size() == 1);
  std::set<double> with_pose;
  const Table &headings = runs[0].tables.at("ego_heading"), &centres = runs[0].tables.at("centres");
  for (std::size_t r = 0; r < headings.rows(); ++r) with_pose.insert(headings.at(r, 0));
  CHECK(with_pose.size() >= 2);
  CHECK(with_pose.count(2) == 0);
  int32_t found = 0;
  for (std::size_t r = 0; r < centres.rows(); ++r) found += with_pose.count(centres.at(r, 0)) == 0;
  CHECK(found > 2);
}

TEST_CASE("truth of a simulated log: beyond its last frame course and speed go on with their rates") {
  const TempFolder folder;
  test::write_race(sim::load_scenario("spin_near"), 1, 0.4, folder.path("race.mcap"));  // in a turn
  SimulatedLog log(folder.path("race.mcap"));
  LogFrame frame;
  int64_t end_ns = 0;
  while (log.next(frame)) end_ns = frame.scans.scans[0].stamp_ns;
  while (!log.cars_at(end_ns).empty()) end_ns += 1'000'000;
  end_ns -= 101'000'000;  // the truth is held for 0.1 s
  const auto rates = [&](int64_t middle_ns) {
    const std::vector<CarTruth> before = log.cars_at(middle_ns - 10'000'000),
                                after = log.cars_at(middle_ns + 10'000'000);
    return std::pair(mean_course_rate(1, before, after, 0.02), mean_acceleration(1, before, after, 0.02));
  };
  const auto inside = rates(end_ns - 12'000'000), beyond = rates(end_ns + 50'000'000);
  CHECK(std::fabs(inside.first) > 0.05);
  CHECK(beyond.first == Approx(inside.first).epsilon(0.01));
  CHECK(beyond.second == Approx(inside.second).epsilon(0.01));
}

TEST_CASE("variants: a method that judges ground by its height has no oracle of the ground") {
  CHECK(variants_of("paper") == variant_names());
  const std::vector<std::string> of_best = variants_of("best");
  CHECK(of_best.size() == variant_names().size() - 1);
  CHECK(std::count(of_best.begin(), of_best.end(), "ground") == 0);
  CHECK(error_of([] { check_variant("best:ground"); }).find("has no oracle of the ground") != std::string::npos);
  CHECK(error_of([] { check_variant("best:relay"); }).empty());
  CHECK(error_of([] { check_variant("paper:ground"); }).empty());
}

TEST_CASE(
    "comparing every N-th frame: its rows are those of all frames; seconds count all; without poses cars are found") {
  const TempFolder folder;
  RunOptions options = options_for_race(folder);
  options.presets = {"paper", "paper:ego", "paper:no_poses"};
  options.out = folder.path("all");
  REQUIRE(run_logs(options));
  options.out = folder.path("some"), options.compare_every = 3;
  REQUIRE(run_logs(options));
  const auto run_of = [&](const char* out, const char* variant) {
    for (Run& run : read_runs(folder.path(out)))
      if (run.variant == variant) return std::move(run);
    throw std::runtime_error("no such run");
  };
  const Run all = run_of("all", "paper"), some = run_of("some", "paper");
  REQUIRE(all.tables.at("clusters").rows() >= 7);
  CHECK(some.tables.at("clusters").rows() == (all.tables.at("clusters").rows() + 2) / 3);
  CHECK(some.about.at("frames") == all.about.at("frames"));
  for (const char* name : {"scans", "cars", "detections", "centres", "tracks"}) {
    const Table &whole = all.tables.at(name), &part = some.tables.at(name);
    CAPTURE(name);
    CHECK(part.rows() > 0);
    std::vector<double> kept;
    for (std::size_t r = 0; r < whole.rows(); ++r)
      if (int64_t(whole.at(r, 0)) % 3 == 0)
        for (std::size_t c = 0; c < whole.columns.size(); ++c) kept.push_back(whole.at(r, c));
    REQUIRE(kept.size() == part.cells.size());
    for (std::size_t i = 0; i < kept.size(); ++i)
      CHECK((kept[i] == part.cells[i] || (std::isnan(kept[i]) && std::isnan(part.cells[i]))));
  }
  CHECK(make_figures({some})[0].seconds == Approx(0.05 * 3 * double(some.tables.at("clusters").rows())));
  CHECK(all.tables.at("times").rows() == 0);

  // The oracle of the ego pose is judged by the pose that it got: its errors in the vehicle's frame do not contain the
  // error of the localisation.
  const Run with_truth = run_of("all", "paper:ego");
  const Table &by_truth = with_truth.tables.at("centres"), &published = all.tables.at("centres");
  const auto mean_across = [](const Table& table) {
    double sum = 0;
    for (std::size_t r = 0; r < table.rows(); ++r) sum += table.at(r, table.column("across_m"));
    return sum / double(table.rows());
  };
  REQUIRE(by_truth.rows() > 2);
  CHECK(std::fabs(mean_across(by_truth) - mean_across(published)) > 0.001);
  const Run blind = run_of("all", "paper:no_poses");
  CHECK(blind.tables.at("centres").rows() > 2);
  // Its tracks are in the vehicle frame; the judge takes them to the map.
  const Table& tracks = blind.tables.at("tracks");
  int32_t at_car = 0;
  for (std::size_t r = 0; r < tracks.rows(); ++r) {
    at_car += tracks.at(r, tracks.column("car")) >= 0;
    CHECK(std::isnan(tracks.at(r, tracks.column("nees"))));
  }
  CHECK(at_car > 0);
  CHECK(blind.tables.at("paths").rows() == 0);
  CHECK(blind.tables.at("innovations").rows() == 0);

  // A log that holds neither map nor poses is evaluated as if both conditions were given.
  strip(folder.path("race.mcap"), folder.path("bare.mcap"));
  options.logs = {folder.path("bare.mcap")}, options.presets = {"paper"}, options.out = folder.path("bare");
  options.compare_every = 1;
  REQUIRE(run_logs(options));
  const Run bare = run_of("bare", "paper");
  CHECK(bare.about.count("lap_m") == 0);
  CHECK(bare.tables.at("centres").rows() > 2);
  CHECK(bare.tables.at("detections").rows() > all.tables.at("detections").rows());  // no map gate
  CHECK(bare.tables.at("scans").cells == all.tables.at("scans").cells);

  // With times and pictures: all but that of the race on its map.
  options.only_figures = false, options.most_frames = 3, options.out = folder.path("whole");
  REQUIRE(run_logs(options));
  CHECK(run_of("whole", "paper").tables.at("times").rows() > 0);
  const std::string pictures = options.out + "/runs/paper/bare/pictures/";
  CHECK(std::filesystem::exists(pictures + "sensors.svg"));
  CHECK_FALSE(std::filesystem::exists(pictures + "race.svg"));
  CHECK_NOTHROW(write_report(options.out, false));
}
