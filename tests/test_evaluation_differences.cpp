// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// Differences between configurations, of runs made by hand: values are counted in the rows, intervals contain what all
// have in common.
#include <doctest/doctest.h>

#include <cmath>
#include <functional>
#include <nlohmann/json.hpp>

#include "tests/support/temp_folder.h"
#include "tools/evaluation/detection_columns.h"
#include "tools/evaluation/differences.h"
#include "tools/evaluation/evaluator.h"
#include "tools/evaluation/metrics/resample.h"
#include "tools/evaluation/report_html.h"

using namespace overtake;
using namespace overtake::evaluation;
using doctest::Approx;

namespace {

constexpr int32_t kFrames = 240, kPasses = 6;

// A car that passes the ego six times in 240 frames. Every third pass is a bad one: its car is found in half of the
// frames. misses: further frames of each pass without a detection. error_m: of each centre.
Run passes(const std::string& variant, const std::string& config, int32_t misses, double error_m,
           const std::string& log = "race") {
  Run run{variant, log, {{"scenario", "hand"}, {"period_s", "0.05"}, {"config", config}}, make_tables()};
  constexpr int32_t kLength = kFrames / kPasses;
  for (int32_t k = 0; k < kFrames; ++k) {
    const int32_t pass = k / kLength, at = k % kLength;
    const double way = (pass % 2 ? -1 : 1) * (20.0 - at);  // changes its sign once a pass
    const bool found = (pass % 3 != 2 || at % 2 == 0) && at >= misses;
    run.tables["cars"].add({double(k), 0.05 * k, 1, way, 0, 0, 0, 10, 1, 1, double(found), 0, double(found)});
    run.tables["clusters"].add({double(k), 5, 0, 0});
    run.tables["ego"].add({double(k), 0.05 * k, 50, 0});
    if (found) run.tables["centres"].add({double(k), 1, k % 2 ? error_m : -error_m, 0.1, 1});
  }
  return run;
}

const ContestantDifference& of(const Differences& d, const std::string& name) {
  for (const ContestantDifference& c : d.contestants)
    if (c.contestant == name) return c;
  FAIL("no " << name);
  return d.contestants.front();
}

}  // namespace

TEST_CASE("resample: the ratio of sums; a common spread is in the values' intervals, not in that of the difference") {
  std::vector<metrics::RatioPart> a, b;
  for (int32_t g = 0; g < 40; ++g) {
    const double hits = g % 2 ? 9 : 3;
    a.push_back({hits, 10}), b.push_back({hits + 1, 10});
  }
  const metrics::GroupDraws draws(a.size());
  const auto ratios_a = draws.ratios(a), ratios_b = draws.ratios(b);
  const metrics::Estimate value = metrics::estimate_of(ratios_a);
  CHECK(value.value == Approx(0.6));
  CHECK(value.low < 0.55);
  CHECK(value.high > 0.65);
  CHECK(value.low > 0.45);
  const metrics::Estimate gain = metrics::estimate_of(metrics::subtract(ratios_b, ratios_a));
  CHECK(gain.value == Approx(0.1));
  CHECK(gain.low == Approx(0.1));
  CHECK(gain.high == Approx(0.1));
  CHECK(metrics::GroupDraws(a.size()).ratios(a) == ratios_a);  // the same in every run

  const metrics::Estimate alone = metrics::estimate_of(metrics::GroupDraws(1).ratios({{3, 4}}));
  CHECK(alone.value == 0.75);
  CHECK(std::isnan(alone.low));
  CHECK(std::isnan(metrics::estimate_of(metrics::GroupDraws(2).ratios({{1, 0}, {0, 0}})).value));
}

