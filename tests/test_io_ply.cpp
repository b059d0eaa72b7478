// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
#include "tools/io/ply.h"

#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <filesystem>
#include <limits>

#include "tests/support/bags.h"
#include "tests/support/peak_memory.h"
#include "tests/support/temp_folder.h"
#include "tools/io/formats.h"
#include "tools/io/pcd.h"

using namespace overtake;
using namespace overtake::test;
using io::PlyEncoding;
using io::ValueType;

namespace {

constexpr PlyEncoding kEncodings[] = {PlyEncoding::kAscii, PlyEncoding::kLittleEndian, PlyEncoding::kBigEndian};

std::string header(const std::string& format, const std::string& rest) {
  return "ply\nformat " + format + " 1.0\n" + rest + "end_header\n";
}

const std::string kThree = "property float x\nproperty float y\nproperty float z\n";

template <class T>
std::string raw(T value, bool big) {
  std::string bytes(reinterpret_cast<const char*>(&value), sizeof value);
  if (big) std::reverse(bytes.begin(), bytes.end());
  return bytes;
}

// Every type that PLY has, at its ends.
io::Cloud every_ply_type() {
  const auto ends = [](auto zero) {
    using T = decltype(zero);
    return std::vector<T>{std::numeric_limits<T>::lowest(), std::numeric_limits<T>::max(), T(1) / T(3)};
  };
  io::Cloud cloud;
  io::add_column(cloud, "x", ValueType::kFloat32, ends(0.0f));
  io::add_column(cloud, "y", ValueType::kFloat64, ends(0.0));
  io::add_column(cloud, "i8", ValueType::kInt8, ends(int8_t(0)));
  io::add_column(cloud, "u8", ValueType::kUint8, ends(uint8_t(0)));
  io::add_column(cloud, "i16", ValueType::kInt16, ends(int16_t(0)));
  io::add_column(cloud, "ring", ValueType::kUint16, ends(uint16_t(0)));
  io::add_column(cloud, "i32", ValueType::kInt32, ends(int32_t(0)));
  io::add_column(cloud, "t", ValueType::kUint32, ends(uint32_t(0)));
  return cloud;
}

}  // namespace

TEST_CASE("ply: every type comes back bit for bit from all three encodings") {
  const io::Cloud cloud = every_ply_type();
  for (const PlyEncoding encoding : kEncodings) {
    CAPTURE(int(encoding));
    const io::Cloud back = io::parse_ply("f", io::format_ply(cloud, encoding));
    CHECK(back.points == 3);
    REQUIRE(back.columns.size() == cloud.columns.size());
    for (std::size_t c = 0; c < cloud.columns.size(); ++c) {
      CHECK(back.fields[c].name == cloud.fields[c].name);
      CHECK(back.columns[c].type == cloud.columns[c].type);
      CHECK(back.columns[c].bytes == cloud.columns[c].bytes);
    }
  }
}

