// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// Which frames a variant gets, and which runs are kept: a wrong report would show neither.
#include <doctest/doctest.h>

#include <cmath>
#include <filesystem>
#include <map>
#include <nlohmann/json.hpp>

#include "tests/support/simulated_race.h"
#include "tests/support/temp_folder.h"
#include "tools/evaluation/figures.h"
#include "tools/evaluation/kept_runs.h"
#include "tools/evaluation/report.h"
#include "tools/evaluation/run_logs.h"
#include "tools/evaluation/simulated_log.h"
#include "tools/evaluation/track_quality.h"
#include "tools/io/error.h"

using namespace overtake;
using namespace overtake::evaluation;

namespace {

void simulate_race(const std::string& path, double seconds, uint64_t seed) {
  test::write_race(sim::load_scenario("blind_zone"), seed, seconds, path);  // starts with a car over a seam
}

std::map<std::string, Run> runs_of(const std::string& out) {
  std::map<std::string, Run> runs;
  for (Run& run : read_runs(out)) runs[run.variant] = std::move(run);
  return runs;
}

// The rows of every N-th frame; the first column is the frame.
Table every_nth(const Table& table, int64_t n) {
  Table out(table.columns);
  const std::size_t width = table.columns.size();
  for (std::size_t r = 0; r < table.rows(); ++r)
    if (int64_t(table.at(r, 0)) % n == 0)
      out.cells.insert(out.cells.end(), table.cells.begin() + int64_t(r * width),
                       table.cells.begin() + int64_t((r + 1) * width));
  return out;
}

}  // namespace

TEST_CASE("sweep: the preset's own value gives the preset's clusters on every N-th frame") {
  const TempFolder folder;
  simulate_race(folder.path("race.mcap"), 2.3, 2);  // 46 frames, most with the car over a seam
  RunOptions options;
  options.logs = {folder.path("race.mcap")};
  options.presets = {"paper"};
  options.sweep = "cluster.threshold_deg=2.5:2.5:1";
  options.quiet = true;
  for (const int32_t every : {7, 22}) {  // 22: 1.1 s, which looks like a clock jump at 20 Hz
    CAPTURE(every);
    options.every = every, options.out = folder.path(std::to_string(every));
    RunOptions before = options;
    before.sweep = "";
    if (every == 22) REQUIRE(run_logs(before));  // the sweep runs later, alone
    REQUIRE(run_logs(options));
    auto runs = runs_of(options.out);
    const Run &all = runs.at("paper"), &some = runs.at("paper@cluster.threshold_deg=2.5");
    CHECK(all.tables.at("clusters").rows() == 46);
    CHECK(some.tables.at("clusters").rows() == std::size_t((46 + every - 1) / every));
    CHECK(some.about.at("frames") == std::to_string((46 + every - 1) / every));
    CHECK(some.tables.at("seams").rows() > 0);
    const double frames = double((46 + every - 1) / every);
    CHECK(make_figures({some})[0].seconds == doctest::Approx(0.05 * every * frames));
    CHECK(find_track_quality({some})[0].hours == doctest::Approx(0.05 * every * frames / 3600));
    CHECK(make_figures({all})[0].seconds == doctest::Approx(0.05 * 46));
    for (const char* name : {"scans", "clusters", "boxes", "seams", "car_points"}) {
      CAPTURE(name);
      CHECK(every_nth(all.tables.at(name), every).cells == some.tables.at(name).cells);
    }
  }
  options.every = 1000, options.out = folder.path("far");  // 50 s
  CHECK_THROWS_WITH_AS(run_logs(options), doctest::Contains("--every 1000"), io::Error);
}

TEST_CASE("runs: kept only for the same question; other frames, --every or log of the same name run again") {
  const TempFolder folder;
  std::filesystem::create_directories(folder.path("other"));
  simulate_race(folder.path("race.mcap"), 0.3, 1);
  simulate_race(folder.path("other/race.mcap"), 0.3, 2);
  RunOptions options;
  options.logs = {folder.path("race.mcap")};
  options.presets = {"paper", "paper:relay"};
  options.sweep = "cluster.threshold_deg=4:4:1";
  options.out = folder.path("out");
  options.quiet = true;
  // The variants that the next call runs again: their table lost the marker that the test wrote.
  const auto run_again = [&] {
    const std::string table = "/race/cars.csv", mark = "kept";
    std::string again;
    for (const char* name : {"paper", "paper:relay", "paper@cluster.threshold_deg=4"})
      if (std::filesystem::exists(options.out + "/runs/" + folder_name(name) + table))
        io::write_whole_file(options.out + "/runs/" + folder_name(name) + table, mark);
    REQUIRE(run_logs(options));
    for (const char* name : {"paper", "paper:relay", "paper@cluster.threshold_deg=4"})
      if (io::read_whole_file(options.out + "/runs/" + folder_name(name) + table) != mark)
        again += std::string(name) + " ";
    return again;
  };
  const std::string all = "paper paper:relay paper@cluster.threshold_deg=4 ";
  options.most_frames = 2;
  CHECK(run_again() == all);
  CHECK(run_again() == "");
  options.most_frames = INT64_MAX;
  CHECK(run_again() == all);
  CHECK(run_again() == "");
  options.every = 3;  // the baselines beside the first one, and the sweep
  CHECK(run_again() == "paper paper@cluster.threshold_deg=4 ");
  options.logs = {folder.path("other/race.mcap")};
  CHECK(run_again() == all);
  CHECK(run_again() == "");
  std::filesystem::copy_file(folder.path("other/race.mcap"), folder.path("race.mcap"),
                             std::filesystem::copy_options::overwrite_existing);
  options.logs = {folder.path("race.mcap")};
  CHECK(run_again() == "");  // the same log in another folder
  std::swap(options.presets[0], options.presets[1]), options.sweep = "";
  CHECK(run_again() == "paper paper:relay ");  // the baselines were run for the other log
}

