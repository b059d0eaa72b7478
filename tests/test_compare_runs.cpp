// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// overtake compare: two runs written by hand, whose matches are counted in the rows; bad folders and tables.
#include <doctest/doctest.h>

#include <cmath>
#include <nlohmann/json.hpp>

#include "tests/support/temp_folder.h"
#include "tools/cli/compare_runs.h"
#include "tools/cli/report_json.h"
#include "tools/io/error.h"

using namespace overtake;
using namespace overtake::cli;
using doctest::Approx;

namespace {

const char* const kDetections = "frame,stamp_ns,x_m,y_m,z_m,heading_rad\n";
const char* const kTracks = "stamp_ns,id,state,frame,x_m,y_m,speed_mps,ahead_m,left_m,name\n";

std::string line(std::initializer_list<std::string> cells) {
  std::string out;
  for (const std::string& cell : cells) out += (out.empty() ? "" : ",") + cell;
  return out + "\n";
}

// Stamp of frame k of a recording at 20 Hz.
std::string stamp(int64_t k) { return std::to_string(1'000'000'000'000 + k * 50'000'000); }

std::string track(int64_t k, int64_t id, const char* state, double x_m, double y_m, double speed_mps) {
  return line({stamp(k), std::to_string(id), state, std::to_string(k), std::to_string(x_m), std::to_string(y_m),
               std::to_string(speed_mps), "12.5", "", "-"});
}

}  // namespace

TEST_CASE("compare: detections match the nearest one of the same frame within 2 m, each once") {
  const TempFolder folder;
  folder.write("a/tracks.csv", kTracks), folder.write("b/tracks.csv", kTracks);
  // Frame 0: two of A near one of B, of which the nearer one counts. Frame 1: 2.1 m apart. Frame 2: only in B.
  folder.write("a/detections.csv", kDetections + line({"0", stamp(0), "10", "0", "0", "3.1"}) +
                                       line({"0", stamp(0), "10.5", "0", "0", "3.1"}) +
                                       line({"1", stamp(1), "20", "0", "0", "0"}));
  folder.write("b/detections.csv", kDetections + line({"0", stamp(0), "10.8", "0.4", "0", "-3.1"}) +
                                       line({"1", stamp(1), "20", "2.1", "0", "0"}) +
                                       line({"2", stamp(2), "30", "0", "0", "0"}));
  const RunComparison c = compare_runs(read_run(folder.path("a")), read_run(folder.path("b")));
  CHECK(c.a.detections == 3);
  CHECK(c.b.detections == 3);
  CHECK(c.a.frames_with_detections == 2);
  CHECK(c.b.frames_with_detections == 3);
  CHECK(c.a.lone_detections == 2);
  CHECK(c.b.lone_detections == 2);
  CHECK(c.detection_distance_m.count == 1);
  CHECK(c.detection_distance_m.median == Approx(0.5));
  CHECK(c.detection_turn_rad.median == Approx(2 * M_PI - 6.2));  // the shorter way
  CHECK(c.a.tracks == 0);
  CHECK(std::isnan(c.track_distance_m.median));
}

