// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// The visible results of an evaluation: pictures of single moments, and a complete report.
#include <doctest/doctest.h>

#include <cmath>
#include <filesystem>
#include <set>

#include "tests/support/simulated_race.h"
#include "tests/support/temp_folder.h"
#include "tools/evaluation/first_seen.h"
#include "tools/evaluation/report.h"
#include "tools/evaluation/report_html.h"
#include "tools/evaluation/run_logs.h"
#include "tools/evaluation/snapshot_picker.h"
#include "tools/evaluation/svg_plot.h"
#include "tools/io/error.h"
#include "tools/io/mcap_reader.h"
#include "tools/io/text.h"
#include "tools/view/svg.h"

using namespace overtake;
using namespace overtake::evaluation;
using doctest::Approx;

namespace {

std::size_t count_of(const std::string& text, const std::string& word) {
  std::size_t count = 0;
  for (std::size_t at = 0; (at = text.find(word, at)) != std::string::npos; at += word.size()) ++count;
  return count;
}

// All strings between `before` and the next quote.
std::set<std::string> all_after(const std::string& text, const std::string& before) {
  std::set<std::string> out;
  for (std::size_t at = 0; (at = text.find(before, at)) != std::string::npos;) {
    at += before.size();
    out.insert(text.substr(at, text.find('"', at) - at));
  }
  return out;
}

void simulate(const std::string& scenario_name, double seconds, const std::string& path) {
  test::write_race(sim::load_scenario(scenario_name), 1, seconds, path);
}

}  // namespace

TEST_CASE("svg: numbers are short, a tick has the digits of its step") {
  CHECK(cli::svg_number(1.5) == "1.5");
  CHECK(cli::svg_number(-0.001) == "0");
  CHECK(cli::svg_number(100) == "100");
  CHECK(cli::svg_number(2.346) == "2.35");
  const std::string plot = line_plot({"t", "x", "y", 0, 15}, {{"s", "red", {0, 15}, {0, 15}, {}, {}, true, false}});
  for (const char* tick : {">2.5<", ">5.0<", ">12.5<"}) CHECK(plot.find(tick) != std::string::npos);
}

TEST_CASE("rig picture: shows the AV-21's blind strips, 0.82 m in front and 0.53 m behind, and marks an overlap") {
  io::Rig rig = io::load_rig("av21");
  const std::string picture = draw_rig(rig, 4.921, 1.886);
  CHECK(count_of(picture, "blind 0.82 m") == 2);
  CHECK(count_of(picture, "blind 0.53 m") == 1);
  rig.sensors[1].x_m += 2;  // the left sensor, now in front of the front one
  CHECK(count_of(draw_rig(rig, 4.921, 1.886), "overlap") == 1);
}

TEST_CASE("fits: each panel names the chosen rectangle and its number of points") {
  FitMoment m;
  m.points = {{20.0f, 1.0f}, {20.5f, 1.0f}, {21.0f, 1.2f}};
  m.truth = m.by_map = {20, 1, 0, 4.9, 1.9};
  m.by_points = {20, 1, 0.5, 4.9, 1.9};
  m.inside_map = 2, m.inside_points = 3, m.points_chosen = true;
  FitMoment other = m;
  other.points_chosen = false;
  const std::string picture = draw_fits({m, other});
  CHECK(picture.find("psi_REF 2, psi_VAR 3 of 3; taken: psi_VAR") != std::string::npos);
  CHECK(picture.find("taken: psi_REF") != std::string::npos);
  CHECK(count_of(picture, "<circle") == 6);
  CHECK(count_of(picture, "<polygon") == 6);
  CHECK(picture.find("A simulated car") != std::string::npos);
  CHECK(draw_fits({m, other}, false).find("imulated") == std::string::npos);
}

TEST_CASE("clustering: shows truth and the paper's rule for both parameters, and two cars in one cluster") {
  Figures f;
  f.variant = "paper", f.scenario = "hand", f.surface_known = true, f.most_cars = 2, f.closest_cars_m = 3.5;
  f.clusters_per_car = {2, 1}, f.boxed_per_car = {1, 1}, f.mixed_other = f.mixed_cars = f.mixed_by_size = {0, 0};
  for (const double radius : {0.5, 2.0}) {
    f.euclid_clusters[radius] = f.euclid_boxed[radius] = {1, 3};
    f.euclid_mixed[radius] = f.euclid_mixed_cars[radius] = f.euclid_mixed_by_size[radius] = {0, 0};
  }
  Figures swept = f;
  swept.variant = "paper@cluster.threshold_deg=4";
  const std::string none = clustering_section({f, swept}, f);
  for (const char* title :
       {"(a) Clusters per car", "(b) Mixed with other", "(c) Clusters in a car's box", "(d) Longer than a car"})
    for (const char* of : {": proposed<", ": Euclidean<"})
      CHECK_MESSAGE(none.find(cli::escape_xml(title) + of) != std::string::npos, title);
  CHECK(none.find("3.5 m or more between their middles): none, by either method") != std::string::npos);
  CHECK(none.find("(e)") == std::string::npos);
  f.euclid_mixed_cars[2.0] = {1, 0};
  const std::string some = clustering_section({f, swept}, f);
  CHECK(some.find("(e) Two cars in one: proposed<") != std::string::npos);
  CHECK(some.find("(e) Two cars in one: Euclidean<") != std::string::npos);
  f.most_cars = 1;
  CHECK(clustering_section({f}, f).find("no log with two opponents at once") != std::string::npos);
}