TEST_CASE("ply: a file made by hand, with lists, other elements, comments and CloudCompare's names") {
  for (const bool big : {false, true}) {
    const auto f32 = [&](float v) { return raw(v, big); };
    const auto u16 = [&](int v) { return raw(uint16_t(v), big); };
    const auto u8 = [](int v) { return std::string(1, char(v)); };
    const std::string text = header(big ? "binary_big_endian" : "binary_little_endian",
                                    "comment made by hand\nobj_info none\n"
                                    "element camera 2\nproperty uchar id\nproperty list ushort float lens\n"
                                    "element pose 1\nproperty double a\n"
                                    "element nothing 5\n"
                                    "element vertex 2\nproperty float32 x\nproperty list uchar int16 seen_by\n"
                                    "property float y\nproperty float z\nproperty uchar scalar_Intensity\n"
                                    "property ushort scalar_ring\n"
                                    "element face 1000\nproperty list uchar int vertex_index\n");
    const std::string cameras = u8(1) + u16(2) + f32(9) + f32(9) + u8(2) + u16(0) + raw(7.0, big);
    const std::string first = f32(1.5f) + u8(2) + u16(8) + u16(8) + f32(-2) + f32(0.25f) + u8(200) + u16(31);
    const std::string second = f32(4) + u8(0) + f32(5) + f32(6) + u8(3) + u16(300);
    const io::Cloud cloud = io::parse_ply("f", text + cameras + first + second);  // no faces: nobody reads them
    CHECK(cloud.points == 2);
    REQUIRE(cloud.fields.size() == 5);
    CHECK(cloud.find("x")->value(0) == 1.5);
    CHECK(cloud.find("y")->value(0) == -2);
    CHECK(cloud.find("z")->value(1) == 6);
    CHECK(cloud.find("Intensity")->integer(0) == 200);
    CHECK(cloud.find("ring")->integer(1) == 300);
    CHECK(io::find_role(cloud.fields, io::CloudRole::kIntensity) == 3);
    CHECK(io::find_role(cloud.fields, io::CloudRole::kLayer) == 4);
  }
  const io::Cloud text = io::parse_ply(
      "f",
      "ply\r\nformat ascii 1.0\r\nelement camera 1\r\nproperty list uchar int a\r\nelement vertex 2\r\n"
      "property list uchar int b\r\nproperty double x\r\nproperty int ring\r\nproperty int scalar_ring\r\n"
      "end_header\r\n3 1 2 3\r\n\r\n2 7 7 nan 4 1\r\n  0 +1.5\t5 2");
  CHECK(std::isnan(text.find("x")->value(0)));
  CHECK(text.find("x")->value(1) == 1.5);
  CHECK(text.find("ring")->integer(1) == 5);
  CHECK(text.find("scalar_ring")->integer(1) == 2);  // keeps its prefix: there is a ring
}

TEST_CASE("ply: a folder of PLY files gives the hash of the same folder of PCD files") {
  const TempFolder folder;
  std::filesystem::create_directories(folder.path("pcd"));
  int64_t frames = 0, detections = 0;
  for (int32_t frame = 0; frame < 3; ++frame) {
    const io::Cloud cloud = swept_cloud(16, 200, 0.2 * frame);
    io::write_pcd(folder.path("pcd/00000" + std::to_string(frame) + ".pcd"), cloud);
    for (const PlyEncoding encoding : kEncodings)
      folder.write("ply" + std::to_string(int(encoding)) + "/00000" + std::to_string(frame) + ".ply",
                   io::format_ply(cloud, encoding));
  }
  const uint64_t expected = hash_of_run(folder.path("pcd"), swept_rig(16), "", &frames, &detections);
  CHECK(frames == 3);
  CHECK(detections > 0);
  for (const PlyEncoding encoding : kEncodings)
    CHECK(hash_of_run(folder.path("ply" + std::to_string(int(encoding))), swept_rig(16)) == expected);
}

