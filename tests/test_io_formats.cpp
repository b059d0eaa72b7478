// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
#include "tools/io/formats.h"

#include <doctest/doctest.h>

#include <filesystem>
#include <regex>
#include <set>

#include "tests/support/bags.h"
#include "tests/support/temp_folder.h"
#include "tools/io/bag_reader.h"
#include "tools/io/pcd.h"
#include "tools/io/recording.h"
#include "tools/io/scan_stream.h"
#include "tools/io/text.h"

using namespace overtake;
using namespace overtake::test;

namespace {

bool contains(const std::string& text, const std::string& part) { return text.find(part) != std::string::npos; }

io::Cloud small_cloud() { return swept_cloud(8, 20, 0); }

}  // namespace

TEST_CASE("formats: the table names each format and each extension once") {
  std::set<std::string> names, extensions;
  for (const io::Format& format : io::formats()) {
    CAPTURE(format.name);
    CHECK(names.insert(format.name).second);
    CHECK(extensions.insert(format.extension).second);
    CHECK(format.extension[0] == '.');
    CHECK((format.cloud == nullptr) != (format.bag == nullptr));
    CHECK(io::find_format_by_name("a" + std::string(format.extension)) == &format);
    CHECK(io::find_format_by_name("A" + io::lower_case(format.extension) + ".part") == nullptr);
  }
  CHECK(io::find_format_by_name("SCAN.PCD") == io::find_format_by_name("scan.pcd"));
}

TEST_CASE("formats: a file is recognised by its first bytes, whatever its name, and by one format only") {
  const TempFolder folder;
  std::vector<std::pair<const io::Format*, std::string>> files;
  for (const io::Format& format : io::formats()) {
    if (!format.cloud || !format.cloud->looks_like) continue;
    for (const io::CloudExample& example : format.cloud->write_examples(small_cloud()))
      files.emplace_back(&format, folder.write("file_" + std::to_string(files.size()), example.bytes));
  }
  write_mcap(folder.path("log.pcd"), straight_drive("/ego/odometry", 0, 50'000'000));
  files.emplace_back(io::find_format_by_name("a.mcap"), folder.path("log.pcd"));
  write_db3(folder.path("log.bin"), straight_drive("/ego/odometry", 0, 50'000'000));
  files.emplace_back(io::find_format_by_name("a.db3"), folder.path("log.bin"));
  for (const auto& [expected, path] : files) {
    CAPTURE(path);
    for (const io::Format& format : io::formats())
      CHECK(format.looks_like(io::read_head(path)) == (&format == expected));
    CHECK(io::find_format(path) == expected);
    CHECK(io::is_bag(path) == (expected->bag != nullptr));
  }
  CHECK(io::find_format(folder.write("blank.mcap", "")) == io::find_format_by_name("a.mcap"));  // the name counts
  CHECK(io::find_format(folder.write("notes.txt", "x,y\n")) == nullptr);
}

TEST_CASE("formats: the examples of each format hold the cloud that they were made of") {
  const io::Cloud cloud = small_cloud();
  const TempFolder folder;
  for (const io::Format& format : io::formats()) {
    if (!format.cloud) continue;
    const auto examples = format.cloud->write_examples(cloud);
    REQUIRE(examples.size() > 0);
    for (const io::CloudExample& example : examples) {
      CAPTURE(format.name);
      CHECK(example.header_bytes < example.bytes.size());
      const std::string path = folder.write(std::string("1") + format.extension, example.bytes);
      const io::Cloud back = io::read_cloud(path), header = io::read_cloud_header(path);
      CHECK(header.points == cloud.points);
      CHECK(header.columns.empty());
      CHECK(header.fields.size() == back.fields.size());
      for (const char* name : {"x", "y", "z", "intensity"}) {
        REQUIRE(back.find(name));
        CHECK(back.find(name)->bytes == cloud.find(name)->bytes);
      }
    }
  }
}

