// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
#include "tools/io/recording.h"

#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <cstring>

#include "tests/support/recorded.h"
#include "tests/support/temp_folder.h"
#include "tools/io/formats.h"

using namespace overtake;
using io::Recording;
using io::Rig;
using io::ValueType;

namespace {

std::string cloud(const std::string& rows, const std::string& fields = "x y z ring",
                  const std::string& size = "4 4 4 2", const std::string& type = "F F F U") {
  const auto n = std::to_string(std::count(rows.begin(), rows.end(), '\n'));
  return "FIELDS " + fields + "\nSIZE " + size + "\nTYPE " + type + "\nWIDTH " + n + "\nDATA ascii\n" + rows;
}

std::string cloud_with_time(const std::string& rows, const std::string& size, const std::string& type) {
  return cloud(rows, "x y z ring t", "4 4 4 2 " + size, "F F F U " + type);
}

}  // namespace

TEST_CASE("recording: frames come in the order of their numbers, sensors in the order of the rig") {
  const TempFolder folder;
  for (const char* name : {"10_left.pcd", "10_front.pcd", "000009_front.pcd", "11_right.pcd", "2_front.PCD"})
    folder.write(name, cloud("1 2 3 4\n"));
  folder.write("2_box.txt", "not a scan");
  const Recording recording(folder.path(), io::load_rig("av21"));
  REQUIRE(recording.frame_count() == 4);
  const int64_t numbers[] = {2, 9, 10, 11};
  for (std::size_t i = 0; i < 4; ++i) CHECK(recording.frame_number(i) == numbers[i]);
  const io::FrameScans frame = recording.read(2);
  CHECK(frame.frame == 10);
  REQUIRE(frame.scans.size() == 2);
  CHECK(frame.scans[0].sensor == 0);
  CHECK(frame.scans[1].sensor == 1);
  CHECK(frame.scans[0].stamp_ns == 500'000'000);  // frame number x period
  CHECK(frame.scans[0].time_offset_ns.empty());
  CHECK(frame.scans[0].input_index.empty());
  CHECK(recording.read(3).scans[0].sensor == 2);
}

TEST_CASE("recording: one sensor needs no name; the number may be at the end; one file is a recording") {
  const TempFolder folder;
  folder.write("000000.pcd", cloud("1 2 3 4\n"));
  folder.write("log7_000001.pcd", cloud("1 2 3 4\n5 6 7 8\n"));
  folder.write("000002_top.pcd", cloud("1 2 3 4\n"));
  const Rig rig = io::load_rig("hdl64");
  CHECK(Recording(folder.path(), rig).frame_count() == 3);
  const Recording one(folder.path("log7_000001.pcd"), rig);
  REQUIRE(one.frame_count() == 1);
  CHECK(one.frame_number(0) == 1);
  CHECK(one.read(0).scans[0].count == 2);
  CHECK(Recording(folder.write("cloud.pcd", cloud("1 2 3 4\n")), rig).frame_number(0) == 0);
}

