// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// The evaluation: numbers from hand-made runs, and a short simulated race with its negative controls.
#include <doctest/doctest.h>
#include <unistd.h>

#include <cmath>
#include <filesystem>
#include <set>

#include "tests/support/simulated_race.h"
#include "tools/evaluation/cluster_tally.h"
#include "tools/evaluation/figures.h"
#include "tools/evaluation/paper_claims.h"
#include "tools/evaluation/report.h"
#include "tools/evaluation/run_logs.h"
#include "tools/evaluation/svg_plot.h"
#include "tools/evaluation/variant.h"
#include "tools/io/error.h"
#include "tools/io/text.h"
#include "tools/view/svg.h"

using namespace overtake;
using namespace overtake::evaluation;
using doctest::Approx;

namespace {

std::string fresh_folder(const std::string& name) {
  const auto path = std::filesystem::temp_directory_path() / ("overtake_" + std::to_string(getpid()) + "_" + name);
  std::filesystem::remove_all(path);
  std::filesystem::create_directories(path);
  return path.string();
}

// Ten frames, one car that stays 45 m ahead: detected in the first 6, tracked in the last 4; a false detection and a
// false confirmed track 35 m behind in every second frame.
Run hand_made_run() {
  Run run{"paper", "log", {{"scenario", "hand"}, {"period_s", "0.05"}}, make_tables()};
  for (int32_t k = 0; k < 10; ++k) {
    const double frame = k, time = 0.05 * k;
    run.tables["clusters"].add({frame, 7, k == 3 ? 1.0 : 0.0, 0});
    run.tables["scans"].add({frame, 0, 80, 20, 20, 100, 0});
    run.tables["cars"].add({frame, time, 1, 45, 0, 45, 0, 20, 2, 1, k < 6 ? 1.0 : 0.0, 0, k >= 6 ? 1.0 : 0.0});
    if (k % 2 == 0) {
      run.tables["detections"].add({frame, -1, -35, 0, 9, 0, NAN, NAN, NAN, NAN, NAN});
      run.tables["tracks"].add(
          {frame, time, 99, 1, -1, -35, -35, 0, NAN, NAN, NAN, NAN, NAN, NAN, NAN, NAN, NAN, 0.05});
    }
    if (k >= 6)
      run.tables["tracks"].add({frame, time, 5, 1, 1, 45, 45.5, 0, 0.5, 0, 0.5, 0, 1, 0.1, 0.2, 0.3, 5, 0.05});
  }
  return run;
}

}  // namespace

TEST_CASE("table file: reading gives the written table, NaN included; an error names the line of a bad cell") {
  const std::string folder = fresh_folder("table");
  Table table({"a", "b"});
  table.add({1.25, NAN});
  table.add({-3, 1e300});
  write_table(folder + "/t.csv", table);
  const Table back = read_table(folder + "/t.csv");
  CHECK(back.columns == table.columns);
  REQUIRE(back.rows() == 2);
  CHECK(back.at(0, 0) == 1.25);
  CHECK(std::isnan(back.at(0, 1)));
  CHECK(back.at(1, back.column("b")) == 1e300);
  CHECK_THROWS_AS(table.add({1}), std::invalid_argument);
  io::write_whole_file(folder + "/bad.csv", "a,b\n1,2\n1,x\n");
  CHECK_THROWS_WITH_AS(read_table(folder + "/bad.csv"), doctest::Contains("bad.csv:3"), io::Error);
  io::write_whole_file(folder + "/cut.csv", "a,b\n1,2\n1,-0.");
  CHECK_THROWS_WITH_AS(read_table(folder + "/cut.csv"), doctest::Contains("cut.csv:3: the line has no end"), io::Error);
  io::write_whole_file(folder + "/header.csv", "a,b");
  CHECK_THROWS_WITH_AS(read_table(folder + "/header.csv"), doctest::Contains("header.csv:1: the line"), io::Error);
}