TEST_CASE("differences: against the first preset, over the events of the truth") {
  std::vector<Run> runs = {passes("best", "", 0, 0.2),
                           passes("late", "preset = best\ntracker.confirm_hits = 9", 4, 0.5),
                           passes("best@gate.min_points=5", "", 9, 9), passes("best:ground", "", 9, 9)};
  for (int32_t k = 0; k < 12; ++k) runs[1].tables["false_detections"].add({20.0 * k, 30, 0, 30, 5, -1, 0, 0, 0});
  for (int32_t k = 0; k < 24; ++k)
    runs[1].tables["tracks"].add(
        {double(k), 0.05 * k, 7, 1, k < 12 ? 1.0 : -1.0, 10, 500, 500, 3, 4, 0, 0, -2, 0, 0, 0, 1, 0});
  const Differences d = find_differences(runs);
  CHECK(d.base == "best");
  CHECK(d.logs == 1);
  CHECK(d.events == kPasses);
  REQUIRE(d.contestants.size() == 2);  // neither sweeps nor oracles
  const ContestantDifference &base = of(d, "best"), &late = of(d, "late");
  CHECK(base.values[0].value == Approx(200.0 / 240));
  CHECK(base.values[0].low < 0.78);
  CHECK(base.differences[0].value == 0);
  CHECK(base.differences[0].high == 0);
  // Of each good pass 4 frames, of each bad one 2.
  CHECK(late.differences[0].value == Approx(-(4 * 4 + 2 * 2) / 240.0));
  CHECK(late.differences[0].low > -0.12);
  CHECK(late.differences[0].high < -0.04);
  CHECK(late.values[1].value == Approx(12.0 / 240));  // false detections a frame
  CHECK(late.values[2].value == Approx(0.5));         // centre along
  CHECK(late.differences[2].value == Approx(0.3));
  CHECK(late.values[5].value == Approx(12.0 / 240));  // false tracks a frame
  CHECK(late.values[6].value == Approx(5.0));         // position: errors in the map, not the place
  CHECK(late.values[7].value == Approx(2.0));
  CHECK(std::isnan(base.values[6].value));

  const Rows rows = difference_rows(d);
  REQUIRE(rows.size() == 3);
  CHECK(rows[0][0] == "less best");
  CHECK(rows[2][1].rfind("-0.0833 (", 0) == 0);
  CHECK(rows[2][1].back() == '*');
  CHECK(rows[2][7] == "-");
  CHECK(difference_section(d).find("id=\"differences\"") != std::string::npos);
  CHECK(nlohmann::json::parse(json_text(d))["contestants"][1]["differences"]["centre_along_m"]["value"] == Approx(0.3));
}

TEST_CASE("differences: a folder's name may hold @ and :, the variants in it are those of sweeps and oracles") {
  const std::string folder = "2026-03-01T10:00@track/";
  std::vector<Run> runs;
  for (const char* name : {"best", "paper", "best@gate.min_points=5", "best:ground"})
    runs.push_back(passes(folder + name, "", 0, 0.2));
  const Differences d = find_differences(runs);
  CHECK(d.base == folder + "best");
  REQUIRE(d.contestants.size() == 2);
  CHECK(of(d, folder + "paper").differences[0].value == 0);
}

TEST_CASE("differences: only logs that all have run on; nothing to compare gives nothing") {
  const Run a = passes("best", "", 0, 0.2), b = passes("paper", "", 1, 0.2),
            more = passes("best", "", 30, 0.2, "other race");
  const Differences d = find_differences({a, b, more});
  CHECK(d.logs == 1);
  CHECK(d.logs_left_out == 1);
  CHECK(of(d, "best").values[0].value == Approx(200.0 / 240));
  CHECK(find_differences({a, b}, "paper").base == "paper");
  CHECK(find_differences({a}).contestants.empty());
  CHECK(difference_section(find_differences({a})).empty());
  CHECK(find_differences({more, b}).contestants.empty());  // no common log
}

TEST_CASE("differences: a log whose truth is not that of the base is left out") {
  const Run base = passes("best", "", 0, 0.2), good = passes("paper", "", 1, 0.2);
  const auto left_out = [&](const std::function<void(Tables&)>& change) {
    Run other = passes("paper", "", 1, 0.2, "second");
    change(other.tables);
    const Differences d = find_differences({base, good, passes("best", "", 0, 0.2, "second"), other});
    CHECK(d.logs + d.logs_left_out == 2);
    return d.logs_left_out;
  };
  const auto shift = [](Tables& tables, const char* table, const char* column, double by) {
    Table& t = tables.at(table);
    t.cells[5 * t.columns.size() + t.column(column)] += by;
  };
  CHECK(left_out([](Tables&) {}) == 0);
  CHECK(left_out([&](Tables& t) { shift(t, "cars", "x_m", 1e-6); }) == 0);  // rounded on another machine
  CHECK(left_out([&](Tables& t) { shift(t, "cars", "detections", 1); }) == 0);
  for (const char* column : {"frame", "car", "x_m", "y_m"})
    CHECK_MESSAGE(left_out([&](Tables& t) { shift(t, "cars", column, 1); }) == 1, column);
  CHECK(left_out([](Tables& t) { t["cars"].cells.resize(t["cars"].columns.size() * 100); }) == 1);  // fewer frames
  // Without another car.
  CHECK(left_out([](Tables& t) { t["ego"].add({kFrames, 0.05 * kFrames, 50, 0}); }) == 1);
  CHECK(left_out([&](Tables& t) { shift(t, "ego", "speed_mps", 1); }) == 1);
}

