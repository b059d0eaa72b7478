// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// Commands as functions: sinks of a run, `run --truth`, and `inspect` with a method that computes less than paper does.
#include <doctest/doctest.h>

#include <cmath>
#include <filesystem>
#include <stdexcept>

#include "tests/support/bags.h"
#include "tests/support/run_command.h"
#include "tests/support/scene_files.h"
#include "tests/support/temp_folder.h"
#include "tools/cli/frame_sink.h"
#include "tools/cli/truth_sink.h"
#include "tools/client/config.h"
#include "tools/client/session.h"
#include "tools/io/error.h"
#include "tools/io/output.h"
#include "tools/io/scan_stream.h"
#include "tools/io/text.h"
#include "tools/view/frame_picture.h"

using namespace overtake;

namespace {

// Frames without a reader, as the sinks of tables take them.
struct MadeFrame {
  std::vector<float> x_m, y_m;
  std::vector<int32_t> points;
  std::vector<uint64_t> id;
  std::vector<int32_t> state;
  std::vector<double> track_x_m, track_y_m, speed_mps;

  cli::FinishedFrame frame(int64_t number) const {
    cli::FinishedFrame out{nullptr, number, std::nullopt, {}, {}, {}};
    out.info.reference = OVT_REFERENCE_MAP;
    out.detections.count = int32_t(x_m.size());
    out.detections.x_m = x_m.data(), out.detections.y_m = y_m.data(), out.detections.point_count = points.data();
    out.tracks.count = int32_t(id.size());
    out.tracks.id = id.data(), out.tracks.state = state.data();
    out.tracks.x_m = track_x_m.data(), out.tracks.y_m = track_y_m.data(), out.tracks.speed_mps = speed_mps.data();
    return out;
  }
};

bool holds(const std::string& text, const std::string& part) { return text.find(part) != std::string::npos; }

}  // namespace

TEST_CASE("commands: inspect writes the images that the method computes and names the others") {
  const TempFolder folder;
  const std::string scene = folder.path("scene");
  write_scene_files(scene, 1);
  const auto inspect = [&](const std::string& preset) {
    return run_overtake(folder, {"inspect", scene, "--rig", "av21", "--sensor", "front", "--preset", preset, "--out",
                                 folder.path(preset)});
  };
  const auto has = [&](const std::string& file) { return std::filesystem::exists(folder.path(file)); };
  const Outcome plain = inspect("plain");
  CHECK(plain.code == 0);
  CHECK(holds(plain.text, "note: preset plain does not compute angle, angle_smooth, nonground\n"));
  for (const char* image : {"angle", "angle_smooth", "nonground"})
    CHECK_FALSE(has(std::string("plain/") + image + ".png"));
  for (const char* image : {"range", "elevation", "pixel_point", "range_filled", "elevation_filled", "range_repaired",
                            "elevation_repaired", "nonground_repaired", "labels", "strip"})
    CHECK_MESSAGE(has(std::string("plain/") + image + ".png"), image);
  const Outcome paper = inspect("paper");
  CHECK(paper.code == 0);
  CHECK_FALSE(holds(paper.text, "does not compute"));
  CHECK(has("paper/angle.png"));
  CHECK_FALSE(has("paper/height.png"));
  const Outcome best = inspect("best");
  CHECK(best.code == 0);
  CHECK(holds(best.text, "note: preset best does not compute angle, angle_smooth\n"));
  CHECK(has("best/height.png"));
  CHECK(has("best/height.npy"));
}

TEST_CASE("commands: evaluate judges a method that lacks images, run shows it") {
  const TempFolder folder;
  // A car 18 m ahead: near enough for the pictures of a scan's steps.
  const std::string scenario = folder.write("near.toml",
                                            "name = \"near\"\ntrack = \"oval\"\nseconds = 0.5\n"
                                            "[[car]]\nname = \"ego\"\nstart_s_m = 900\n"
                                            "[[car]]\nname = \"other\"\nstart_s_m = 918\n");
  const std::string log = folder.path("log.mcap");
  REQUIRE(run_overtake(folder, {"simulate", scenario, "--out", log, "--quiet"}).code == 0);
  CHECK(run_overtake(folder, {"run", log, "--preset", "plain", "--out", folder.path("run"), "--mcap",
                              folder.path("run/view.mcap")})
            .code == 0);
  for (const char* preset : {"plain", "paper"}) {
    const std::string out = folder.path(std::string("judged_") + preset);
    CHECK(run_overtake(folder, {"evaluate", log, "--preset", preset, "--quiet", "--out", out}).code == 0);
    const bool has_strip =
        io::read_whole_file(out + "/report.html").find("the scan with most points") != std::string::npos;
    CHECK(has_strip == (std::string(preset) == "paper"));
  }
}