TEST_CASE("tables of a run: every file with every column is needed, the order of columns and further ones are not") {
  const std::string folder = fresh_folder("tables");
  write_tables(folder, make_tables());
  CHECK(read_tables(folder).size() == make_tables().size());
  for (const auto& [name, table] : make_tables()) {
    CAPTURE(name);
    const std::string path = folder + "/" + name + ".csv";
    std::filesystem::remove(path);
    CHECK_THROWS_WITH_AS(read_tables(folder), doctest::Contains((name + ".csv: no such file").c_str()), io::Error);
    std::vector<std::string> columns = table.columns;
    columns.back() = "other";
    write_table(path, Table(columns));
    CHECK_THROWS_WITH_AS(read_tables(folder),
                         doctest::Contains((name + ".csv:1: has no column '" + table.columns.back() + "'").c_str()),
                         io::Error);
    columns.insert(columns.begin(), table.columns.back());
    write_table(path, Table(columns));
    CHECK(read_tables(folder).at(name).columns == columns);
    write_table(path, table);
  }
}

TEST_CASE("sweep: names each value, and refuses a bad one") {
  CHECK(sweep_values("cluster.threshold_deg=1:2:0.5") ==
        std::vector<std::string>{"cluster.threshold_deg=1", "cluster.threshold_deg=1.5", "cluster.threshold_deg=2"});
  CHECK(sweep_values("").empty());
  for (const char* bad : {"x", "x=1", "x=1:2", "x=2:1:1", "x=1:2:0", "x=1:2:z", "x=0:1:1e-9"})
    CHECK_THROWS_AS(sweep_values(bad), io::Error);
}

TEST_CASE("events: a row belongs to the pass nearest in time") {
  // ahead falls through 0 between rows 1 and 2, rises through 0 between rows 7 and 8; the middle is row 5
  CHECK(events_of({2, 1, -1, -2, -3, -3, -2, -1, 1, 2}) == std::vector<int32_t>{0, 0, 0, 0, 0, 0, 1, 1, 1, 1});
  CHECK(events_of({5, 4, 3}) == std::vector<int32_t>{0, 0, 0});
}

TEST_CASE("figures: probability by distance, false positives, ground and tracking of a run made by hand") {
  const std::vector<Figures> all = make_figures({hand_made_run()});
  REQUIRE(all.size() == 1);
  const Figures& f = all[0];
  CHECK(f.frames == 10);
  CHECK(f.seconds == Approx(0.5));
  const DistanceBin& there = f.distance[14];  // 40 to 50 m
  CHECK(there.middle_m == 45);
  CHECK(there.detected.value == Approx(0.6));
  CHECK(there.confirmed.value == Approx(0.4));
  CHECK(f.distance[13].detected.trials == 0);
  CHECK(f.distance[6].false_detections == Approx(0.5));  // -40 to -30 m
  CHECK(f.distance[6].false_confirmed == Approx(0.5));
  CHECK(metrics::summarize(f.ground.tpr).mean == Approx(0.8));
  CHECK(metrics::summarize(f.ground.f1).mean == Approx(0.8));
  CHECK(metrics::summarize(f.clusters_per_car).mean == Approx(2));
  CHECK(metrics::summarize(f.mixed_other).mean == Approx(0.1));
  // 10 objects: 4 matched, 6 missed; 5 false
  CHECK(f.tracks.mot.mota() == Approx(1 - 11.0 / 10));
  CHECK(f.tracks.mot.motp_m() == Approx(0.5));
  CHECK(f.tracks.time_to_confirm_s.mean == Approx(0.3));
  CHECK(f.tracks.false_tracks == 1);
  CHECK(f.tracks.false_per_hour == Approx(7200));
  CHECK(f.track_errors.at("speed_mps") == std::vector<double>(4, 1.0));
}

TEST_CASE("figures: no two windows of 20 s share an id, however long the log is") {
  // Two windows with a track of another id for the same car: each window has a perfect association.
  for (const double later_s : {20.0, 5100.0, 5120.0, 10240.0}) {
    CAPTURE(later_s);
    Run run{"paper", "log", {{"scenario", "hand"}, {"period_s", "0.05"}}, make_tables()};
    for (int32_t k = 0; k < 20; ++k) {
      const double frame = k < 10 ? k : 20 * later_s + k, time = 0.05 * frame;
      run.tables["clusters"].add({frame, 7, 0, 0});
      run.tables["cars"].add({frame, time, 1, 45, 0, 45, 0, 20, 2, 1, 1, 0, 1});
      run.tables["tracks"].add({frame, time, k < 10 ? 5.0 : 6.0, 1, 1, 45, 45, 0, 0, 0, 0, 0, 0, 0, 0, 0, 5, 0.05});
    }
    const std::vector<Figures> all = make_figures({run});
    REQUIRE(all.size() == 1);
    CHECK(all[0].tracks.hota.association == Approx(0.5));
    CHECK(all[0].tracks.hota_window.association == Approx(1));
  }
}

