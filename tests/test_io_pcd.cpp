// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
#include "tools/io/pcd.h"

#include <doctest/doctest.h>

#include <cmath>
#include <cstring>
#include <limits>
#include <random>

#include "tests/support/recorded.h"
#include "tests/support/temp_folder.h"
#include "tools/io/formats.h"

using namespace overtake;
using io::Cloud;
using io::PcdEncoding;
using io::ValueType;

namespace {

template <class T>
void add_field(Cloud& cloud, const char* name, ValueType type, const std::vector<T>& values, int64_t count = 1) {
  io::CloudColumn column{type, count, std::vector<unsigned char>(values.size() * sizeof(T))};
  if (!values.empty()) std::memcpy(column.bytes.data(), values.data(), column.bytes.size());
  cloud.fields.push_back({name, type, count});
  cloud.columns.push_back(column);
}

template <class T>
std::vector<T> extremes_and_noise(std::mt19937& random, std::size_t n) {
  std::vector<T> values = {std::numeric_limits<T>::lowest(), std::numeric_limits<T>::max(), T(0), T(1)};
  if constexpr (std::is_floating_point_v<T>)
    values.insert(values.end(),
                  {std::numeric_limits<T>::min(), T(0.1), T(-1.0 / 3), std::numeric_limits<T>::infinity()});
  while (values.size() < n) {
    uint64_t bits = uint64_t(random()) << 32 | random();
    if constexpr (std::is_floating_point_v<T>)
      values.push_back(T(double(bits) * 1e-17));
    else
      values.push_back(T(bits));
  }
  return values;
}

// A cloud with a field of every type, one field with three values per point, and padding.
Cloud every_type(uint32_t seed, std::size_t n) {
  std::mt19937 random(seed);
  Cloud cloud;
  add_field(cloud, "time", ValueType::kFloat64, extremes_and_noise<double>(random, n));
  add_field(cloud, "i8", ValueType::kInt8, extremes_and_noise<int8_t>(random, n));
  add_field(cloud, "z", ValueType::kFloat32, extremes_and_noise<float>(random, n));
  add_field(cloud, "u8", ValueType::kUint8, extremes_and_noise<uint8_t>(random, n));
  add_field(cloud, "i16", ValueType::kInt16, extremes_and_noise<int16_t>(random, n));
  add_field(cloud, "u16", ValueType::kUint16, extremes_and_noise<uint16_t>(random, n));
  add_field(cloud, "normal", ValueType::kFloat32, extremes_and_noise<float>(random, 3 * n), 3);
  add_field(cloud, "_", ValueType::kUint8, extremes_and_noise<uint8_t>(random, n));
  add_field(cloud, "i32", ValueType::kInt32, extremes_and_noise<int32_t>(random, n));
  add_field(cloud, "u32", ValueType::kUint32, extremes_and_noise<uint32_t>(random, n));
  add_field(cloud, "_", ValueType::kUint16, extremes_and_noise<uint16_t>(random, n));
  add_field(cloud, "i64", ValueType::kInt64, extremes_and_noise<int64_t>(random, n));
  add_field(cloud, "u64", ValueType::kUint64, extremes_and_noise<uint64_t>(random, n));
  return cloud;
}

constexpr PcdEncoding kEncodings[] = {PcdEncoding::kAscii, PcdEncoding::kBinary, PcdEncoding::kBinaryCompressed};

std::string header(const std::string& fields = "x y z", const std::string& points = "2",
                   const std::string& data = "ascii") {
  return "VERSION 0.7\nFIELDS " + fields + "\nSIZE 4 4 4\nTYPE F F F\nCOUNT 1 1 1\nWIDTH " + points +
         "\nHEIGHT 1\nPOINTS " + points + "\nDATA " + data + "\n";
}

std::string with_line(std::string text, const std::string& key, const std::string& line) {
  const auto at = text.find(key + " ");
  REQUIRE(at != std::string::npos);
  return text.replace(at, text.find('\n', at) - at, line);
}

std::string pack(std::initializer_list<uint32_t> words, const std::string& tail = "") {
  std::string bytes;
  for (const uint32_t word : words) bytes.append(reinterpret_cast<const char*>(&word), 4);
  return bytes + tail;
}

}  // namespace

