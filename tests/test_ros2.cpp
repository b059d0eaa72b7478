// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// The parts of `overtake node` that need no DDS: names, options, faults, numbers of tracks. tests/ros2 has the others.
#include <doctest/doctest.h>

#include <cstdlib>
#include <string>
#include <vector>

#include "tests/support/temp_folder.h"
#include "tools/io/error.h"
#include "tools/io/text.h"
#include "tools/ros2/faults.h"
#include "tools/ros2/names.h"
#include "tools/ros2/node_options.h"
#include "tools/ros2/track_numbers.h"
#include "tools/ros2/window.h"

using namespace overtake;
using namespace overtake::ros2;

namespace {

std::string error_of(const std::string& name_space, const std::vector<std::string>& remaps) {
  try {
    Names names(name_space, "overtake", remaps);
    names.resolve("front/points");
    names.check_used();
  } catch (const io::Error& error) {
    return error.what();
  }
  return "";
}

// Tracks with these ids; all confirmed except for negative ones.
struct MadeTracks {
  explicit MadeTracks(const std::vector<int64_t>& numbers) {
    for (const int64_t n : numbers) {
      id.push_back(uint64_t(n < 0 ? -n : n));
      state.push_back(n < 0 ? OVT_TENTATIVE : OVT_CONFIRMED);
    }
    tracks.count = int32_t(id.size());
    tracks.id = id.data();
    tracks.state = state.data();
  }
  std::vector<uint64_t> id;
  std::vector<int32_t> state;
  ovt_tracks tracks{};
};

}  // namespace

TEST_CASE("ros2 names: relative, private and absolute names are resolved, then remapped") {
  Names names("/car1", "overtake", {"front/points:=/sensing/front", "~/tracks:=cars", "/clock:=/sim/clock"});
  CHECK(names.resolve("ego/odometry") == "/car1/ego/odometry");
  CHECK(names.resolve("~/detections") == "/car1/overtake/detections");
  CHECK(names.resolve("/diagnostics") == "/diagnostics");
  CHECK(names.resolve("front/points") == "/sensing/front");
  CHECK(names.resolve("~/tracks") == "/car1/cars");
  CHECK(names.resolve("/clock") == "/sim/clock");
  CHECK(names.is_remapped("front/points"));
  CHECK(!names.is_remapped("left/points"));
  names.check_used();
  Names both("/car1", "overtake", {"/car1/front/points:=/a"}, {"front/points:=/b", "left/points:=/c"});
  CHECK(both.resolve("front/points") == "/a");
  CHECK(both.resolve("left/points") == "/c");
  both.check_used();
  Names bare("", "overtake", {});
  CHECK(bare.resolve("~/tracks") == "/overtake/tracks");
  CHECK(Names("/", "a", {}).resolve("b") == "/b");
}

TEST_CASE("ros2 names: what is not a name, and a remap without effect, are errors that name it") {
  CHECK(error_of("/2nd", {}).find("'/2nd' is not a name of ROS 2") != std::string::npos);
  CHECK(error_of("/a//b", {}).find("'/a//b' is not a name") != std::string::npos);
  CHECK(error_of("/a/", {}).find("'/a/' is not a name") != std::string::npos);
  CHECK(error_of("", {"a b:=/c"}).find("'a b' is not a name") != std::string::npos);
  CHECK(error_of("", {"front/points"}).find("FROM:=TO is needed") != std::string::npos);
  CHECK(error_of("", {"fron/points:=/a"}).find("did you mean '/front/points'") != std::string::npos);
  CHECK(error_of("", {"front/points:=/a", "/front/points:=/b"}) ==
        "--remap /front/points:=/b: /front/points is remapped twice: also by front/points:=/a");
  CHECK(error_of("/ab/_c9", {"front/points:=/a"}).empty());
  // The name of a sensor may be no name of ROS 2; no sensor has this one.
  CHECK(error_of("", {"front-left/points:=/a"}).find("is not a name") == std::string::npos);
  CHECK(error_of("", {"2nd/points:=/a"}).find("is not a name") == std::string::npos);
  CHECK(error_of("", {"front/points:=/a-b"}).find("'/a-b' is not a name") != std::string::npos);
}

TEST_CASE("ros2 names: topics and types on the wire and back") {
  CHECK(dds_topic_of("/front/points") == "rt/front/points");
  CHECK(ros_topic_of("rt/front/points") == "/front/points");
  CHECK(ros_topic_of("other") == "other");
  CHECK(dds_topic_of("ros_discovery_info") == "ros_discovery_info");
  CHECK(ros_type_of("sensor_msgs::msg::dds_::PointCloud2_") == "sensor_msgs/msg/PointCloud2");
  CHECK(ros_type_of("A::B") == "A::B");
}

TEST_CASE("ros2 options: the command line, then the file, then the defaults; a wrong key has its line") {
  const TempFolder folder;
  const std::string file = folder.path("node.toml");
  io::write_whole_file(file,
                       "[node]\ndomain = 7\nnamespace = \"/file\"\nremap = [\"a:=b\"]\nuse_sim_time = true\n"
                       "deadline_ms = 20\npublish_tf = false\n");
  NodeOptions options;
  options.name_space = "/line";
  options.remaps = {"c:=d"};
  complete(options, file);
  CHECK(options.domain == 7);
  CHECK(options.name_space == "/line");
  CHECK(options.remaps == std::vector<std::string>{"c:=d"});
  CHECK(options.file_remaps == std::vector<std::string>{"a:=b"});
  CHECK(options.use_sim_time);
  CHECK(options.deadline_ms == 20);
  CHECK(!options.publish_tf);
  CHECK(options.name == "overtake");
  io::write_whole_file(file, "[node]\ndomain = 7\n\ndomian = 3\n");
  NodeOptions wrong;
  CHECK_THROWS_WITH(complete(wrong, file), doctest::Contains((file + ":4").c_str()));
}