TEST_CASE("commands: info counts every message that does not fit its type, and means the points of the others") {
  const TempFolder folder;
  std::vector<test::Recorded> messages = test::straight_drive("/ego/odometry", 0, 50'000'000);
  for (int64_t stamp_ns = 0; stamp_ns < 3; ++stamp_ns)
    messages.push_back(test::cloud_of(test::swept_cloud(8, 20, 0), "/front/points", stamp_ns));
  messages[1].data.resize(messages[1].data.size() / 2);
  messages.back().data.resize(60);
  test::write_db3(folder.path("log.db3"), messages);
  const Outcome info = run_overtake(folder, {"info", folder.path("log.db3")});
  CHECK(holds(info.text, "/ego/odometry: 1 message does not fit its type"));
  CHECK(holds(info.text, "/front/points: 1 message does not fit its type"));
  CHECK(holds(info.text, "/front/points: 158 points a cloud"));
}

TEST_CASE("commands: evaluate of a damaged log ends with 3, after the report, each time and also with --tune") {
  const TempFolder folder;
  const std::string log = folder.path("log.mcap"), cut = folder.path("cut.mcap"), out = folder.path("out");
  REQUIRE(run_overtake(folder, {"simulate", "overtake", "--seconds", "0.5", "--out", log, "--quiet"}).code == 0);
  const std::string text = io::read_whole_file(log);
  io::write_whole_file(cut, text.substr(0, text.size() / 2));
  const auto evaluate = [&](std::vector<std::string> words) {
    words.insert(words.begin(), "evaluate");
    words.insert(words.end(), {"--quiet", "--out", out});
    return run_overtake(folder, words).code;
  };
  CHECK(evaluate({log, "--preset", "paper", "--only-figures"}) == 0);
  CHECK(evaluate({log, cut, "--preset", "paper", "--only-figures"}) == 3);
  CHECK(std::filesystem::exists(out + "/runs/paper/cut/about.json"));
  CHECK(holds(io::read_whole_file(out + "/report.html"), "cut off: "));
  CHECK(evaluate({cut, "--preset", "paper", "--only-figures"}) == 3);  // done before
  CHECK(evaluate({cut, "--preset", "paper", "--only-figures", "--frames", "1"}) == 0);
  CHECK(evaluate({log, "--tune", "--frames", "1"}) == 0);
  CHECK(evaluate({cut, "--tune", "--every", "100"}) == 3);
}

TEST_CASE("commands: what a sink throws ends the frames and reaches the caller") {
  struct Sink : cli::FrameSink {
    int32_t frames = 0, ends = 0;
    bool throws = false;
    void add(const cli::FinishedFrame& frame) override {
      CHECK(frame.number == frames);
      CHECK(frame.info.point_count > 0);
      if (++frames == 2 && throws) throw std::runtime_error("full");
    }
    void finish() override { ++ends; }
  };
  const TempFolder folder;
  write_scene_files(folder.path("scene"), 4);
  for (const bool throws : {false, true}) {
    Sink first, second;
    first.throws = throws;
    cli::FrameSinks sinks({&first, &second});
    cli::Options options;
    options.command = "run", options.input = folder.path("scene"), options.rig = "av21";
    const cli::Config config = cli::load_config_with_rig(options);
    cli::Session session(config, &cli::FrameSinks::on_frame, &sinks);
    const auto stream = io::open_scans(config.input, config.rig);
    io::FrameScans scans;
    while (stream->next(scans)) {
      sinks.announce(scans);
      session.push(scans);
    }
    session.flush();
    CHECK(first.frames == (throws ? 2 : 4));
    CHECK(second.frames == (throws ? 1 : 4));
    if (throws)
      CHECK_THROWS_WITH(sinks.rethrow_failure(), "full");
    else
      CHECK_NOTHROW(sinks.rethrow_failure());
    sinks.finish();
    CHECK(first.ends + second.ends == 2);
  }
}

TEST_CASE("commands: a picture names a track as the tables do") {
  CHECK(cli::track_label((uint64_t(3) << 32) + 17, 38.24) == "17:3  38.2 m/s");
}