TEST_CASE("recording: offsets stay offsets; absolute times become stamp and offsets") {
  const TempFolder folder;
  Rig rig = io::load_rig("hdl64");
  const auto read = [&](const std::string& text) {
    return Recording(folder.write("3.pcd", text), rig).read(0).scans[0];
  };

  io::SensorScan scan = read(cloud_with_time("1 2 3 4 5000\n1 2 3 4 70000\n", "4", "U"));  // ns
  CHECK(scan.stamp_ns == 300'000'000);
  CHECK(scan.time_offset_ns == std::vector<int32_t>{5000, 70000});

  scan = read(cloud_with_time("1 2 3 4 -0.05\n1 2 3 4 nan\n1 2 3 4 0.001\n", "4", "F"));  // s
  CHECK(scan.stamp_ns == 300'000'000);
  REQUIRE(scan.time_offset_ns.size() == 3);
  CHECK(std::abs(scan.time_offset_ns[0] + 50'000'000) <= 10);
  CHECK(scan.time_offset_ns[1] == 0);
  CHECK(std::abs(scan.time_offset_ns[2] - 1'000'000) <= 1);

  scan = read(cloud_with_time("1 2 3 4 1672875115412000300\n1 2 3 4 1672875115412000123\n", "8", "U"));
  CHECK(scan.stamp_ns == 1672875115412000123);
  CHECK(scan.time_offset_ns == std::vector<int32_t>{177, 0});

  scan = read(cloud_with_time("1 2 3 4 1672875115.5\n1 2 3 4 1672875115.25\n", "8", "F"));
  CHECK(scan.stamp_ns == 1672875115250000000);
  CHECK(scan.time_offset_ns == std::vector<int32_t>{250'000'000, 0});

  // A pixel without a return has time 0 beside absolute ones; doubles show their unit.
  scan = read(cloud_with_time("nan nan nan 4 0\n1 2 3 4 1672875115412000300\n1 2 3 4 1672875115412000123\n", "8", "U"));
  CHECK(scan.stamp_ns == 1672875115412000123);
  CHECK(scan.time_offset_ns == std::vector<int32_t>{0, 177, 0});
  for (const char* times : {"1672875115250000000 1672875115500000000", "1672875115250000 1672875115500000",
                            "1672875115250 1672875115500"}) {
    const std::string both = times;
    const auto space = both.find(' ');
    scan = read(
        cloud_with_time("1 2 3 4 " + both.substr(space + 1) + "\n1 2 3 4 " + both.substr(0, space) + "\n", "8", "F"));
    CHECK(std::llabs(scan.stamp_ns - 1672875115250000000) <= 256);  // a double's last digit
    REQUIRE(scan.time_offset_ns.size() == 2);
    CHECK(std::abs(scan.time_offset_ns[0] - 250'000'000) <= 256);
  }

  rig.time_unit = io::TimeUnit::kMicroseconds;
  scan = read(cloud_with_time("1 2 3 4 7\n1 2 3 4 99999999\n", "4", "U"));
  CHECK(scan.time_offset_ns == std::vector<int32_t>{7000, INT32_MAX});  // saturated
}