TEST_CASE("legend: stands above the frame on request, and a line without a name has no entry") {
  const Series line{"name of it", "red", {0, 1}, {0, 1}, {}, {}, true, false};
  Axes axes{"t", "x", "y"};
  CHECK(line_plot(axes, {line}).find("y=\"16\" text-anchor=\"end\"") == std::string::npos);
  axes.legend_above = true;
  const std::string above = line_plot(axes, {line});
  CHECK(above.find("y=\"16\" text-anchor=\"end\"") != std::string::npos);
  CHECK(count_of(above, "name of it") == 1);
  Series nameless = line;
  nameless.name = "";
  CHECK(count_of(line_plot({"t", "x", "y"}, {nameless}), "stroke-width=\"3\"") == 0);
  CHECK(count_of(line_plot({"t", "x", "y"}, {line}), "stroke-width=\"3\"") == 1);
}

TEST_CASE("pictures: of one name the highest score is shown, and a damaged list is reported") {
  const TempFolder folder;
  const std::string a = folder.path("a"), b = folder.path("b"), none = folder.path("none");
  write_pictures(a, {{"strip", "<svg>low</svg>", "low", 3}, {"rig", "<svg>first</svg>", "first", 0}}, "a.mcap");
  write_pictures(
      b, {{"strip", "<svg>high</svg>", "high", 5, {1700000000000025378, 7}}, {"rig", "<svg>second</svg>", "second", 0}},
      "b.mcap");
  const auto best = best_pictures({a, b, none});
  CHECK(best.size() == 2);
  CHECK(best.at("strip").svg == "<svg>high</svg>");
  CHECK(best.at("strip").caption == "b, high");
  CHECK(best.at("strip").stamps_ns == std::vector<int64_t>{1700000000000025378, 7});
  CHECK(best.at("strip").path == "b.mcap");
  CHECK(best.at("rig").svg == "<svg>first</svg>");
  CHECK(best.at("rig").stamps_ns.empty());
  copy_pictures(a, none);
  CHECK(best_pictures({none}).at("strip").svg == "<svg>low</svg>");
  io::write_whole_file(b + "/pictures/pictures.json", "[{]");
  CHECK_THROWS_WITH_AS(best_pictures({a, b}), doctest::Contains("pictures.json"), io::Error);
}

TEST_CASE("report: a picture of single moments names the commands that show them, safe in a shell and in HTML") {
  Run run{"paper:clusters", "log", {{"scenario", "spin_near"}, {"seed", "7"}, {"simulated", "true"}}, make_tables()};
  NamedPicture strip{"strip", "<svg>s</svg>", "c", 1, {1700000000000025378}, "log", "out/spin near's <b>.mcap"};
  NamedPicture race{"race", "<svg>r</svg>", "c", 1, {}, "log", ""};
  const std::string html = picture_section({{"strip", strip}, {"race", race}}, Figures(), {run});
  const std::string word = "'out/spin near'\\''s &lt;b&gt;.mcap'";
  CHECK(html.find("<pre>overtake view " + word + " --at 1700000000000025378\n</pre>") != std::string::npos);
  CHECK(html.find("overtake run " + word + " --preset paper --mcap FILE; overtake simulate spin_near --seed 7") !=
        std::string::npos);
  CHECK(count_of(html, "<pre>") == 1);
  CHECK(html.find("<b>") == std::string::npos);
}

