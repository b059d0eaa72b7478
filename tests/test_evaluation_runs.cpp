// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// Which frames a contestant is given, and which runs are kept: both are invisible in a report that is wrong.
#include <doctest/doctest.h>

#include <cmath>
#include <map>

#include "tests/support/temp_folder.h"
#include "tools/evaluation/report.h"
#include "tools/evaluation/run_logs.h"
#include "tools/io/error.h"
#include "tools/sim/race_log.h"

using namespace overtake;
using namespace overtake::evaluation;

namespace {

void simulate(const std::string& path, double seconds, uint64_t seed) {
  const sim::Scenario scenario = sim::load_scenario("blind_zone");  // begins with a car over a seam
  sim::Simulator simulator(scenario, seed, seconds, 2);
  const auto out = sim::make_mcap_log(path, simulator, seed);
  for (int32_t k = 0; k < simulator.sweep_count(); ++k) out->write(k, simulator.sweep(k));
  out->close();
}

std::map<std::string, Run> runs_of(const std::string& out) {
  std::map<std::string, Run> runs;
  for (Run& run : read_runs(out)) runs[run.contestant] = std::move(run);
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

TEST_CASE("a sweep at the preset's own value finds the preset's own clusters on every N-th frame") {
  const TempFolder folder;
  simulate(folder.path("race.mcap"), 2.3, 1);  // 46 sweeps
  RunOptions options;
  options.logs = {folder.path("race.mcap")};
  options.presets = {"paper"};
  options.sweep = "cluster.threshold_deg=2.5:2.5:1";
  options.quiet = true;
  for (const int32_t every : {7, 22}) {  // 22: 1.1 s, which looks like a clock that jumped where frames come at 20 Hz
    CAPTURE(every);
    options.every = every, options.out = folder.path(std::to_string(every));
    RunOptions before = options;
    before.sweep = "";
    if (every == 22) REQUIRE(run_logs(before));  // the sweep comes later, alone
    REQUIRE(run_logs(options));
    auto runs = runs_of(options.out);
    const Run &all = runs.at("paper"), &some = runs.at("paper@cluster.threshold_deg=2.5");
    CHECK(all.tables.at("clusters").rows() == 46);
    CHECK(some.tables.at("clusters").rows() == std::size_t((46 + every - 1) / every));
    CHECK(some.about.at("frames") == std::to_string((46 + every - 1) / every));
    CHECK(some.tables.at("seams").rows() > 0);
    for (const char* name : {"scans", "clusters", "boxes", "seams", "car_points"}) {
      CAPTURE(name);
      CHECK(every_nth(all.tables.at(name), every).cells == some.tables.at(name).cells);
    }
  }
  options.every = 1000, options.out = folder.path("far");  // 50 s
  CHECK_THROWS_WITH_AS(run_logs(options), doctest::Contains("--every 1000"), io::Error);
}