TEST_CASE("places: a heading returns from the map also on a banked track") {
  for (const double roll : {0.0, 0.35})
    for (const double heading : {-3.0, -0.4, 0.0, 0.3, 2.0}) {
      io::EgoRow pose;
      pose.roll_rad = roll, pose.pitch_rad = 0.02, pose.yaw_rad = 0.7;
      const double in_map = to_map(pose, 0, 0, 0, heading).heading_rad;
      CHECK(heading_from_map(roll, 0.02, 0.7, in_map) == Approx(heading));
    }
  CHECK(heading_in_vehicle(0, 0, 0.7, 1.0) == Approx(0.3));
}

TEST_CASE("cluster_tally: counts clusters of a car and mixed ones, by truth and by the paper's rule") {
  // A car 20 m ahead, 4.9 x 1.9 m: x from 17.5 to 22.5, y from -0.9 to 0.9; a wall at y = 3 from 10 to 30 m.
  const std::vector<CarPlace> car = {{1, 20, 0, 1, 0}};
  const auto wall = [](ClusterTally& tally, int64_t cluster) {
    for (double x = 10; x <= 30; x += 1) tally.add(cluster, {x, 3, 0.5}, Kind::kObstacle, -1);
  };
  ClusterTally good(car);
  good.add(1, {18, 0, 0.3}, Kind::kCar, 1), good.add(1, {22, 0.5, 0.3}, Kind::kCar, 1);
  good.add(2, {18, -0.8, 0.3}, Kind::kCar, 1);  // a wheel, separate from the car
  wall(good, 3);
  CHECK(good.of_car().at(1).clusters == 2);
  CHECK(good.of_car().at(1).inside == 2);
  CHECK(good.mixed().other == 0);
  CHECK(good.mixed().by_size == 0);

  ClusterTally mixed(car);
  mixed.add(3, {18, 0, 0.3}, Kind::kCar, 1);
  wall(mixed, 3);
  CHECK(mixed.of_car().at(1).clusters == 1);
  CHECK(mixed.of_car().at(1).inside == 0);
  CHECK(mixed.mixed().other == 1);
  CHECK(mixed.mixed().by_size == 1);
  CHECK(mixed.mixed().cars == 0);

  ClusterTally two({{1, 20, 0, 1, 0}, {2, 20, 2.5, 1, 0}});  // side by side: 4.4 m, not longer than a car
  two.add(7, {20, -0.9, 0.3}, Kind::kCar, 1), two.add(7, {20, 3.4, 0.3}, Kind::kCar, 2);
  CHECK(two.mixed().cars == 1);
  CHECK(two.mixed().by_size == 0);
}

TEST_CASE("modes: two peaks are two modes, one with a shoulder is one, no values are none") {
  std::vector<double> two, one;
  for (int32_t k = 0; k < 2000; ++k) {
    const double spread = std::sin(0.37 * k) + std::sin(1.91 * k);  // within +-2
    two.push_back((k % 3 ? -4.0 : 4.0) + spread), one.push_back(spread + (k % 3 ? 0.0 : 0.5));
  }
  const std::vector<double> modes = modes_of(two, -30, 30);
  REQUIRE(modes.size() == 2);
  CHECK(std::fabs(modes[0] + 4) < 2);
  CHECK(std::fabs(modes[1] - 4) < 2);
  CHECK(modes_of({}, -30, 30).empty());
  CHECK(modes_of({1, 1, 1}, -30, 30).size() == 1);
}