TEST_CASE("recording: a frame number that is a time becomes the stamp") {
  CHECK(io::stamp_of_frame("f", 12, 50'000'000) == 600'000'000);
  CHECK(io::stamp_of_frame("f", 1532402927647, 1) == 1532402927647'000'000);
  CHECK(io::stamp_of_frame("f", 1532402927647951, 1) == 1532402927647951'000);
  CHECK(io::stamp_of_frame("f", 315973157959879000, 1) == 315973157959879000);
  CHECK(error_of([] { io::stamp_of_frame("f", 99'000'000'000, 100'000'000); }) ==
        "f: its frame number is too large for a stamp");
}

TEST_CASE("recording: columns keep their types; 64-bit layers become 32 bits") {
  const TempFolder folder;
  const Rig rig = io::load_rig("hdl64");
  const auto read = [&](const std::string& text) {
    return Recording(folder.write("3.pcd", text), rig).read(0).scans[0];
  };
  const io::SensorScan scan = read(cloud("200 0.1 2 3 -7\n", "i x y z layer", "1 8 4 4 2", "U F F F I"));
  CHECK(scan.x.type == ValueType::kFloat64);
  CHECK(scan.x.value(0) == 0.1);
  CHECK(scan.y.type == ValueType::kFloat32);
  CHECK(scan.intensity.type == ValueType::kUint8);
  CHECK(scan.intensity.integer(0) == 200);
  CHECK(scan.layer.type == ValueType::kInt16);
  CHECK(scan.layer.integer(0) == -7);
  const io::SensorScan wide = read(cloud("1 2 3 63\n1 2 3 4294967297\n", "x y z ring", "4 4 4 8", "F F F U"));
  CHECK(wide.layer.type == ValueType::kInt32);
  CHECK(wide.layer.integer(0) == 63);
  CHECK(wide.layer.integer(1) == -1);  // not layer 1
  CHECK(wide.intensity.bytes.empty());
}

TEST_CASE("recording: a shared cloud is split by layers and transformed from the vehicle frame to each sensor") {
  const TempFolder folder;
  // ring 5: upper sensor; 40: lower; 99: no sensor, so both count it as bad
  folder.write("7.pcd", cloud("10 1 2 5\n11 1 2 40\n12 1 2 99\n13 1 2 6\n"));
  const Rig rig = io::load_rig("av2");
  const io::FrameScans frame = Recording(folder.path(), rig).read(0);
  REQUIRE(frame.scans.size() == 2);
  const io::SensorScan &upper = frame.scans[0], &lower = frame.scans[1];
  CHECK(upper.input_count == 4);
  CHECK(upper.input_index == std::vector<int32_t>{0, 2, 3});
  CHECK(lower.input_index == std::vector<int32_t>{1, 2});
  CHECK(upper.count == 3);
  CHECK(upper.layer.integer(2) == 6);
  CHECK(upper.x.value(0) == double(float(10 - 1.35)));
  CHECK(upper.z.value(0) == double(float(2 - 1.64)));
  CHECK(lower.x.value(0) == double(float(11 - 1.36)));
}

TEST_CASE("recording: each kind of bad input gets its error") {
  const TempFolder folder;
  const Rig av21 = io::load_rig("av21"), hdl64 = io::load_rig("hdl64");
  const auto error = [&](const std::string& path, const Rig& rig) {
    return error_of([&] {
      const Recording recording(path, rig);
      for (std::size_t i = 0; i < recording.frame_count(); ++i) recording.read(i);
    });
  };
  const std::string good = cloud("1 2 3 4\n");
  CHECK(error(folder.path("no"), av21) == folder.path("no") + ": no such folder");
  folder.write("empty/readme.txt", "");
  CHECK(error(folder.path("empty"), av21) ==
        folder.path("empty") + ": holds no recording: no " + io::list_extensions() + " file");
  std::string path = folder.write("a/rear.pcd", good);
  CHECK(error(folder.path("a"), av21) ==
        path + ": its name has no frame number; FRAME_SENSOR.pcd or FRAME.pcd is needed");
  path = folder.write("b/1_rear.pcd", good);
  CHECK(error(folder.path("b"), av21) == path + ": rig av21 has no sensor 'rear' (it has front, left, right)");
  path = folder.write("c/1.pcd", good);
  CHECK(error(folder.path("c"), av21) ==
        path + ": its name has no sensor, and rig av21 has 3 (front, left, right): FRAME_SENSOR.pcd is needed");
  path = folder.write("d/1.pcd", good);
  const std::string copy = folder.write("d/01.pcd", good);
  CHECK(error(folder.path("d"), hdl64) == path + ": is the same scan as " + copy);
  path = folder.write("e/99999999999999999999.pcd", good);
  CHECK(error(folder.path("e"), hdl64) == path + ": its frame number does not fit 64 bits");
  path = folder.write("f/1.pcd", cloud("1 2 3 4\n", "x y z colour"));
  CHECK(error(path, hdl64) ==
        path + ": no field gives the layer (looked for " + io::role_aliases(io::CloudRole::kLayer) +
            "; there are x, y, z, colour); neither the order nor the elevations of the points show lines");
  path = folder.write("f/2.pcd", cloud("1 2 3 4\n", "x z w ring"));
  CHECK(error(path, hdl64).rfind(path + ": no field gives y", 0) == 0);
  path = folder.write("f/3.pcd", cloud("1 2 3 4\n", "x y z ring", "4 4 4 2", "F I F U"));
  CHECK(error(path, hdl64) == path + ": the coordinates are not floating-point numbers (TYPE F)");
  path = folder.write("f/4.pcd", "nonsense\n");
  CHECK(error(path, hdl64) == path + ":1: not a PCD file");
}

TEST_CASE("recording: the recorded folders open with their rigs") {
  struct Row {
    const char* folder;
    const char* rig;
    std::size_t frames, scans;
  };
  const Row rows[] = {
      {"racecar", "av21", 4, 3}, {"kitti", "hdl64", 12, 1}, {"nuscenes", "nuscenes", 1, 1}, {"av2", "av2", 1, 2}};
  for (const Row& row : rows) OVT_NEED_RECORDED(row.folder);
  for (const Row& row : rows) {
    CAPTURE(row.folder);
    const Recording recording(recorded(row.folder), io::load_rig(row.rig));
    REQUIRE(recording.frame_count() == row.frames);
    const io::FrameScans frame = recording.read(0);
    REQUIRE(frame.scans.size() == row.scans);
    for (const io::SensorScan& scan : frame.scans) {
      CHECK(scan.count > 10000);
      CHECK(scan.count <= recording.rig().sensors[std::size_t(scan.sensor)].point_capacity);
    }
  }
}