TEST_CASE("differences: a grid tells what each value costs, over the configurations that differ in nothing else") {
  const auto grid = [](double points, double threshold, int32_t misses, double error_m) {
    const std::string values = "gate.min_points = " + std::to_string(int32_t(points)) +
                               "\ncluster.threshold_deg = " + std::to_string(threshold);
    return passes("p" + std::to_string(int32_t(points)) + "t" + std::to_string(int32_t(threshold)),
                  "preset = best\n" + values, misses, error_m);
  };
  // min_points costs misses, the threshold costs error; (7, 4) was not run.
  const Differences d = find_differences({passes("best", "", 0, 0.2), grid(5, 2, 4, 0.3), grid(5, 4, 4, 0.5),
                                          grid(7, 2, 8, 0.3), grid(9, 2, 0, 0.3), grid(9, 4, 0, 0.5)});
  const auto value = [&](const std::string& parameter, double at) {
    for (const ParameterValue& p : d.parameters)
      if (p.parameter == parameter && p.value == at) return p;
    FAIL("no " << parameter << " " << at);
    return ParameterValue();
  };
  // The preset's own values (3 and 2.8) are one point of the grid: nothing else has one of them alone.
  CHECK(value("gate.min_points", 3).is_reference);
  CHECK(value("gate.min_points", 3).configurations == 1);
  CHECK(value("gate.min_points", 5).configurations == 0);
  CHECK(std::isnan(value("gate.min_points", 5).differences[0].value));

  // Sizes of tables, which every config.toml of a result has, are no parameters.
  const Differences one = find_differences(
      {passes("best", "", 0, 0.2),
       passes("few", "preset = best\ngate.min_points = 4\ncapacities.clusters = 4096\ncapacities.tracks = 256", 4,
              0.3)});
  REQUIRE(one.parameters.size() == 2);
  CHECK(one.parameters[0].parameter == "gate.min_points");
  CHECK(one.parameters[1].value == 4);
  CHECK(one.parameters[1].configurations == 1);

  // Without the preset the least values are the references.
  const Differences e = find_differences(
      {grid(5, 2, 4, 0.3), grid(5, 4, 4, 0.5), grid(7, 2, 8, 0.3), grid(9, 2, 0, 0.3), grid(9, 4, 0, 0.5)});
  CHECK(e.base == "p5t2");
  const auto entry = [&](const std::string& parameter, double at) {
    for (const ParameterValue& p : e.parameters)
      if (p.parameter == parameter && p.value == at) return p;
    FAIL("no " << parameter << " " << at);
    return ParameterValue();
  };
  CHECK(entry("gate.min_points", 5).is_reference);
  CHECK(entry("gate.min_points", 7).configurations == 1);
  CHECK(entry("gate.min_points", 9).configurations == 2);
  CHECK(entry("gate.min_points", 7).differences[0].value == Approx(-20.0 / 240));
  CHECK(entry("gate.min_points", 9).differences[0].value == Approx(20.0 / 240));
  CHECK(entry("gate.min_points", 9).differences[2].value == Approx(0));
  CHECK(entry("cluster.threshold_deg", 4).configurations == 2);
  CHECK(entry("cluster.threshold_deg", 4).differences[2].value == Approx(0.2));
  CHECK(entry("cluster.threshold_deg", 4).differences[0].value == Approx(0));
  CHECK(parameter_rows(e).size() == 6);
  const std::string section = difference_section(e);
  CHECK(section.find("id=\"parameters_cost\"") != std::string::npos);
  CHECK(section.find("change of detected") != std::string::npos);
  CHECK(section.find("<svg") != std::string::npos);
}