TEST_CASE("claims: claims and costs follow from the figures, and missing measurements are named") {
  Figures f;
  f.variant = "paper", f.scenario = "hand";
  f.ground.tpr = {0.9, 0.92}, f.grid.tpr = {0.5, 0.8}, f.ground.f1 = {0.8, 0.81}, f.grid.f1 = {0.6, 0.7};
  f.ground.ppv = {0.7, 0.7}, f.grid.ppv = {0.9, 0.9};
  for (double m = -95; m < 150; m += 10) {
    const int64_t hits = m > -40 && m < -20 ? 10 : std::fabs(m) < 80 ? 90 : 2;
    f.distance.push_back({m,
                          {hits, 100, double(hits) / 100, double(hits - 2) / 100, double(hits + 2) / 100},
                          {95, 100, 0.95},
                          5,
                          m > -90 && m < -70 ? 0.1 : 0.4,
                          0.01});
  }
  const auto verdict = [](const std::vector<Claim>& claims, const std::string& name) {
    for (const Claim& c : claims)
      if (c.name == name) return c.known ? (c.holds ? 1 : 0) : -1;
    return -2;
  };
  std::vector<Claim> claims = check_claims(f, {f});
  for (const char* name : {"ground_tpr_higher_by_truth", "ground_tpr_steadier_by_truth", "ground_f1_higher_by_truth",
                           "ground_f1_steadier_by_truth", "ground_ppv_lower_by_truth"})
    CHECK(verdict(claims, name) == 1);
  CHECK(verdict(claims, "ground_f1_higher_by_labels") == -1);
  CHECK(verdict(claims, "clusters_by_truth") == -1);
  CHECK(verdict(claims, "clusters_by_boxes") == -1);
  CHECK(verdict(claims, "dip_behind") == 1);
  CHECK(verdict(claims, "track_over_dip") == 1);
  for (const char* name : {"seen_ahead", "seen_behind", "half_ahead"}) CHECK(verdict(claims, name) == 1);
  CHECK(verdict(claims, "false_tracks_rare") == 1);
  CHECK(verdict(claims, "false_gather_behind") == 0);
  CHECK(verdict(claims, "false_behind_by_heading") == -1);
  CHECK(verdict(claims, "mounting") == -1);
  std::swap(f.ground, f.grid);
  for (DistanceBin& b : f.distance) b.detected = {90, 100, 0.9, 0.88, 0.92};
  claims = check_claims(f, {f});
  CHECK(verdict(claims, "ground_tpr_higher_by_truth") == 0);
  CHECK(verdict(claims, "dip_behind") == 0);
  CHECK(verdict(claims, "half_ahead") == 0);

  // Never below 1/2 although cars were there: the claim fails. No car beyond 100 m: unknown.
  const auto number = [](const std::vector<Claim>& of, const std::string& name, const std::string& key) {
    for (const Claim& c : of)
      for (const Number& n : c.numbers)
        if (c.name == name && n.name == key) return n.value;
    return -1.0;
  };
  CHECK(std::isnan(number(claims, "half_ahead", "falls_below_half_m")));
  CHECK(number(claims, "seen_ahead", "farthest_car_m") == 150);
  CHECK(verdict(claims, "seen_ahead") == 0);
  Figures near = f;
  for (DistanceBin& b : near.distance)
    if (std::fabs(b.middle_m) > 85) b.detected = {0, 0, NAN, 0, 1};
  const std::vector<Claim> of_near = check_claims(near, {near});
  for (const char* name : {"seen_ahead", "seen_behind", "half_ahead"}) CHECK(verdict(of_near, name) == -1);
  CHECK(number(of_near, "seen_ahead", "farthest_car_m") == 90);
  std::set<std::string> sentences;
  for (const Claim& c : claims) sentences.insert(c.text);
  CHECK(sentences.size() == claims.size());  // each sentence makes sense alone
  CHECK(sentences.count("ground removal, F1: a smaller deviation over the scans than the 2.5-D grid, by truth") == 1);

  f.clusters_per_car = {2, 2},
  f.mixed_other = {0, 0};  // 0.5 m: 4 and none; 2 m: 1, and a mixed cluster in every second frame
  f.euclid_clusters = {{0.5, {4, 4}}, {2, {1, 1}}}, f.euclid_mixed = {{0.5, {0, 0}}, {2, {1, 0}}};
  CHECK(verdict(check_claims(f, {f}), "clusters_by_truth") == 1);
  f.mixed_other = {1, 1};
  CHECK(verdict(check_claims(f, {f}), "clusters_by_truth") == 0);

  Figures ground = f, ego = f;
  ground.variant = "paper:ground", ego.variant = "paper:ego";
  f.tracks.gospa_false_m2 = 5, ground.tracks.gospa_false_m2 = 4, ego.tracks.gospa_false_m2 = 1;
  const std::vector<Cost> costs = find_costs(f, {f, ground, ego});
  REQUIRE(costs.size() == 2);
  CHECK(costs[0].oracle == "ego");
  CHECK(costs[0].gospa_m2 == Approx(4));
  CHECK(costs[0].false_m2 == Approx(4));
  CHECK(costs[1].gospa_m2 == Approx(1));
}