TEST_CASE("ros2 options: a release has the GUIDs of its graph; an unknown one is an error that names where it is") {
  CHECK(gid_bytes_of("humble") == 24);
  CHECK(gid_bytes_of("iron") == 16);
  CHECK(gid_bytes_of("rolling") == 16);
  CHECK(gid_bytes_of("noetic") == 0);
  const TempFolder folder;
  const std::string file = folder.path("node.toml");
  io::write_whole_file(file, "[node]\nros_distro = \"jazzy\"\n");
  NodeOptions from_file, from_line, without;
  from_line.ros_distro = "galactic";
  setenv("ROS_DISTRO", "foxy", 1);
  complete(from_file, file);
  CHECK(from_file.ros_distro == "jazzy");
  complete(from_line, file);
  CHECK(from_line.ros_distro == "galactic");
  complete(without, "");
  CHECK(without.ros_distro == "foxy");
  setenv("ROS_DISTRO", "noetic", 1);
  NodeOptions wrong;
  CHECK_THROWS_WITH(complete(wrong, ""), doctest::Contains("ROS_DISTRO: 'noetic' is not a release of ROS 2"));
  unsetenv("ROS_DISTRO");
  NodeOptions bare;
  complete(bare, "");
  CHECK(bare.ros_distro == "humble");
  io::write_whole_file(file, "[node]\nros_distro = \"jazy\"\n");
  NodeOptions misspelled;
  CHECK_THROWS_WITH(complete(misspelled, file), doctest::Contains("did you mean 'jazzy'"));
}

TEST_CASE("ros2 faults: each is said once when it begins and once when it ends") {
  std::vector<std::string> said;
  Faults faults([&](const std::string& line) { said.push_back(line); });
  faults.lower("front", "gone", "is back");
  CHECK(said.empty());
  faults.raise("front", "gone", Level::kError, "is gone", 1);
  faults.raise("front", "gone", Level::kError, "is gone for 1 s", 2);
  faults.raise("left", "gone", Level::kError, "is gone", 2);
  CHECK(said == std::vector<std::string>{"front: is gone", "left: is gone"});
  REQUIRE(faults.of("front").size() == 1);
  CHECK(faults.of("front")[0].sentence == "is gone for 1 s");
  faults.lower("front", "gone", "is back");
  CHECK(said.back() == "front: is back");
  CHECK(faults.of("front").empty());
  CHECK(faults.of("left").size() == 1);
}

TEST_CASE("ros2 faults: an event is a fault for three seconds after the last one; an error is worse than silence") {
  int32_t said = 0;
  Faults faults([&](const std::string&) { ++said; });
  faults.note("front", "lost", Level::kWarning, "1 lost", 0);
  faults.note("front", "lost", Level::kWarning, "2 lost", 2'000'000'000);
  faults.pass(Faults::kEvent_ns + 1'999'999'999);
  CHECK(said == 1);
  REQUIRE(faults.of("front").size() == 1);
  faults.raise("front", "silent", Level::kStale, "silent", 0);
  faults.raise("front", "type", Level::kError, "type", 0);
  CHECK(faults.of("front")[0].kind == "type");
  CHECK(faults.of("front")[1].kind == "silent");
  CHECK(faults.of("front")[2].sentence == "2 lost");
  faults.pass(Faults::kEvent_ns + 2'000'000'000);
  CHECK(faults.of("front").size() == 2);
  faults.note("front", "lost", Level::kWarning, "3 lost", 9'000'000'000);
  CHECK(said == 4);
}

TEST_CASE("ros2 tracks: a confirmed track keeps its number; the number of one that is over is free again") {
  TrackNumbers numbers;
  using List = std::vector<int32_t>;
  CHECK(numbers.assign(MadeTracks({10, -11, 12}).tracks) == List{0, -1, 1});
  CHECK(numbers.assign(MadeTracks({11, 12}).tracks) == List{0, 1});
  CHECK(numbers.was_used(1));
  CHECK(numbers.assign(MadeTracks({12}).tracks) == List{1});
  CHECK(numbers.was_used(0));
  CHECK(!numbers.is_used(0));
  CHECK(numbers.assign(MadeTracks({20, 21, 22, 23, 24, 25, 26, 27, 12}).tracks) == List{0, 2, 3, 4, 5, 6, 7, -1, 1});
  CHECK(numbers.assign(MadeTracks({}).tracks).empty());
  CHECK(!numbers.is_used(1));
}

TEST_CASE("ros2 window: rates and quantiles are of the last ten seconds") {
  Window window;
  CHECK(window.rate() == 0);
  CHECK(window.quantile(0.5) == 0);
  for (int64_t i = 0; i <= 400; ++i) window.add(1 + i * 50'000'000, double(i));
  window.pass(1 + 400 * int64_t(50'000'000));
  CHECK(window.count() == 201);
  CHECK(window.rate() == doctest::Approx(20.1));
  CHECK(window.quantile(0.5) == 300);
  CHECK(window.quantile(1) == 400);
}