TEST_CASE("ply: each kind of bad file gets its sentence") {
  const std::string vertices = "element vertex 2\n" + kThree, binary = header("binary_little_endian", vertices);
  const std::string list = "element vertex 1\nproperty list char uchar l\n";
  struct Row {
    std::string bytes, sentence;
  };
  const Row rows[] = {
      {"", "f: no line end_header: not a PLY file, or cut off in its header"},
      {"ply\nformat ascii 1.0\n", "f: no line end_header"},
      {"plyx\nend_header\n", "f:1: not a PLY file"},
      {"ply\ncomment " + std::string(2 << 20, 'a') + "\nend_header\n", "f: no line end_header within the first MiB"},
      {"ply\nelement vertex 0\nend_header\n", "f: no line format"},
      {"ply\nformat ascii 2.0\nend_header\n",
       "f:2: format is not ascii, binary_little_endian or binary_big_endian 1.0"},
      {"ply\nformat zipped 1.0\nend_header\n", "f:2: format is not ascii"},
      {header("ascii", "colour red\n"), "f:3: 'colour' is not a line of a PLY header"},
      {header("ascii", "element face 1\n"), "f: has no element vertex: it holds no points"},
      {header("ascii", "element vertex 1\n"), "f: its element vertex has no property"},
      {header("ascii", "element vertex\n"), "f:3: element needs a name and a number"},
      {header("ascii", "element vertex -1\n"), "f:3: element vertex has '-1' rows"},
      {header("ascii", "element vertex 2147483648\n"), "f:3: element vertex has '2147483648' rows"},
      {header("ascii", "element a 1\nelement a 1\n"), "f:4: element 'a' is declared twice"},
      {header("ascii", "property float x\n"), "f:3: a property before the first element"},
      {header("ascii", "element vertex 1\nproperty float\n"), "f:4: property needs a type and a name"},
      {header("ascii", "element vertex 1\nproperty int64 x\n"), "f:4: property 'x' has an unknown type"},
      {header("ascii", "element vertex 1\nproperty list float int x\n"), "f:4: property 'x' has an unknown type"},
      {header("ascii", "element vertex 1\nproperty float x\nproperty float x\n"),
       "f:5: property 'x' is declared twice"},
      {header("ascii", vertices) + "1 2 3\n4      5\n", "f:9: vertex 1 has too few values"},
      {header("ascii", vertices) + "1 2 3\n4 5 6 7\n", "f:9: vertex 1 has more values than the header declares"},
      {header("ascii", vertices) + "1 2 3\n4 five 6\n",
       "f:9: property 'y' of vertex 1 is 'five', which its type cannot hold"},
      {header("ascii", vertices) + "1 2 3      \n\n\n", "f:10: the data ends after 1 of the 2 rows of element vertex"},
      {header("ascii", vertices) + "1 2\n", "f: the data is too short: 4 bytes cannot hold the declared 2 rows"},
      {header("ascii", list) + "9 1\n", "f:6: vertex 0 has too few values"},
      {header("ascii", list) + "-1 1\n", "f:6: property 'l' of vertex 0 is '-1'"},
      {header("ascii", "element a 1000000\nproperty int b\n" + vertices) + "1\n", "f: the data is too short"},
      {binary + std::string(23, '\0'),
       "f: the data ends at byte " + std::to_string(binary.size() + 23) + ", within row 1 of the 2 of element vertex"},
      {header("binary_big_endian", "element vertex 2147483647\n" + kThree) + "abc", "f: the data ends at byte "},
      {header("binary_big_endian", "element a 9\nproperty int b\n" + vertices) + "abc", "f: the data ends at byte "},
      {header("binary_little_endian", list) + "\x03" + "ab", "f: the data ends at byte "},
      {header("binary_little_endian", list) + "\xff" + "ab", "f: list 'l' of row 0 of element vertex has -1 values"},
  };
  CHECK(io::parse_ply("f", binary + std::string(24, '\0') + "padding").points == 2);
  for (const Row& row : rows) {
    CAPTURE(row.sentence);
    const std::string error = error_of([&] { io::parse_ply("f", row.bytes); });
    CHECK_MESSAGE(error.rfind(row.sentence, 0) == 0, error);
  }
}

TEST_CASE("ply: points are held against the memory limit before they are unpacked") {
  io::Cloud cloud;
  for (const char* name : {"x", "y", "z"})
    io::add_column(cloud, name, ValueType::kFloat64, std::vector<double>(500'000));
  std::string lists = header("ascii", "element vertex 1\nproperty list uint int l\nproperty float x\n") + "3000000";
  for (int32_t i = 0; i < 3'000'000; ++i) lists += " 1";
  lists += " 2\n";
  const std::string files[] = {io::format_ply(cloud, PlyEncoding::kAscii),
                               io::format_ply(cloud, PlyEncoding::kLittleEndian)};
  const MemoryLimit limit(14 << 20);
  const PeakMemory peak;
  for (const std::string& file : files)
    CHECK(error_of([&] { io::parse_ply("f", file); }).rfind("f: reading its 500000 points needs ", 0) == 0);
  CHECK(io::parse_ply("f", lists).find("x")->value(0) == 2);  // nobody keeps the list
  if (kMemoryIsOurs) CHECK(peak.grown_bytes() < (14 << 20));
}