TEST_CASE("controls: chance explains some detections without points, and a late truth needs a moving car") {
  const auto verdict = [](const std::vector<Claim>& controls, const std::string& name) {
    for (const Claim& c : controls)
      if (c.name == name) return c.known ? (c.holds ? 1 : 0) : -1;
    return -2;
  };
  Figures f, empty, late;
  f.variant = "paper", empty.variant = "paper:empty", late.variant = "paper:late_truth";
  f.scenario = empty.scenario = late.scenario = "hand";
  f.tracks.mot.objects = 100;
  f.distance = {{5, {90, 100, 0.9}, {90, 100, 0.9}, 1, 0.5, 0}};
  // 0.5 per frame and 10 m: 0.4 within the gate, so a hit by chance in 1 - exp(-0.4) = 0.33 of the frames.
  for (const auto& [hits, expected] : {std::pair(30, 1), std::pair(44, 1), std::pair(60, 0)}) {
    empty.distance = {{5, {hits, 100, hits / 100.0}, {}, 1, 0.5, 0}};
    CHECK(verdict(check_controls(f, {f, empty}), "no_car_points") == expected);
  }
  empty.distance = {{5, {3, 100, 0.03}, {}, 1, 0, 0}};  // no false detections anywhere: 3 are too many
  CHECK(verdict(check_controls(f, {f, empty}), "no_car_points") == 0);

  CHECK(verdict(check_controls(f, {f, late}), "late_truth") == -1);  // only standing cars
  f.along_moving_m = {0.5, 0.7}, late.along_moving_m = {2.5, 2.1};
  CHECK(verdict(check_controls(f, {f, late}), "late_truth") == 1);
  late.along_moving_m = {0.5, 0.7};
  CHECK(verdict(check_controls(f, {f, late}), "late_truth") == 0);
}

TEST_CASE("figures: moving cars, distances between cars, and values unknown in a recording") {
  Run run = hand_made_run();
  for (int32_t k = 0; k < 10; ++k) {  // a second car beside the first drives 2 m per frame, the first one stands
    run.tables["cars"].add({double(k), 0.05 * k, 2, 45, 6, 45.0 + 2 * k, 6, 20, 1, 1, 1, 0, 0});
    run.tables["detections"].add({double(k), 2, 45, 6, 9, 0, 0, 0, -0.25, 0, 0});
    run.tables["detections"].add({double(k), 1, 45, 0, 9, 0, 0, 0, 3, 0, 0});
    for (const double radius : {0.5, 2.0}) {
      run.tables["euclid"].add({double(k), radius, 1, 3, 2});
      run.tables["euclid_mixed"].add({double(k), radius, 1, 0, 4});
    }
    run.tables["boxes"].add({double(k), 1});
  }
  const Figures f = make_figures({run})[0];
  CHECK(f.along_moving_m == std::vector<double>(10, 0.25));
  CHECK(f.most_cars == 2);
  CHECK(f.closest_cars_m == Approx(6));
  CHECK(f.surface_known);
  CHECK(f.euclid_clusters.size() == 2);

  // The same without the object of each point: measured by the paper's rule, not by truth.
  Run recorded = run;
  recorded.log = "recorded", recorded.about["simulated"] = "false";
  recorded.tables["scans"] = make_tables()["scans"];
  const Figures r = make_figures({recorded})[0];
  CHECK(!r.surface_known);
  for (const auto* values : {&r.clusters_per_car, &r.mixed_other, &r.mixed_cars}) CHECK(values->empty());
  CHECK(r.euclid_clusters.empty());
  CHECK(r.euclid_mixed.empty());
  CHECK(r.boxed_per_car == std::vector<double>(20, 1));
  CHECK(r.mixed_by_size == std::vector<double>(10, 1));
  CHECK(r.euclid_boxed.at(2) == std::vector<double>(10, 2));
  CHECK(r.euclid_mixed_by_size.at(2) == std::vector<double>(10, 4));
  for (const Claim& c : check_claims(r, {r}))
    if (c.name == "clusters_by_truth" || c.name == "ground_tpr_higher_by_truth") CHECK(!c.known);

  CHECK(origin_of({run}) == Origin::kSimulated);
  CHECK(origin_of({recorded}) == Origin::kRecorded);
  CHECK(origin_of({run, recorded}) == Origin::kMixed);
  CHECK(make_figures({run, recorded})[0].origin == Origin::kMixed);  // two origins in one scenario
}