TEST_CASE("pcd: every field type keeps its bits in all three encodings") {
  const uint32_t seed = 7;
  CAPTURE(seed);
  for (const std::size_t n : {std::size_t(8), std::size_t(9), std::size_t(1000)}) {
    Cloud cloud = every_type(seed, n);
    for (const PcdEncoding encoding : kEncodings) {
      CAPTURE(n);
      CAPTURE(int(encoding));
      const Cloud back = io::parse_pcd("cloud.pcd", io::format_pcd(cloud, encoding));
      CHECK(back.points == int64_t(n));
      REQUIRE(back.columns.size() == cloud.columns.size());
      for (std::size_t f = 0; f < cloud.columns.size(); ++f) {
        CAPTURE(cloud.fields[f].name);
        CHECK(back.columns[f].type == cloud.columns[f].type);
        CHECK(back.columns[f].count == cloud.columns[f].count);
        CHECK(back.columns[f].bytes == cloud.columns[f].bytes);
      }
    }
  }
}

TEST_CASE("pcd: a cloud without points works in all three encodings") {
  Cloud cloud;
  add_field(cloud, "x", ValueType::kFloat32, std::vector<float>());
  for (const PcdEncoding encoding : kEncodings)
    CHECK(io::parse_pcd("cloud.pcd", io::format_pcd(cloud, encoding)).points == 0);
}

TEST_CASE("pcd: ASCII accepts nan, inf, plus signs, blank lines, CRLF and values too small for a float") {
  const Cloud cloud = io::parse_pcd("c", header() + "nan +1.5 -inf\r\n\n1e-400 -0 1e-42\r\n");
  CHECK(std::isnan(cloud.find("x")->value(0)));
  CHECK(cloud.find("y")->value(0) == 1.5);
  CHECK(cloud.find("z")->value(0) == -INFINITY);
  CHECK(cloud.find("x")->value(1) == 0.0);
  CHECK(cloud.find("z")->value(1) == double(1e-42f));
}

TEST_CASE(
    "pcd: COUNT, POINTS, HEIGHT, VIEWPOINT and VERSION are optional, COLUMNS means FIELDS, comments are skipped") {
  const Cloud cloud = io::parse_pcd("c", "# one\nCOLUMNS a\n# two\nSIZE 2\nTYPE U\nWIDTH 2\nDATA ascii\n65535\n3\n");
  CHECK(cloud.points == 2);
  CHECK(cloud.columns[0].integer(0) == 65535);
}

TEST_CASE("pcd: binary data may be longer than the points, as in padded files") {
  const std::string bytes = header("x y z", "1", "binary") + std::string(12, '\0') + "padding";
  CHECK(io::parse_pcd("c", bytes).points == 1);
}

TEST_CASE("pcd: fields are found by their meaning") {
  struct Row {
    const char* name;
    io::CloudRole role;
  };
  const Row rows[] = {{"ring", io::CloudRole::kLayer},
                      {"line", io::CloudRole::kLayer},
                      {"layer", io::CloudRole::kLayer},
                      {"channel", io::CloudRole::kLayer},
                      {"line_index", io::CloudRole::kLayer},
                      {"laser_number", io::CloudRole::kLayer},
                      {"LaserNumber", io::CloudRole::kLayer},
                      {"intensity", io::CloudRole::kIntensity},
                      {"reflectivity", io::CloudRole::kIntensity},
                      {"i", io::CloudRole::kIntensity},
                      {"Intensity", io::CloudRole::kIntensity},
                      {"t", io::CloudRole::kTime},
                      {"time", io::CloudRole::kTime},
                      {"timestamp", io::CloudRole::kTime},
                      {"time_stamp", io::CloudRole::kTime},
                      {"offset", io::CloudRole::kTime},
                      {"offset_time", io::CloudRole::kTime},
                      {"X", io::CloudRole::kX}};
  for (const Row& row : rows) {
    CAPTURE(row.name);
    const std::vector<io::CloudField> fields = {
        {"azimuth", ValueType::kFloat32, 1}, {row.name, ValueType::kFloat32, 1}, {"_", ValueType::kUint8, 1}};
    for (int32_t role = 0; role <= int32_t(io::CloudRole::kTime); ++role)
      CHECK(io::find_role(fields, io::CloudRole(role)) == (io::CloudRole(role) == row.role ? 1 : -1));
  }
  // The more specific name wins, in any order.
  std::vector<io::CloudField> both = {{"channel", ValueType::kUint16, 1}, {"ring", ValueType::kUint16, 1}};
  CHECK(io::find_role(both, io::CloudRole::kLayer) == 1);
  both[1].count = 2;  // not one value per point
  CHECK(io::find_role(both, io::CloudRole::kLayer) == 0);
}