TEST_CASE("runs: folder names have no colon, and older results with a colon are kept") {
  namespace fs = std::filesystem;
  const TempFolder folder;
  simulate_race(folder.path("race.mcap"), 0.3, 1);
  RunOptions options;
  options.logs = {folder.path("race.mcap")};
  options.presets = {"paper", "paper:relay"};
  options.out = folder.path("out");
  options.most_frames = 2;
  options.quiet = true;
  REQUIRE(run_logs(options));
  for (const auto& entry : fs::recursive_directory_iterator(options.out))
    CHECK_MESSAGE(entry.path().filename().string().find(':') == std::string::npos, entry.path().string());
  const auto names = [&](const std::string& out) {
    std::string text;
    for (const Run& run : read_runs(out)) text += run.variant + " ";
    return text;
  };
  CHECK(names(options.out) == "paper paper:relay ");

  const fs::path now = options.out + "/runs/paper+relay", before = options.out + "/runs/paper:relay";
  const auto first_run = fs::last_write_time(now / "race/about.json");
  fs::rename(now, before);
  CHECK(names(options.out) == "paper paper:relay ");
  merge_runs({options.out}, folder.path("merged"));
  CHECK(names(folder.path("merged")) == "paper paper:relay ");
  CHECK(fs::exists(folder.path("merged") + "/runs/paper+relay/race/about.json"));
  REQUIRE(run_logs(options));
  CHECK(!fs::exists(before));
  CHECK(fs::last_write_time(now / "race/about.json") == first_run);  // kept, not run again

  fs::create_directories(before / "race");
  CHECK(error_of([&] { run_logs(options); }) ==
        before.string() + ": holds runs of the same variant as " + now.string());
  fs::remove_all(before);
  fs::rename(now, options.out + "/runs/paper+other");
  CHECK(error_of([&] { read_runs(options.out); }) ==
        options.out + "/runs/paper+other/race: is of variant 'paper:relay', its folder has another name");
}

TEST_CASE("merge: a run that is there must be equal, in about.json and in all tables but the times") {
  namespace fs = std::filesystem;
  const TempFolder folder;
  const std::string run = folder.path("from") + "/runs/paper/race", out = folder.path("out");
  fs::create_directories(run);
  const auto write = [&](const char* name, double value, const About& about) {
    Tables tables = make_tables();
    for (const char* table : {"cars", "tracks", "times"}) {
      std::vector<double> row(tables[table].columns.size(), NAN);
      row[0] = name == std::string(table) ? value : 1;
      tables[table].add(row);
    }
    write_tables(run, tables);
    write_about(run, about);
  };
  const About about = {{"contestant", "paper"}, {"every", "10"}, {"cpu", "a"}, {"input", "b"}};
  const auto merge = [&] { merge_runs({folder.path("from")}, out); };
  write("cars", 1, about);
  CHECK_NOTHROW(merge());
  CHECK_NOTHROW(merge());
  const std::string differs = run + ": differs from " + out + "/runs/paper/race in ";
  write("tracks", 2, about);
  CHECK(error_of(merge) == differs + "tracks.csv");
  write("cars", 2, about);
  CHECK(error_of(merge) == differs + "cars.csv");
  for (const char* key : {"every", "extent"}) {  // another value, a further key
    About other = about;
    other[key] = "3";
    write("cars", 1, other);
    CHECK(error_of(merge) == differs + "'" + key + "' of about.json");
  }
  About elsewhere = about;
  elsewhere["cpu"] = "c", elsewhere["input"] = "d";
  write("times", 2, elsewhere);
  CHECK_NOTHROW(merge());
  CHECK(read_runs(out)[0].about.at("cpu") == "a");
  CHECK(read_runs(out)[0].tables.at("times").at(0, 0) == 1);

  // The same run twice in one call; the earlier one may wait to be committed.
  write("cars", 1, about);
  merge_runs({folder.path("from"), out}, folder.path("both"));
  CHECK(read_runs(folder.path("both")).size() == 1);
}

