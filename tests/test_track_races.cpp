// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// The tables of tracks that the evaluation makes of simulated races.
#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "tests/support/simulated_race.h"
#include "tests/support/temp_folder.h"
#include "tools/evaluation/run_logs.h"

using namespace overtake;
using namespace overtake::evaluation;

namespace {

double cell(const Table& table, std::size_t row, const char* column) { return table.at(row, table.column(column)); }

std::vector<Run> evaluate_race(const std::string& scenario, uint64_t seed, double seconds,
                               const std::vector<std::string>& presets) {
  const TempFolder folder;
  RunOptions options;
  options.logs = {folder.path("race.mcap")}, options.presets = presets, options.out = folder.path("out");
  options.only_figures = options.quiet = true;
  test::write_race(sim::load_scenario(scenario), seed, seconds, options.logs[0]);
  REQUIRE(run_logs(options));
  return read_runs(options.out);
}

// Frames in which a car that shows 3 points is in sight, up to `range_m`.
struct CarFrames {
  int32_t frames = 0, detected = 0, confirmed = 0;
};
CarFrames count_seen(const Run& run, int32_t car, double range_m) {
  const Table& cars = run.tables.at("cars");
  CarFrames seen;
  for (std::size_t r = 0; r < cars.rows(); ++r) {
    if (cell(cars, r, "car") != car || cell(cars, r, "points") < 3 ||
        std::hypot(cell(cars, r, "ahead_m"), cell(cars, r, "left_m")) > range_m)
      continue;
    ++seen.frames, seen.detected += cell(cars, r, "detections") > 0, seen.confirmed += cell(cars, r, "confirmed") > 0;
  }
  return seen;
}

int32_t count_false_confirmed(const Run& run) {
  const Table& tracks = run.tables.at("tracks");
  int32_t count = 0;
  for (std::size_t r = 0; r < tracks.rows(); ++r)
    count += cell(tracks, r, "confirmed") > 0 && cell(tracks, r, "car") < 0;
  return count;
}

}  // namespace

TEST_CASE(
    "evaluation of tracks: a follower in the own shadow is detected and confirmed, a far piece of the wall is not") {
  for (const Run& run : evaluate_race("follower", 3, 4, {"best"})) {
    const CarFrames follower = count_seen(run, 1, 1000);
    CHECK(follower.frames > 70);
    CHECK(follower.detected >= follower.frames - 2);
    CHECK(follower.confirmed >= follower.frames - 4);
    CHECK(count_false_confirmed(run) == 0);
  }
}

TEST_CASE("evaluation of tracks: at 300 km/h every car up to 110 m away is detected and confirmed") {
  for (const Run& run : evaluate_race("full_speed", 2, 6, {"best"})) {
    for (const int32_t car : {1, 2, 3}) {
      CAPTURE(car);
      const CarFrames seen = count_seen(run, car, 110);
      CHECK(seen.frames > 60);
      CHECK(seen.detected >= seen.frames - 3);
      CHECK(seen.confirmed >= seen.frames - 3);
    }
    CHECK(count_false_confirmed(run) == 0);
  }
}

TEST_CASE(
    "evaluation of tracks: a simulated drive past parked vehicles gives rows of motion, paths and parked tracks") {
  for (const Run& run : evaluate_race("pit_lane", 1, 1.5, {"best", "paper"})) {
    CAPTURE(run.variant);
    const Table &tracks = run.tables.at("tracks"), &paths = run.tables.at("paths"), &motion = run.tables.at("motion"),
                &cars = run.tables.at("cars"), &parked = run.tables.at("parked_tracks"),
                &existence = run.tables.at("existence");
    CHECK(motion.rows() == cars.rows());
    CHECK(parked.rows() > 0);
    CHECK(existence.rows() == (run.variant == "best" ? tracks.rows() : 0));
    CHECK(run.tables.at("innovations").rows() > 0);
    CHECK(run.tables.at("innovations_own").rows() == (run.variant == "best" ? run.tables.at("innovations").rows() : 0));
    std::set<std::pair<double, double>> rows;
    for (std::size_t r = 0; r < tracks.rows(); ++r) rows.insert({cell(tracks, r, "frame"), cell(tracks, r, "id")});
    for (std::size_t r = 0; r < parked.rows(); ++r)
      CHECK(rows.count({cell(parked, r, "frame"), cell(parked, r, "id")}) == 0);
    // Every confirmed track at a car has a path of 0.5 s until the log ends that much later.
    double last_s = 0, expected = 0, found = 0;
    for (std::size_t r = 0; r < cars.rows(); ++r) last_s = std::max(last_s, cell(cars, r, "time_s"));
    for (std::size_t r = 0; r < tracks.rows(); ++r)
      expected += cell(tracks, r, "confirmed") > 0 && cell(tracks, r, "car") >= 0 &&
                  cell(tracks, r, "time_s") <= last_s - 0.5 + 1e-6;
    for (std::size_t r = 0; r < paths.rows(); ++r) found += cell(paths, r, "horizon_s") == 0.5;
    CHECK(found > 5);
    CHECK(found == expected);
    for (std::size_t r = 0; r < paths.rows(); ++r) {
      CHECK(std::fabs(cell(paths, r, "offset_change_m")) < 5);
      if (run.variant == "best") CHECK(std::hypot(cell(paths, r, "along_m"), cell(paths, r, "across_m")) < 6);
    }
  }
}
