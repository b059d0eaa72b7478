// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// The lines of points that come without their rings (tools/io/line_recovery.h).
#include <doctest/doctest.h>

#include <algorithm>
#include <cstring>
#include <filesystem>
#include <map>
#include <string>

#include "tests/support/bags.h"
#include "tests/support/recorded.h"
#include "tests/support/temp_folder.h"
#include "tools/io/formats.h"
#include "tools/io/line_recovery.h"
#include "tools/io/pcd.h"

using namespace overtake;
using namespace overtake::test;

namespace {

constexpr int32_t kLines = 16, kShots = 200;

}  // namespace

TEST_CASE("line recovery: works from a scan, two heads, a full turn or elevations, else not at all") {
  const auto lines_of = [](const io::Cloud& cloud, const io::RigSensor& sensor) {
    const auto floats = [&](int i) { return static_cast<const float*>(cloud.columns[std::size_t(i)].data()); };
    return io::recover_lines(floats(0), floats(1), floats(2), int32_t(cloud.points), sensor);
  };
  const io::Cloud swept = swept_cloud(kLines, kShots, 0);
  const io::RigSensor sensor = swept_rig(kLines).sensors[0];
  const auto order = lines_of(swept, sensor);
  REQUIRE(order.line.size() == std::size_t(swept.points));
  CHECK(order.how == "16 lines recovered from the order of the points (one sweep a line)");
  for (std::size_t i = 0; i < order.line.size(); ++i) REQUIRE(order.line[i] == swept.columns[4].integer(i));

  // The same points in random order: each ring is one elevation.
  io::Cloud mixed = swept;
  const auto count = std::size_t(swept.points);
  for (std::size_t c = 0; c < 5; ++c) {
    const std::size_t size = io::size_of(swept.columns[c].type);
    for (std::size_t i = 0; i < count; ++i)
      std::memcpy(mixed.columns[c].bytes.data() + i * size, swept.columns[c].bytes.data() + (i * 1009) % count * size,
                  size);
  }
  const auto elevation = lines_of(mixed, sensor);
  CHECK(elevation.how == "16 lines recovered from the elevations of the points");
  for (std::size_t i = 0; i < elevation.line.size(); ++i) REQUIRE(elevation.line[i] == mixed.columns[4].integer(i));

  for (std::size_t i = 0; i < count; ++i) {  // random elevations: nothing to recover from
    const float z = float(i % 977) * 0.01f;
    std::memcpy(mixed.columns[2].bytes.data() + 4 * i, &z, 4);
  }
  CHECK(lines_of(mixed, sensor).line.empty());
}

TEST_CASE("line recovery: rings of recorded KITTI scans are exact, and the hash is that of the PCD files") {
  OVT_NEED_RECORDED("kitti/000000.pcd");
  const TempFolder folder;
  std::filesystem::create_directories(folder.path("pcd"));
  for (const char* name : {"000000", "000001", "000002"}) {
    const io::Cloud cloud = io::read_cloud(recorded(std::string("kitti/") + name + ".pcd"));
    io::write_pcd(folder.path(std::string("pcd/") + name + ".pcd"), cloud);
    folder.write(std::string("bin/") + name + ".bin", kitti_bytes(cloud));
  }
  const io::Rig rig = io::load_rig("hdl64");
  CHECK(hash_of_run(folder.path("bin"), rig) == hash_of_run(folder.path("pcd"), rig));
}

TEST_CASE("line recovery: rings of recorded Luminar scans are right except for 4 % of the points") {
  OVT_NEED_RECORDED("racecar/000002_front.pcd");
  const io::Rig rig = io::load_rig("av21");
  for (std::size_t s = 0; s < 3; ++s) {
    const io::Cloud cloud = io::read_cloud(recorded("racecar/000002_" + rig.sensors[s].name + ".pcd"));
    const auto floats = [&](const char* name) { return static_cast<const float*>(cloud.find(name)->data()); };
    const auto count = int32_t(cloud.points);
    const auto lines = io::recover_lines(floats("x"), floats("y"), floats("z"), count, rig.sensors[s]);
    REQUIRE(lines.line.size() == std::size_t(count));
    std::map<std::pair<int64_t, int64_t>, int64_t> together;
    for (std::size_t i = 0; i < lines.line.size(); ++i) ++together[{lines.line[i], cloud.find("ring")->integer(i)}];
    std::map<int64_t, int64_t> best;
    for (const auto& [pair, n] : together) best[pair.first] = std::max(best[pair.first], n);
    int64_t agreed = 0;
    for (const auto& [line, n] : best) agreed += n;
    CHECK(agreed > count * 96 / 100);
  }
}