TEST_CASE("pcd: each kind of bad file gets its error") {
  const std::string good = header() + "1 2 3\n4 5 6\n";
  REQUIRE(io::parse_pcd("f", good).points == 2);
  struct Row {
    std::string bytes, sentence;
  };
  const std::string compressed = header("x y z", "2", "binary_compressed");
  const Row rows[] = {
      {"", "f: no DATA line"},
      {"VERSION 0.7\nFIELDS x", "f: no DATA line"},
      {"hello\nDATA ascii\n", "f:1: not a PCD file"},
      {"VERSION 0.7\nCOLOUR red\nDATA ascii\n", "f:2: 'COLOUR' is not a line of a PCD header"},
      {with_line(good, "VERSION", "VERSION 0.9"), "f:1: VERSION is not 0.5, 0.6 or 0.7"},
      {with_line(good, "FIELDS", "#"), "f: no FIELDS line"},
      {with_line(good, "FIELDS", "FIELDS"), "f:2: FIELDS names no field"},
      {with_line(good, "FIELDS", "FIELDS x y x"), "f:2: field 'x' is declared twice"},
      {with_line(good, "SIZE", "#"), "f: no SIZE line"},
      {with_line(good, "SIZE", "SIZE 4 4"), "f:3: SIZE has 2 entries, FIELDS has 3"},
      {with_line(good, "SIZE", "SIZE 4 4 9"), "f:3: SIZE holds '9', not a whole number from 1 to 8"},
      {with_line(good, "SIZE", "SIZE 4 4 2"), "f:4: field 'z' has type F of size 2"},
      {with_line(good, "SIZE", "SIZE 4 4 4\nSIZE 4 4 4"), "f:4: SIZE is given twice"},
      {with_line(good, "TYPE", "#"), "f: no TYPE line"},
      {with_line(good, "TYPE", "TYPE F F"), "f:4: TYPE has 2 entries, FIELDS has 3"},
      {with_line(good, "TYPE", "TYPE F F Q"), "f:4: field 'z' has type Q of size 4"},
      {with_line(good, "COUNT", "COUNT 1 1"), "f:5: COUNT has 2 entries, FIELDS has 3"},
      {with_line(good, "COUNT", "COUNT 1 1 0"), "f:5: COUNT holds '0'"},
      {with_line(good, "COUNT", "COUNT 1 1 99999999999"), "f:5: COUNT holds '99999999999'"},
      {with_line(good, "COUNT", "COUNT 1 1 1048576"), "f:5: a point of more than 1 MiB"},
      {with_line(good, "WIDTH", "WIDTH -1"), "f:6: WIDTH holds '-1'"},
      {with_line(good, "WIDTH", "WIDTH 2 2"), "f:6: WIDTH needs one number"},
      {with_line(good, "HEIGHT", "HEIGHT x"), "f:7: HEIGHT holds 'x'"},
      {with_line(good, "POINTS", "POINTS 3"), "f:8: POINTS is 3, WIDTH x HEIGHT is 2"},
      {with_line(good, "POINTS", "POINTS 99999999999999999999"), "f:8: POINTS holds"},
      {"FIELDS x\nSIZE 4\nTYPE F\nDATA ascii\n", "f: neither WIDTH nor POINTS is given"},
      {"FIELDS x\nSIZE 4\nTYPE F\nWIDTH 2147483647\nHEIGHT 2\nDATA ascii\n", "f:4: more than 2147483647 points"},
      {with_line(good, "POINTS", "POINTS 2\nVIEWPOINT 0 0"), "f:9: VIEWPOINT needs 7 numbers"},
      {with_line(good, "POINTS", "POINTS 2\nVIEWPOINT 0 0 0 1 0 0 a"), "f:9: VIEWPOINT holds 'a', no number"},
      {with_line(good, "DATA", "DATA zipped"), "f:9: DATA is not ascii, binary or binary_compressed"},
      {header() + "1 2 3\n4 5 6 7\n", "f:11: point 1 has 4 values, the header declares 3"},
      {header() + "1 2 3\n4 five 6\n", "f:11: field 'y' of point 1 is 'five', which its type cannot hold"},
      {header() + "1 2 3\n4 1e39 6\n", "f:11: field 'y' of point 1 is '1e39'"},
      {header() + "1 2 3      \n\n\n\n\n", "f:14: the data ends after 1 of 2 points"},
      {with_line(with_line(good, "TYPE", "TYPE U F F"), "SIZE", "SIZE 1 4 4"), ""},
      {with_line(with_line(header() + "1 2 3\n256 5 6\n", "TYPE", "TYPE U F F"), "SIZE", "SIZE 1 4 4"),
       "f:11: field 'x' of point 1 is '256'"},
      {with_line(with_line(header() + "1 2 3\n-1 5 6\n", "TYPE", "TYPE U F F"), "SIZE", "SIZE 8 4 4"),
       "f:11: field 'x' of point 1 is '-1'"},
      {with_line(header() + "1 2 3\n1.5 5 6\n", "TYPE", "TYPE I F F"), "f:11: field 'x' of point 1 is '1.5'"},
      {header("x y z", "2147483647"), "f: the data is too short: 0 bytes cannot hold the declared 2147483647 points"},
      {header("x y z", "2147483647", "binary") + "abc",
       "f: the data ends at field 'x' of point 0; 2147483647 points are declared"},
      {header("x y z", "2", "binary") + std::string(21, '\0'),
       "f: the data ends at field 'z' of point 1; 2 points are declared"},
      {compressed + "abc", "f: the data ends before its compressed size"},
      {compressed + pack({4, 23}, "abcd"), "f: the compressed data holds 23 bytes, 2 points are 24"},
      {compressed + pack({400, 24}, "abcd"), "f: the compressed data is cut off: 4 of 400 bytes are there"},
      {compressed + pack({4, 24}, std::string("\x20\x05\x01\x01", 4)), "f: the compressed data is corrupt"},
      {header("x y z", "100000000", "binary_compressed") + pack({4, 1200000000}, "abcd"),
       "f: the compressed data is corrupt: 4 bytes cannot hold 1200000000"},
  };
  for (const Row& row : rows) {
    CAPTURE(row.sentence);
    const std::string error = error_of([&] { io::parse_pcd("f", row.bytes); });
    if (row.sentence.empty())
      CHECK(error == "");
    else
      CHECK_MESSAGE(error.rfind(row.sentence, 0) == 0, error);
  }
}