TEST_CASE("compare: a track is one run's alone if the other has none near it in more than half of its frames") {
  const TempFolder folder;
  folder.write("a/detections.csv", kDetections), folder.write("b/detections.csv", kDetections);
  std::string a = kTracks, b = kTracks;
  for (int64_t k = 0; k < 10; ++k) {
    a += track(k, 1, "confirmed", 10, 0, 50);  // in both
    b += track(k, 7, "confirmed", 10, k < 4 ? 1 : 0.5, 52);
    a += track(k, 2, "confirmed", 50, 50, 0);  // in B for 5 of 10 frames: not alone
    if (k < 5) b += track(k, 8, "confirmed", 50, 50, 0);
    if (k >= 3) a += track(k, 3, "confirmed", 100.0 + double(k), -20, 0);  // near B's in 3 of 7 frames
    if (k >= 7) b += track(k, 9, "confirmed", 100.0 + double(k), -20, 0);
    b += track(k, 10, "tentative", 100.0 + double(k), -20, 0);  // not confirmed: matches nothing
    a += track(k, 4, "tentative", -100, 0, 0);
  }
  folder.write("a/tracks.csv", a), folder.write("b/tracks.csv", b);
  const RunTables run_a = read_run(folder.path("a")), run_b = read_run(folder.path("b"));
  RunComparison c = compare_runs(run_a, run_b);
  CHECK(c.a.tracks == 4);
  CHECK(c.a.confirmed_tracks == 3);
  CHECK(c.a.confirmed_rows == 27);
  CHECK(c.a.lone_rows == 9);  // 5 of the second, 4 of the third
  CHECK(c.b.confirmed_rows == 18);
  CHECK(c.b.lone_rows == 0);
  CHECK(c.b.lone_tracks.empty());
  REQUIRE(c.a.lone_tracks.size() == 1);
  const LoneTrack& alone = c.a.lone_tracks[0];
  CHECK(alone.id == 3);
  CHECK(alone.frames == 7);
  CHECK(alone.matched == 3);
  CHECK(alone.from_s == Approx(0.15));
  CHECK(alone.duration_s == Approx(0.3));
  CHECK(alone.x_m == Approx(103));
  CHECK(alone.y_m == Approx(-20));
  CHECK(alone.ahead_m == Approx(12.5));
  CHECK(std::isnan(alone.left_m));  // an empty cell
  CHECK(c.track_distance_m.count == 18);
  CHECK(c.track_distance_m.most == Approx(1));
  CHECK(c.track_speed_mps.most == Approx(2));

  std::string map = "x_m,y_m,w_tr_right_m,w_tr_left_m\n";
  for (int32_t k = 0; k < 20; ++k) map += std::to_string(10 * k) + ",-15,8,8\n";
  place_on_map(c, folder.write("map.csv", map));
  CHECK(c.a.lone_tracks[0].s_m == Approx(103));
  CHECK(c.a.lone_tracks[0].d_m == Approx(-5));

  const RunComparison same = compare_runs(run_a, run_a);
  CHECK(same.a.lone_rows + same.b.lone_rows == 0);
  CHECK(same.track_distance_m.most == 0);
  const nlohmann::json json = nlohmann::json::parse(compare_json("A", "B", c));
  CHECK(json["a"]["only_here"][0]["id"] == "3");
  CHECK(json["a"]["only_here"][0]["left_m"].is_null());
  CHECK(json["b"]["only_here"].empty());
  CHECK(json["matched_detections"]["distance_m"]["median"].is_null());
}

TEST_CASE("compare: tracks of a frame are compared, whose stamp differs where a scan is missing") {
  const TempFolder folder;
  folder.write("a/detections.csv", kDetections), folder.write("b/detections.csv", kDetections);
  std::string a = kTracks, b = kTracks;
  for (int64_t k = 2; k < 6; ++k) {
    a += track(k, 1, "confirmed", 10, 0, 50);
    std::string other = track(k, 1, "confirmed", 10, 0, 50);
    if (k % 2 == 0) other.replace(0, stamp(k).size(), std::to_string(std::stoll(stamp(k)) - 17'000'000));
    b += other;
  }
  folder.write("a/tracks.csv", a), folder.write("b/tracks.csv", b);
  const RunComparison c = compare_runs(read_run(folder.path("a")), read_run(folder.path("b")));
  CHECK(c.track_distance_m.count == 4);
  CHECK(c.a.lone_rows + c.b.lone_rows == 0);
}