TEST_CASE("plots: ticks are round and inside, text is escaped, missing values are not drawn") {
  CHECK(round_ticks(0, 1) == std::vector<double>{0, 0.2, 0.4, 0.6000000000000001, 0.8, 1});
  CHECK(round_ticks(1, 1).empty());
  CHECK(round_ticks(0, NAN).empty());
  CHECK(round_ticks(-1, std::nextafter(-1, 0)).empty());  // no step is left that changes a number
  CHECK(cli::escape_xml("a<b & \"c\"") == "a&lt;b &amp; &quot;c&quot;");
  const std::string line =
      line_plot({"t", "x", "y"}, {{"s", "red", {0, 1, 2, 3}, {1, NAN, 2, 3}, {}, {}, true, false}});
  CHECK(line.find("nan") == std::string::npos);
  std::size_t dots = 0;
  for (std::size_t at = 0; (at = line.find("<circle", at)) != std::string::npos; ++at) ++dots;
  CHECK(dots == 3);
  const std::string violin = violin_plot({"t", "", ""}, {{"none", "red", {}}, {"one", "blue", {2, 2, 2}}});
  CHECK(violin.find("no data") != std::string::npos);
  CHECK(violin.find("nan") == std::string::npos);
}

namespace {

double sum_of(const Table& table, const char* name) {
  double sum = 0;
  for (std::size_t r = 0; r < table.rows(); ++r) sum += table.at(r, table.column(name));
  return sum;
}

// The oracle makes its part perfect, and nothing else changes.
void check_oracles(std::map<std::string, Run>& runs) {
  const auto table = [&](const char* variant, const char* name) -> const Table& {
    return runs.at(variant).tables.at(name);
  };
  const Table& ground = table("paper:ground", "scans");
  CHECK(sum_of(ground, "fn") < 0.005 * sum_of(ground, "tp"));
  CHECK(sum_of(ground, "fp") < 0.005 * sum_of(ground, "tp"));
  CHECK(sum_of(ground, "tp") == Approx(sum_of(table("paper", "scans"), "tp") + sum_of(table("paper", "scans"), "fn"))
                                    .epsilon(0.02));  // no point of an obstacle is lost

  const Table& whole = table("paper:clusters", "detections");
  const std::size_t car = whole.column("car"), turn = whole.column("heading_rad");
  CHECK(whole.rows() > 5);
  for (std::size_t r = 0; r < whole.rows(); ++r) CHECK(whole.at(r, car) == 1);  // one per frame, and no others

  const Table &relay = table("paper:relay", "detections"), &plain = table("paper", "detections"),
              &heading = table("paper:heading", "detections");
  REQUIRE(relay.rows() == plain.rows());
  REQUIRE(heading.rows() == plain.rows());
  for (std::size_t i = 0; i < plain.cells.size(); ++i) {
    CAPTURE(i);
    CHECK((std::isnan(plain.cells[i]) || plain.cells[i] == relay.cells[i]));
  }
  int32_t at_car = 0;
  for (std::size_t r = 0; r < heading.rows(); ++r) {
    if (heading.at(r, car) < 0) continue;
    ++at_car;
    CHECK(std::fabs(heading.at(r, turn)) < 0.05);  // the localisation's heading error, with the slip angle
  }
  CHECK(at_car > 5);
  CHECK(table("paper:relay", "tracks").rows() > 0);

  CHECK(sum_of(table("paper:empty", "cars"), "points") == 0);
  CHECK(sum_of(table("paper:mounting", "cars"), "points") == sum_of(table("paper", "cars"), "points"));
  CHECK(sum_of(table("paper:mounting", "detections"), "ahead_m") != sum_of(plain, "ahead_m"));
}

}  // namespace