TEST_CASE("formats: a folder of nuScenes has rings, stamps from its names and the sensor of the rig") {
  const TempFolder folder;
  const io::Cloud cloud = small_cloud();
  const io::Format* format = io::find_format_by_name("a.pcd.bin");
  REQUIRE(format);
  const std::string bytes = format->cloud->write_examples(cloud)[0].bytes;
  CHECK(bytes.size() == 20 * std::size_t(cloud.points));
  for (const char* stamp : {"1532402927647951", "1532402927697951"})
    folder.write(std::string("n015-2018-07-24__LIDAR_TOP__") + stamp + ".pcd.bin", bytes);
  const io::Recording recording(folder.path(), swept_rig(8));
  REQUIRE(recording.frame_count() == 2);
  const io::SensorScan scan = recording.read(1).scans[0];
  CHECK(scan.stamp_ns == 1532402927697951000);
  REQUIRE(scan.count == cloud.points);
  for (std::size_t i = 0; i < std::size_t(scan.count); ++i) {
    REQUIRE(scan.x.value(i) == cloud.find("x")->value(i));
    REQUIRE(scan.layer.value(i) == cloud.find("ring")->value(i));
  }
  CHECK(scan.lines_how.empty());
  const std::string cut = folder.write("7.pcd.bin", bytes.substr(0, 50));
  CHECK(error_of([&] { io::read_cloud(cut); }) ==
        cut + ": ends within point 2: a point takes 20 bytes (x y z intensity ring as float32)");
}

TEST_CASE("formats: what a file of a folder holds is found by looking at it, not at its name") {
  const TempFolder folder;
  folder.write("000001.bin", io::format_pcd(small_cloud()));
  const io::Recording recording(folder.path(), swept_rig(8));
  CHECK(recording.read(0).scans[0].count == small_cloud().points);
  const std::string other = folder.write("scan.dat", io::format_pcd(small_cloud()));
  io::FrameScans frame;
  REQUIRE(io::open_scans(other, swept_rig(8))->next(frame));
  CHECK(frame.scans[0].count == small_cloud().points);
  const std::string notes = folder.write("notes.dat", "no scan");
  CHECK(error_of([&] { io::read_cloud(notes); }) ==
        notes + ": has no supported format (" + io::list_extensions() + ")");
  const std::string log = folder.path("log.pcd");
  write_mcap(log, straight_drive("/ego/odometry", 0, 50'000'000));
  CHECK(error_of([&] { io::read_cloud(log); }) == log + ": is a recording, MCAP, not one cloud");
}

TEST_CASE("formats: error texts, help and documents follow the table") {
  const TempFolder folder;
  folder.write("readme.txt", "");
  const std::string error = error_of([&] { io::Recording(folder.path(), swept_rig(8)); });
  const std::string bag = folder.write("a.mcap", "something else");
  for (const io::Format& format : io::formats()) {
    CAPTURE(format.name);
    CHECK(contains(error, format.extension));
    CHECK(contains(io::describe_inputs(), std::string(format.name) + " (" + format.extension + ")"));
    CHECK(contains(io::list_formats(), format.text));
    if (format.bag) CHECK(contains(error_of([&] { io::open_bag(bag); }), format.name));
  }
  // The documents leave the list to the table, and name the extensions of its formats and no others.
  for (const char* document : {"tools/README.md", "tools/io/README.md"}) {
    CAPTURE(document);
    CHECK(contains(io::read_whole_file(document), "formats.def"));
  }
  std::set<std::string> known;
  for (const io::Format& format : io::formats()) known.insert(format.extension);
  const std::pair<const char*, const char*> lists[] = {{"README.md", "overtake run RECORDING"},
                                                       {"tools/README.md", "| recording |"}};
  for (const auto& [document, heading] : lists) {
    const std::string text = io::read_whole_file(document);
    const auto begin = text.find(heading);
    REQUIRE(begin != std::string::npos);
    const std::string list = text.substr(begin, text.find(*heading == '|' ? "\n\n" : "\n", begin) - begin);
    CAPTURE(list);
    std::set<std::string> named;
    const std::regex extension("[ (`]((?:\\.[a-z0-9]+)+)");
    for (std::sregex_iterator at(list.begin(), list.end(), extension), end; at != end; ++at) named.insert(at->str(1));
    CHECK(named == known);
  }
}