TEST_CASE("compare: tracks in the map match those in the vehicle frame by their places beside the vehicle") {
  const TempFolder folder;
  folder.write("a/detections.csv", kDetections), folder.write("b/detections.csv", kDetections);
  const auto row = [](int64_t k, const char* x, const char* y, const char* ahead, const char* left) {
    return line({stamp(k), "1", "confirmed", std::to_string(k), x, y, "50", ahead, left, "-"});
  };
  folder.write("a/tracks.csv", kTracks + row(0, "400", "300", "20", "1") + row(1, "405", "300", "20", "1") +
                                   row(2, "410", "300", "", ""));
  folder.write("b/tracks.csv", kTracks + row(0, "20.5", "1", "20.5", "1") + row(1, "20", "3.5", "20", "3.5") +
                                   row(2, "20", "1", "20", "1"));
  const RunTables a = read_run(folder.path("a")), b = read_run(folder.path("b"));
  RunComparison c = compare_runs(a, b);
  CHECK(c.by_vehicle);
  CHECK(c.track_distance_m.count == 1);  // the second is 2.5 m away, the third has no place beside the vehicle
  CHECK(c.track_distance_m.most == Approx(0.5));
  CHECK(c.track_speed_mps.count == 0);  // over the ground, and against the vehicle
  CHECK(c.a.lone_rows == 2);
  REQUIRE(c.a.lone_tracks.size() == 1);
  CHECK(c.a.lone_tracks[0].x_m == 400);
  std::string map = "x_m,y_m,w_tr_right_m,w_tr_left_m\n";
  for (int32_t k = 0; k < 60; ++k) map += std::to_string(10 * k) + ",300,8,8\n";
  place_on_map(c, folder.write("map.csv", map));
  CHECK(c.a.lone_tracks[0].s_m == Approx(400));
  CHECK(std::isnan(c.b.lone_tracks[0].s_m));
  const nlohmann::json json = nlohmann::json::parse(compare_json("A", "B", c));
  CHECK(json["a"]["reference"] == "map");
  CHECK(json["b"]["reference"] == "vehicle");
  CHECK(!compare_runs(b, b).by_vehicle);
  folder.write("b/tracks.csv", kTracks);
  CHECK(!compare_runs(a, read_run(folder.path("b"))).by_vehicle);
}

TEST_CASE("compare: bad input is named with file and line, and runs of two recordings are refused") {
  const TempFolder folder;
  const auto read = [&] { return error_of([&] { read_run(folder.path("a")); }); };
  CHECK(read().find("a/detections.csv") != std::string::npos);
  folder.write("a/detections.csv", kDetections + line({"0", stamp(0), "1", "2", "3", "4"}));
  CHECK(read().find("a/tracks.csv") != std::string::npos);
  folder.write("a/tracks.csv", kTracks + track(0, 1, "confirmed", 1, 1, 1) + track(1, 1, "lost", 1, 1, 1));
  CHECK(read().find("a/tracks.csv:3:") != std::string::npos);
  folder.write("a/tracks.csv", kTracks + track(0, 1, "confirmed", 1, 1, 1));
  CHECK(read().empty());
  folder.write("a/detections.csv", "");
  CHECK(read() == folder.path("a/detections.csv") + ": holds no row");
  folder.write("a/detections.csv", kDetections + line({"0", stamp(0), "x", "2", "3", "4"}));
  CHECK(read().find("a/detections.csv:2:") != std::string::npos);
  folder.write("a/detections.csv", "frame,stamp_ns,x_m\n0,1,2\n");
  CHECK(read().find("no column y_m") != std::string::npos);

  folder.write("a/detections.csv", kDetections);
  folder.write("b/detections.csv", kDetections);
  const std::string other_start = line({stamp(200), "1", "confirmed", "0", "1", "1", "1", "12.5", "", "-"});
  folder.write("b/tracks.csv", kTracks + other_start);
  const auto compare = [&] {
    return error_of([&] { compare_runs(read_run(folder.path("a")), read_run(folder.path("b"))); });
  };
  CHECK(compare().find("is of another recording than " + folder.path("a")) != std::string::npos);
  folder.write("b/tracks.csv", kTracks + track(0, 5, "confirmed", 1, 1, 1));
  CHECK(compare().empty());
  folder.write("b/tracks.csv", kTracks + track(200, 1, "confirmed", 1, 1, 1));  // found something else, later
  CHECK(compare().empty());
  folder.write("a/detections.csv", kDetections + line({"0", stamp(0), "1", "2", "3", "4"}));
  folder.write("b/detections.csv", kDetections + line({"0", stamp(30), "1", "2", "3", "4"}));
  CHECK(compare().find("is of another recording") != std::string::npos);
}