TEST_CASE("log_stem: a folder has one name, however its path is written; a path without a name is refused") {
  CHECK(log_stem("logs/race.mcap") == "race");
  for (const char* path :
       {"logs/bag", "logs/bag/", "logs/bag//", "logs/bag/.", "./logs/../logs/bag/", "bag/first/.."}) {
    CAPTURE(path);
    CHECK(log_stem(path) == "bag");
    CHECK(log_file_name(path) == "bag");
  }
  CHECK(log_stem(".") == std::filesystem::current_path().stem().string());
  for (const char* path : {"", "/", "/logs/..", "...", "..mcap"})
    CHECK_MESSAGE(error_of([&] { log_stem(path); }).find("has no name") != std::string::npos, path);
}

TEST_CASE("runs: a recording whose path ends in a slash has the folder of its name, and other runs stay") {
  namespace fs = std::filesystem;
  const TempFolder folder;
  fs::create_directories(folder.path("bag"));
  simulate_race(folder.path("race.mcap"), 0.3, 1);
  fs::copy_file(folder.path("race.mcap"), folder.path("bag/bag_0.mcap"));
  SimulatedLog log(folder.path("race.mcap"));
  RunOptions options;
  options.rig = folder.write("rig.toml", io::format_rig(log.rig()));
  options.presets = {"paper"};
  options.out = folder.path("out");
  options.only_figures = options.quiet = true;
  options.logs = {folder.path("race.mcap")};
  REQUIRE(run_logs(options));
  options.logs = {folder.path("bag") + "/"};
  REQUIRE(run_logs(options));
  const std::vector<Run> runs = read_runs(options.out);
  REQUIRE(runs.size() == 2);
  CHECK(runs[0].log == "bag");
  CHECK(runs[0].about.at("scenario") == "bag");
  CHECK(runs[0].about.at("recording") == "bag");
  CHECK(runs[1].log == "race");
  CHECK(!fs::exists(options.out + "/runs/paper/about.json"));

  options.logs = {folder.path("bag"), folder.path("bag") + "/"};
  CHECK(error_of([&] { run_logs(options); }).find("two logs have this name") != std::string::npos);
}

TEST_CASE("hash_input: depends on each byte of a file, on some of a large one, a folder's files, and the options") {
  const TempFolder folder;
  const std::string two(std::size_t(3) << 20, 'x');
  const auto hash = [&](const std::string& text) { return hash_input(folder.write("a", text), ""); };
  const std::string first = hash(two);
  CHECK(hash(two) == first);
  CHECK(hash("y" + two.substr(1)) != first);
  CHECK(hash(two.substr(1) + "y") != first);
  CHECK(hash(two + "x") != first);
  std::string middle = two;
  middle[middle.size() / 2] = 'y';
  CHECK(hash(middle) != first);
  std::string large(std::size_t(70) << 20, 'x');
  const std::string of_large = hash(large);
  large.back() = 'y';
  CHECK(hash(large) != of_large);
  large.back() = 'x';
  std::fill_n(large.begin() + (35 << 20), 4 << 20, 'y');
  CHECK(hash(large) != of_large);
  CHECK(hash_input(folder.write("a", two), "rig") != first);
  folder.write("bag/1", "one"), folder.write("bag/2", "two");
  const std::string bag = hash_input(folder.path("bag"), "");
  folder.write("bag/2", "six");
  CHECK(hash_input(folder.path("bag"), "") != bag);
  CHECK(error_of([&] { hash_input(folder.path("none"), ""); }) == folder.path("none") + ": no such file");
}

TEST_CASE("report: names the CPUs of its runs, and metrics.json is the same from any of them") {
  const TempFolder folder;
  simulate_race(folder.path("race.mcap"), 0.3, 1);
  simulate_race(folder.path("race_2.mcap"), 0.3, 2);
  RunOptions options;
  options.logs = {folder.path("race.mcap"), folder.path("race_2.mcap")};
  options.presets = {"paper"};
  options.out = folder.path("out");
  options.quiet = true;
  REQUIRE(run_logs(options));
  write_report(options.out, false);
  const auto cpu_of = [&] {
    return nlohmann::json::parse(io::read_whole_file(options.out + "/times.json")).at("cpu").get<std::string>();
  };
  const std::string metrics = io::read_whole_file(options.out + "/metrics.json");
  CHECK(cpu_of().find(',') == std::string::npos);
  for (const char* log : {"race", "race_2"}) {
    const std::string run = options.out + "/runs/paper/" + log;
    About about = read_about(run);
    CHECK(about.at("cpu") == cpu_of());
    about["cpu"] = "Engine of " + std::string(log), about["input"] = log;
    write_about(run, about);
  }
  merge_runs({options.out}, folder.path("merged"));
  options.out = folder.path("merged");
  write_report(options.out, false);
  CHECK(cpu_of() == "Engine of race, Engine of race_2");
  CHECK(io::read_whole_file(options.out + "/report.html").find("On Engine of race, Engine of race_2, one worker") !=
        std::string::npos);
  CHECK(io::read_whole_file(options.out + "/metrics.json") == metrics);
}