TEST_CASE("evaluation: shuffled rows change nothing, a late truth is off by the car's motion") {
  const std::string folder = fresh_folder("race"), log = folder + "/race.mcap";
  test::write_race(sim::load_scenario("overtake"), 1, 0.8, log);
  RunOptions options;
  options.logs = {log};
  options.presets = {"paper"};
  for (const std::string& variant : variant_names()) options.presets.push_back("paper:" + variant);
  options.sweep = "cluster.threshold_deg=2:4:2";
  options.out = folder + "/out";
  options.quiet = true;
  REQUIRE(run_logs(options));
  std::map<std::string, Run> runs;
  for (Run& run : read_runs(options.out)) runs[run.variant] = std::move(run);
  REQUIRE(runs.size() == 12);
  const Tables& plain = runs["paper"].tables;
  CHECK(plain.at("clusters").rows() >= 15);
  CHECK(plain.at("grid").rows() == 6);  // frames 0 and 10, three sensors

  // The order of the points decides the order of sums, so positions may differ by rounding; counts must not.
  const std::string of_plain = options.out + "/runs/paper/race/",
                    of_shuffled = options.out + "/runs/paper+shuffled/race/";
  for (const char* name : {"scans.csv", "cars.csv", "clusters.csv"})
    CHECK(io::read_whole_file(of_plain + name) == io::read_whole_file(of_shuffled + name));
  for (const char* name : {"detections", "tracks"}) {
    const Table &a = plain.at(name), &b = runs["paper:shuffled"].tables.at(name);
    REQUIRE(a.cells.size() == b.cells.size());
    CHECK(a.rows() > 0);
    for (std::size_t i = 0; i < a.cells.size(); ++i)
      CHECK((std::isnan(a.cells[i]) == std::isnan(b.cells[i]) && !(std::fabs(a.cells[i] - b.cells[i]) > 1e-3)));
  }

  // Each detection at the car in both runs: the errors differ by the car's way in a period, about 60 m/s * 0.05 s.
  const Table &now = plain.at("detections"), &late = runs["paper:late_truth"].tables.at("detections");
  REQUIRE(now.rows() == late.rows());
  const std::size_t car = now.column("car"), x = now.column("x_map_m"), y = now.column("y_map_m");
  int32_t compared = 0;
  for (std::size_t r = 0; r < now.rows(); ++r) {
    if (now.at(r, car) < 0 || late.at(r, car) < 0) continue;
    const double drive = std::hypot(now.at(r, x) - late.at(r, x), now.at(r, y) - late.at(r, y));
    CHECK(drive > 1.5);
    CHECK(drive < 4.0);
    ++compared;
  }
  CHECK(compared > 0);

  check_oracles(runs);

  write_report(options.out, false);
  const std::string html = io::read_whole_file(options.out + "/report.html");
  CHECK(html.find("<svg") != std::string::npos);
  CHECK(html.find("simulated") != std::string::npos);
  CHECK(html.find("src=") == std::string::npos);  // one file, nothing loaded from outside
  CHECK(html.find("<script") == std::string::npos);

  // Finished runs are kept; merging them elsewhere gives the same numbers; contradicting ones are refused.
  REQUIRE(run_logs(options));
  merge_runs({options.out}, folder + "/merged");
  write_report(folder + "/merged", false);
  CHECK(io::read_whole_file(folder + "/merged/metrics.json") == io::read_whole_file(options.out + "/metrics.json"));
  io::write_whole_file(of_plain + "cars.csv",
                       io::read_whole_file(of_plain + "cars.csv") + "999,9,1,0,0,0,0,0,0,0,0,0,0\n");
  CHECK_THROWS_WITH_AS(merge_runs({options.out}, folder + "/merged"), doctest::Contains("differs"), io::Error);

  options.presets = {"paper:nonsense"};
  CHECK_THROWS_WITH_AS(run_logs(options), doctest::Contains("no variant 'nonsense'"), io::Error);
  std::filesystem::remove_all(folder);
}