TEST_CASE("pcd: missing files, folders and unwritable paths get their error") {
  const TempFolder folder;
  CHECK(error_of([&] { io::read_cloud(folder.path("no.pcd")); }) == folder.path("no.pcd") + ": no such file");
  CHECK(error_of([&] { io::read_cloud(folder.path()); }) == folder.path() + ": is a folder, a file is needed");
  Cloud cloud = every_type(1, 8);
  CHECK(error_of([&] { io::write_pcd(folder.path("no/cloud.pcd"), cloud); }) ==
        folder.path("no/cloud.pcd") + ": cannot be written: No such file or directory");
  cloud.columns[3].bytes.pop_back();
  CHECK(error_of([&] { io::format_pcd(cloud); }) == "column 'u8' is not as long as the first one");
}

TEST_CASE("pcd: the reader survives any single changed or missing byte") {
  const uint32_t seed = 11;
  CAPTURE(seed);
  std::mt19937 random(seed);
  Cloud cloud = every_type(seed, 12);
  int64_t refused = 0, tried = 0;
  for (const PcdEncoding encoding : kEncodings) {
    const std::string good = io::format_pcd(cloud, encoding);
    for (std::size_t i = 0; i < good.size(); ++i) {
      std::string cut = good.substr(0, i), changed = good;
      changed[i] = char(random() & 255);
      refused += !error_of([&] { io::parse_pcd("f", cut); }).empty();
      refused += !error_of([&] { io::parse_pcd("f", changed); }).empty();
      tried += 2;
    }
  }
  CHECK(refused > tried / 2);  // every cut file except those that lose only the last line's end
}

TEST_CASE("pcd: recorded clouds from other programs are read: binary with bytes, and compressed") {
  OVT_NEED_RECORDED("formats/hesai_xt16.pcd");
  const Cloud hesai = io::read_cloud(recorded("formats/hesai_xt16.pcd"));
  const Cloud velodyne = io::read_cloud(recorded("formats/vlp32_compressed.pcd"));
  CHECK(hesai.points == 26287);
  CHECK(velodyne.points == 26216);
  for (const Cloud* cloud : {&hesai, &velodyne}) {
    const auto column = [&](io::CloudRole role) -> const io::CloudColumn& {
      const int32_t field = io::find_role(cloud->fields, role);
      REQUIRE(field >= 0);
      return cloud->columns[std::size_t(field)];
    };
    CHECK(cloud->fields[std::size_t(io::find_role(cloud->fields, io::CloudRole::kLayer))].name == "channel");
    CHECK(column(io::CloudRole::kIntensity).type == ValueType::kUint8);
    const io::CloudColumn& distance = *cloud->find("distance");
    int64_t layers = 0, off = 0;
    for (std::size_t i = 0; i < std::size_t(cloud->points); ++i) {
      layers = std::max(layers, column(io::CloudRole::kLayer).integer(i));
      const double range = std::hypot(column(io::CloudRole::kX).value(i), column(io::CloudRole::kY).value(i),
                                      column(io::CloudRole::kZ).value(i));
      off += std::fabs(range - distance.value(i)) > 0.01;  // the file's range column: columns match
    }
    CHECK(layers == (cloud == &hesai ? 15 : 31));
    CHECK(off == 0);
  }
}
