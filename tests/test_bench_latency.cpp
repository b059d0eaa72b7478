// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// What bench_latency counts and writes; the test never checks a time.
#include <doctest/doctest.h>

#include <nlohmann/json.hpp>
#include <set>
#include <stdexcept>
#include <string>
#include <vector>

#include "bench/latency_options.h"
#include "bench/latency_report.h"
#include "bench/measuring_thread.h"
#include "tests/support/temp_folder.h"
#include "tools/io/error.h"

namespace overtake::bench {
namespace {

ParsedOptions parse(std::vector<const char*> words) {
  words.insert(words.begin(), "bench_latency");
  return parse_latency_options(int(words.size()), words.data());
}

// A few small frames at full speed.
LatencyRunDef short_run() {
  LatencyRunDef def;
  def.frames = 8;
  def.warmup = 3;
  def.workers = 1;
  def.noise_window_ns = 10'000;
  return def;
}
const LatencyInput& small_scene() {
  static const LatencyInput input([] {
    ReplayDef def;
    def.scene_frames = 4;
    return def;
  }());
  return input;
}

TEST_CASE("bench_latency: reads lists and ranges of CPUs and refuses invalid ones") {
  CHECK(parse_cpus("3") == std::vector<int32_t>{3});
  CHECK(parse_cpus("2,0") == std::vector<int32_t>{2, 0});
  CHECK(parse_cpus("0-2,7") == std::vector<int32_t>{0, 1, 2, 7});
  for (const char* bad : {"", "a", "1,", "-1", "1-", "2-1", "1,1", "0-2,1", "99999", "1 2"}) {
    CAPTURE(bad);
    CHECK_THROWS_AS(parse_cpus(bad), std::invalid_argument);
  }
}

TEST_CASE("bench_latency: the command line reaches the run, and a wrong one ends with exit code 2") {
  const ParsedOptions parsed = parse({"--loop",
                                      "open",
                                      "--rate",
                                      "40",
                                      "--cpus",
                                      "0,1",
                                      "--fifo",
                                      "20",
                                      "--isa",
                                      "ref",
                                      "--workers",
                                      "3",
                                      "--spin-us",
                                      "50",
                                      "--cold",
                                      "--lock",
                                      "--huge",
                                      "--frames",
                                      "12",
                                      "--warmup",
                                      "4",
                                      "--deadline-us",
                                      "1.5",
                                      "--json",
                                      "--hgrm",
                                      "a.hgrm",
                                      "--out",
                                      "a.json",
                                      "--stagger-us",
                                      "7"});
  REQUIRE(parsed.run);
  const LatencyRunDef& run = parsed.options.run;
  CHECK_FALSE(run.closed_loop);
  CHECK(parse({"--loop", "closed"}).options.run.closed_loop);
  CHECK(run.rate_hz == 40);
  CHECK(run.cpus == std::vector<int32_t>{0, 1});
  CHECK(run.fifo_priority == 20);
  CHECK(run.isa == "ref");
  CHECK(run.workers == 3);
  CHECK(run.spin_us == 50);
  CHECK(run.cold);
  CHECK(run.memory == (OVT_MEMORY_LOCK | OVT_MEMORY_HUGE));
  CHECK(run.frames == 12);
  CHECK(run.warmup == 4);
  CHECK(run.deadline_ns == 1500);
  CHECK(run.stagger_us == 7);
  CHECK(run.pieces == 0);
  CHECK(parse({"--stream"}).options.run.pieces == 32);
  CHECK(parse({"--stream", "--pieces", "5", "--preset", "best"}).options.run.pieces == 5);
  CHECK(parse({"--preset", "best"}).options.run.preset == "best");
  CHECK(run.parts == 0);
  CHECK(parse({"--parts", "2"}).options.run.parts == 2);
  CHECK(parse({"--pieces", "5"}).options.run.pieces == 0);
  CHECK_FALSE(parse({"--stream", "--loop", "closed"}).run);
  CHECK(parsed.options.json);
  CHECK(parsed.options.hgrm == "a.hgrm");
  CHECK(parsed.options.out == "a.json");

  const ParsedOptions plain = parse({});
  REQUIRE(plain.run);
  CHECK_FALSE(plain.options.run.closed_loop);
  CHECK(plain.options.input.recording.empty());
  CHECK(parse({"--help"}).exit_code == 0);
  CHECK_FALSE(parse({"--help"}).run);
  for (const std::vector<const char*>& bad : {std::vector<const char*>{"--cpus", "x"},
                                              {"--frames", "0"},
                                              {"--fifo", "100"},
                                              {"--loop", "round"},
                                              {"--fly"},
                                              {"--rate", "-1"},
                                              {"--map", "track.csv"}}) {
    CAPTURE(bad[0]);
    CHECK_FALSE(parse(bad).run);
    CHECK(parse(bad).exit_code == 2);
    CHECK_FALSE(parse(bad).text.empty());
  }
}

TEST_CASE("bench_latency: histograms hold every frame once and a sensor's stages once per scan, without the warm-up") {
  for (const bool closed : {true, false})
    for (const int32_t workers : {1, 2}) {
      CAPTURE(closed);
      CAPTURE(workers);
      LatencyRunDef def = short_run();
      def.closed_loop = closed;
      def.workers = workers;
      def.rate_hz = 4;  // slow enough for a busy machine
      const LatencyRun run = run_latency(small_scene(), def);
      const LatencyReport report = make_report(run, def);
      CHECK(run.stats.pushed == 3 * 11);
      CHECK(run.stats.used + run.stats.dropped + run.stats.late == run.stats.pushed);
      CHECK(run.stats.exceptions == 0);
      CHECK(run.stats.ego_dropped == 0);
      CHECK(report.end_to_end.count() + report.missing == 8);
      CHECK(report.warmup.count() <= 3);
      CHECK(report.noise.count() == 8);
      CHECK(report.late.count() == (closed ? 0 : 8));
      if (run.stats.used < run.stats.pushed || report.incomplete > 0)
        continue;  // the machine stopped for a quarter of a second
      CHECK(report.warmup.count() == 3);
      CHECK(report.warmup_first_ns > 0);
      std::set<std::string> names;
      for (const StageHistogram& stage : report.stages) {
        CAPTURE(stage.name);
        names.insert(stage.name);
        const bool whole = stage.name == "merge" || stage.name == "gate" || stage.name == "pose" ||
                           stage.name == "track" || stage.name == "frame" || stage.name == "gather" ||
                           stage.name == "publish";
        CHECK(stage.histogram.count() == (whole ? 8 : 24));
        CHECK(stage.histogram.max() <= report.end_to_end.max());
      }
      for (int32_t i = 0; i < OVT_STAGE_COUNT; ++i) CHECK(names.count(ovt_stage_name(i)) == 1);
      for (const char* name : {"wake_driver", "hand_over", "gather", "publish"}) CHECK(names.count(name) == 1);
    }
}

TEST_CASE("bench_latency: scans in pieces are whole frames, and their latency begins with the last piece") {
  for (const int32_t workers : {1, 2}) {
    CAPTURE(workers);
    LatencyRunDef def = short_run();
    def.workers = workers;
    def.rate_hz = 4;
    def.pieces = 5;
    def.preset = "best";
    const LatencyRun run = run_latency(small_scene(), def);
    const LatencyReport report = make_report(run, def);
    CHECK(run.stats.pushed == 3 * 11);
    CHECK(run.stats.pieces == 3 * 11 * 5);
    CHECK(run.stats.pieces_used == 3 * 11 * 5);
    CHECK(run.stats.scans_incomplete == 0);
    CHECK(report.end_to_end.count() + report.missing == 8);
    CHECK(report.floor.count() == 8);
    if (run.stats.used < run.stats.pushed || report.incomplete > 0) continue;
    for (const StageHistogram& stage : report.stages) {
      CAPTURE(stage.name);
      CHECK(stage.name != "wake_driver");
      if (stage.name == "last_piece") CHECK(stage.histogram.count() == 24);
    }
    int32_t early = 0;  // their first piece came before the last one was due, unless the machine was late by a period
    for (std::size_t k = 0; k < run.frames.size(); ++k)
      for (int32_t s = 0; s < 3; ++s) {
        const int64_t load_ns = run.span(k, s, OVT_STAGE_LOAD).start_ns;
        early += load_ns < run.frames[k].due_ns;
        CHECK(load_ns < run.span(k, s, OVT_STAGE_SEGMENT).start_ns);
        CHECK(run.span(k, s, OVT_STAGE_SEGMENT).start_ns >= run.frames[k].due_ns);
      }
    CHECK(early > 0);
  }
}

TEST_CASE("bench_latency: the JSON holds percentiles, every stage, the noise and the environment") {
  const LatencyRunDef def = [] {
    LatencyRunDef d = short_run();
    d.closed_loop = true;
    d.isa = "ref";
    return d;
  }();
  const LatencyRun run = run_latency(small_scene(), def);
  const LatencyReport report = make_report(run, def);
  const EnvironmentSheet environment = read_environment(0);
  const auto json = nlohmann::json::parse(format_json(report, run, def, small_scene().source(), environment));
  const auto check_times = [](const nlohmann::json& times) {
    double last = 0;
    for (const char* key : {"min_us", "p50_us", "p90_us", "p99_us", "p999_us", "max_us"}) {
      CAPTURE(key);
      REQUIRE(times.at(key).is_number());
      CHECK(times.at(key).get<double>() >= last);
      last = times.at(key).get<double>();
    }
  };
  check_times(json.at("end_to_end"));
  CHECK(json.at("end_to_end").at("count") == 8);
  CHECK(json.at("end_to_end").at("min_us").get<double>() > 0);
  check_times(json.at("warmup"));
  CHECK(json.at("warmup").at("count") == 3);
  for (const char* name : {"load", "segment", "merge", "track", "frame"}) check_times(json.at("stages").at(name));
  for (const char* name : {"late", "stolen", "late_and_stolen"}) check_times(json.at("noise").at(name));
  CHECK(json.at("frames").at("published") == 8);
  CHECK(json.at("runtime").at("isa") == "ref");
  CHECK(json.at("runtime").at("policy").is_string());
  for (const char* name : {"cpu", "governor", "kernel", "isolated", "nohz_full", "commit"})
    CHECK_FALSE(json.at("environment").at(name).get<std::string>().empty());

  const std::string text = format_text(report, run, def, small_scene().source(), environment);
  for (const char* word : {"end to end", "segment", "late + stolen", "warm-up", "governor: ", "policy: "})
    CHECK(text.find(word) != std::string::npos);
}

TEST_CASE("bench_latency: caches are evicted between frames only with --cold") {
  LatencyRunDef def = short_run();
  def.closed_loop = true;
  CHECK(run_latency(small_scene(), def).evicted_bytes == 0);
  def.cold = true;
  CHECK(run_latency(small_scene(), def).evicted_bytes > largest_cache_bytes());
}

TEST_CASE("bench_latency: a run reports the library's refusals") {
  LatencyRunDef def = short_run();
  def.isa = "mmx";
  CHECK_THROWS_WITH_AS(run_latency(small_scene(), def), doctest::Contains("mmx"), io::Error);
  def = short_run();
  def.cpus = {900};
  CHECK_THROWS_WITH_AS(run_latency(small_scene(), def), doctest::Contains("CPU 900"), io::Error);
  def = short_run();
  def.stagger_us = 30'000;
  CHECK_THROWS_AS(run_latency(small_scene(), def), io::Error);
}

TEST_CASE("bench_latency: poses of a repeated input have increasing stamps") {
  std::vector<ovt_ego_pose> poses;
  int64_t last_ns = -1;
  for (int64_t k = 0; k < 11; ++k) {
    small_scene().poses(k, poses);
    for (const ovt_ego_pose& pose : poses) {
      CHECK(pose.stamp_ns > last_ns);
      last_ns = pose.stamp_ns;
    }
    CHECK(last_ns == (k + 1) * small_scene().period_ns());
  }
}

}  // namespace
}  // namespace overtake::bench