TEST_CASE("first seen: runs from a car's first row in reach to its first detection and its confirmed track") {
  Run run{"paper", "log", {{"scenario", "hand"}}, make_tables()};
  const auto add = [&](double time, double car, double ahead, double detections, double confirmed) {
    run.tables["cars"].add({0, time, car, ahead, 0, 0, 0, 20, 1, 1, detections, 0, confirmed});
  };
  add(0.0, 1, 160, 0, 0);  // too far away
  add(1.0, 1, 140, 0, 0);
  add(1.0, 2, 50, 1, 0);
  add(1.5, 1, 120, 1, 0);
  add(2.0, 1, 100, 0, 1);
  add(2.5, 1, 80, 1, 1);
  add(2.5, 3, 20, 0, 0);  // never detected
  const FirstSeen first = first_seen({run}, "paper", "hand");
  CHECK(first.detected_s.count == 2);
  CHECK(first.detected_s.least == Approx(0));
  CHECK(first.detected_s.most == Approx(0.5));
  CHECK(first.confirmed_m.count == 1);
  CHECK(first.confirmed_m.mean == Approx(100));
  CHECK(first_seen({run}, "paper", "other").detected_s.count == 0);
}

TEST_CASE("report: covers each figure of the paper, loads nothing, and is the same after a merge") {
  const TempFolder folder;
  const std::string log = folder.path("spin_near.mcap"), out = folder.path("out");
  simulate("spin_near", 1.0, log);
  RunOptions options;
  options.logs = {log};
  options.presets = {"paper", "paper:ego"};
  options.out = out;
  options.quiet = true;
  REQUIRE(run_logs(options));
  const std::string pictures = out + "/runs/paper/spin_near/pictures/";
  for (const char* name : {"race", "sensors"}) CHECK(std::filesystem::exists(pictures + name + ".svg"));
  CHECK(!std::filesystem::exists(out + "/runs/paper+ego/spin_near/pictures"));  // the title is not a file name
  write_report(out, false);
  const std::string html = io::read_whole_file(out + "/report.html");

  // Every link has its target, and every figure of the paper has a link.
  const std::set<std::string> links = all_after(html, "href=\"#"), places = all_after(html, "id=\"");
  for (const std::string& link : links) CHECK_MESSAGE(places.count(link) == 1, link);
  for (const char* figure : {"race", "ways", "blocks", "strip", "clouds", "fits", "sensors", "times", "ground",
                             "clustering", "detection", "errors", "parameters", "claims", "cost", "scenarios"})
    CHECK_MESSAGE(links.count(figure) == 1, figure);
  for (const std::string& target : all_after(html, "href=\""))
    CHECK((target[0] == '#' || target.rfind("data:image/png;base64,", 0) == 0));
  for (const char* fetching : {"src=", "<script", "<link", "@import", "url(http"})
    CHECK_MESSAGE(html.find(fetching) == std::string::npos, fetching);
  CHECK(html.find("prefers-color-scheme:dark") != std::string::npos);
  CHECK(html.find("class=\"simulated\"") != std::string::npos);
  CHECK(html.find(">nan<") == std::string::npos);
  CHECK(html.find("=\"nan\"") == std::string::npos);

  merge_runs({out}, folder.path("merged"));
  write_report(folder.path("merged"), false);
  CHECK(io::read_whole_file(folder.path("merged") + "/report.html") == html);
}

TEST_CASE("snapshots: the picker finds the strip, the seam and the spin of a simulated race" *
          doctest::test_suite("long")) {
  const TempFolder folder;
  const std::string log = folder.path("spin_near.mcap"), out = folder.path("out");
  simulate("spin_near", 5.5, log);
  RunOptions options;
  options.logs = {log};
  options.presets = {"paper"};
  options.out = out;
  options.quiet = true;
  REQUIRE(run_logs(options));
  const auto pictures = best_pictures({out + "/runs/paper/spin_near"});
  REQUIRE(pictures.count("strip") == 1);
  REQUIRE(pictures.count("clouds") == 1);
  REQUIRE(pictures.count("fits") == 1);
  CHECK(count_of(pictures.at("strip").svg, "data:image/png;base64,") == 2 + 5 + 5);  // clouds, images, scales
  CHECK(count_of(pictures.at("clouds").svg, "data:image/png;base64,") == 2);
  CHECK(count_of(pictures.at("fits").svg, "true slip angle") == 3);
  // Each is a frame of the recording: of one of its clouds.
  std::set<int64_t> stamps;
  io::McapReader reader(log);
  io::McapMessage message;
  while (reader.next(message)) stamps.insert(message.publish_ns);
  for (const char* name : {"strip", "clouds", "fits"}) {
    CHECK(pictures.at(name).stamps_ns.size() == (name == std::string("fits") ? 3 : 1));
    for (const int64_t stamp_ns : pictures.at(name).stamps_ns) CHECK(stamps.count(stamp_ns) == 1);
  }
  write_report(out, false);
  const std::string html = io::read_whole_file(out + "/report.html");
  CHECK(count_of(html, "\n</pre>") >= 3);
  CHECK(html.find("overtake view " + log + " --at " + std::to_string(pictures.at("clouds").stamps_ns[0])) !=
        std::string::npos);
}