TEST_CASE("commands: --rate waits for no hour by which the stamps jump") {
  const TempFolder folder;
  constexpr int64_t kHourNs = 3'600'000'000'000, kPeriodNs = 50'000'000;
  std::vector<test::Recorded> messages;
  for (int64_t k = 0; k < 9; ++k)  // an hour forward, and back
    messages.push_back(test::cloud_of(test::swept_cloud(8, 40, 0.1 * double(k)), "/front/points",
                                      kHourNs + k * kPeriodNs + (k >= 3 && k < 6 ? kHourNs : 0)));
  test::write_mcap(folder.path("a.mcap"), messages);
  folder.write("rig.toml", io::format_rig(test::swept_rig(8)));
  const Outcome outcome = run_overtake(folder, {"run", folder.path("a.mcap"), "--rig", folder.path("rig.toml"),
                                                "--rate", "1", "--out", folder.path("out")});
  CHECK(outcome.code == 0);
  CHECK(outcome.text.find("frames. Written to ") != std::string::npos);
}

TEST_CASE("commands: --truth pairs each other car with the nearest detection and confirmed track") {
  const TempFolder folder;
  const std::string path = folder.path("truth.csv");
  io::write_whole_file(path,
                       "frame,name,is_ego,x_m,y_m,ego_x_m,ego_y_m,speed_mps\n"
                       "7,me,1,100,0,0,0,60\n7,other,0,130,2,30,2,50\n8,other,0,131,2,31,2,50\n");
  const auto truth = cli::read_truth(path);
  REQUIRE(truth.size() == 2);
  REQUIRE(truth.at(7).size() == 1);  // without the ego vehicle
  CHECK(truth.at(7)[0].ahead_m == 30);
  CHECK(truth.at(7)[0].x_m == 130);

  cli::TruthSink sink(path);
  const MadeFrame seen{{40, 30.5f, 32},
                       {0, 2, 2},
                       {5, 6, 7},
                       {9, (uint64_t(1) << 32) | 4, 8},
                       {OVT_TENTATIVE, OVT_CONFIRMED, OVT_CONFIRMED},
                       {130, 131, 160},
                       {2, 2, 2},
                       {1, 49, 2}};
  const MadeFrame far{{34.1f}, {2}, {5}, {9}, {OVT_CONFIRMED}, {137}, {2}, {1}};
  sink.add(seen.frame(6));  // of which the truth says nothing
  CHECK(sink.frame_count() == 0);
  sink.add(seen.frame(7));
  sink.add(far.frame(8));
  CHECK(sink.frame_count() == 2);
  const std::string text = sink.format();
  CAPTURE(text);
  CHECK(holds(text, "  30.50       2.00   0.50       6\n"));  // not the first, not the last detection
  CHECK(holds(text, "31.00       2.00          -          -      -       -\n"));
  CHECK(holds(text, "Found 1 of 2, off by 0.50 m at the median.\n"));
  CHECK(holds(text, "  4:1   1.00            50.00            49.00\n"));  // the tentative one on the spot is not it
}

TEST_CASE("commands: --truth shows every 10th frame of many") {
  const TempFolder folder;
  std::string csv = "frame,ego_x_m,ego_y_m\n";
  for (int32_t k = 0; k < 30; ++k) csv += std::to_string(k) + ",10,0\n";
  io::write_whole_file(folder.path("truth.csv"), csv);
  cli::TruthSink sink(folder.path("truth.csv"));
  const MadeFrame seen{{10}, {0}, {5}, {}, {}, {}, {}, {}};
  for (int64_t k = 0; k < 30; ++k) sink.add(seen.frame(k));
  const std::string text = sink.format();
  CHECK(holds(text, "\n     20 "));
  CHECK_FALSE(holds(text, "\n     25 "));
  CHECK(holds(text, "Found 30 of 30"));
  CHECK_FALSE(holds(text, "The tracks"));  // no place in the map is known
}

TEST_CASE("commands: --truth own is where the recording says that the opponent is") {
  cli::TruthSink sink(cli::TruthSink::kOwnTruth);
  const MadeFrame seen{{10.25f}, {0}, {5}, {}, {}, {}, {}, {}};
  cli::FinishedFrame frame = seen.frame(3);
  sink.add(frame);
  CHECK(sink.frame_count() == 0);
  frame.opponent = io::Box{};
  frame.opponent->x_m = 10;
  sink.add(frame);
  CHECK(sink.frame_count() == 1);
  CHECK(holds(sink.format(), "Found 1 of 1, off by 0.25 m"));
}
