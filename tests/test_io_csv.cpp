// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
#include "tools/io/csv.h"

#include <doctest/doctest.h>

#include <cmath>
#include <limits>
#include <random>

#include "tests/support/temp_folder.h"
#include "tools/io/ego_file.h"

using namespace overtake;
using io::Csv;

TEST_CASE("csv: the delimiter and the header are detected") {
  struct Row {
    const char* what;
    const char* text;
  };
  const Row rows[] = {
      {"commas", "x_m,y_m\n1,2\n3,4\n"},
      {"semicolons and blanks", "x_m; y_m\n1; 2\n3; 4\n"},
      {"white space", "x_m  y_m\n1 2\n3\t4\n"},
      {"header in the last comment", "# made by hand\n# x_m, y_m\n1,2\n3,4\n"},
      {"comments, empty lines, CRLF, a byte order mark", "\xef\xbb\xbf# c\r\nx_m,y_m\r\n\r\n1,2\r\n# c\r\n3,4"},
      {"a delimiter at the end of the lines", "x_m,y_m,\n1,2,\n3,4,\n"},
      {"units and capitals", "X_m(m),Y_M (m)\n1,2\n3,4\n"}};
  for (const Row& row : rows) {
    CAPTURE(row.what);
    const Csv csv = Csv::parse("f", row.text);
    REQUIRE(csv.row_count() == 2);
    CHECK(csv.column_count() == 2);
    CHECK(csv.number(0, csv.need({"x_m"})) == 1);
    CHECK(csv.number(1, csv.need({"y", "y_m"})) == 4);
  }
  const Csv indexed = Csv::parse("f", ",x_m,y_m\n0,1,2\n1,3,4\n");  // by pandas
  REQUIRE(indexed.row_count() == 2);
  CHECK(indexed.number(1, indexed.need({"x_m"})) == 3);
  CHECK_FALSE(Csv::parse("f", ",1,2\n,3,4\n").has_header());
  CHECK_FALSE(Csv::parse("f", "x_m,,y_m\n1,2,3\n").has_header());
  const Csv bare = Csv::parse("f", "# just words\n1,2\n3,4\n");
  CHECK_FALSE(bare.has_header());
  CHECK(bare.row_count() == 2);
}

TEST_CASE("csv: each kind of bad table gets its error with line and column") {
  struct Row {
    const char* text;
    const char* sentence;
  };
  const Row rows[] = {{"", "f: holds no row"},
                      {"# only a comment\n", "f: holds no row"},
                      {"x_m,y_m\n", "f: holds no row"},
                      {"x_m,y_m\n1,2\n3\n", "f:3: 1 cells, the lines before have 2"},
                      {"x_m,y_m\n1,2\n3,4,5\n", "f:3: 3 cells, the lines before have 2"},
                      {"x_m,y_m\n1,2\n3,four\n", "f:3:3: y_m 'four' is not a number"},
                      {"x_m,y_m\n1,2\n3,\n", "f:3:3: y_m '' is not a number"},
                      {"x_m,y_m\n1,2\n,4\n", "f:3:1: x_m '' is not a number"},
                      {"x_m,y_m\n1,nan\n", "f:2:3: y_m is not finite"},
                      {"x_m,y_m\n1,1e999\n", "f:2:3: y_m '1e999' is not a number"},
                      {"x_m,z_m\n1,2\n", "f: no column y_m or y (there are: x_m, z_m)"},
                      {"1,2\n3,4\n", "f:1: no header line names the columns"}};
  for (const Row& row : rows) {
    CAPTURE(row.sentence);
    const std::string error = error_of([&] {
      const Csv csv = Csv::parse("f", row.text);
      csv.numbers(csv.need({"x_m"}));
      csv.numbers(csv.need({"y_m", "y"}));
    });
    CHECK(error == row.sentence);
  }
  const Csv csv = Csv::parse("f", "stamp_ns\n12\n1.5\n9223372036854775808\n");
  CHECK(csv.integer(0, 0) == 12);
  CHECK(error_of([&] { csv.integer(1, 0); }) == "f:3:1: stamp_ns '1.5' is not a whole number");
  CHECK(error_of([&] { csv.integer(2, 0); }) == "f:4:1: stamp_ns '9223372036854775808' is not a whole number");
}

TEST_CASE("csv: two columns of one name are an error where the name is read") {
  const Csv csv = Csv::parse("a.csv", "x_m,Y_m,y_m(m),note,note\n1,2,3,a,b\n");
  CHECK(csv.find({"x_m"}) == 0);
  CHECK(error_of([&] { csv.find({"y_m", "y"}); }) == "a.csv: two columns are named y_m");
  CHECK(error_of([&] { csv.need({"y", "y_m"}); }) == "a.csv: two columns are named y_m");
}

TEST_CASE("csv: numbers are written in the shortest text that reads back as the same value") {
  const TempFolder folder;
  const uint32_t seed = 17;
  CAPTURE(seed);
  std::mt19937_64 random(seed);
  std::vector<double> values = {0.0, -0.0, 0.1, 1.0 / 3, 1e300, -1e-300, 5e-324, 123456789.125};
  for (int32_t i = 0; i < 1000; ++i) values.push_back(std::ldexp(double(random()), int(random() % 200) - 160));
  {
    io::CsvWriter csv(folder.path("t.csv"), "d,f,i,u,t");
    for (const double v : values)
      csv.cell(v).cell(float(v)).cell(INT64_MIN).cell(UINT64_MAX).cell(std::string_view("text")).end_row();
    csv.flush();
  }
  const Csv back = Csv::read(folder.path("t.csv"));
  REQUIRE(back.row_count() == values.size());
  for (std::size_t i = 0; i < values.size(); ++i) {
    CHECK(back.number(i, 0) == values[i]);
    CHECK(std::signbit(back.number(i, 0)) == std::signbit(values[i]));
    if (std::isfinite(float(values[i]))) CHECK(float(back.number(i, 1)) == float(values[i]));
    CHECK(back.integer(i, 2) == INT64_MIN);
    CHECK(back.text(i, 3) == "18446744073709551615");
  }
  CHECK(io::read_whole_file(folder.path("t.csv")).find("\n0.1,0.1,") != std::string::npos);
}

TEST_CASE("csv: a table that cannot be written gives an error") {
  const TempFolder folder;
  CHECK(error_of([&] { io::CsvWriter csv(folder.path("no/t.csv"), "a"); }) ==
        folder.path("no/t.csv") + ": cannot be written: No such file or directory");
  if (std::filesystem::exists("/dev/full")) {
    io::CsvWriter csv("/dev/full", "a");
    CHECK(error_of([&] { csv.flush(); }) == "/dev/full: cannot be written: No space left on device");
    CHECK(error_of([&] { io::write_whole_file("/dev/full", "a"); }) ==
          "/dev/full: cannot be written: No space left on device");
  }
}

TEST_CASE("ego file: all columns are read, in any order") {
  const TempFolder folder;
  const auto rows = io::read_ego_file(folder.write("ego.csv",
                                                   "yaw_rad,stamp_ns,x_m,y_m,z_m,roll_rad,pitch_rad,speed_mps,yaw_rate_"
                                                   "rps\n0.5,1672875115412000123,1,2,3,0.1,0.2,40,0.3\n"));
  REQUIRE(rows.size() == 1);
  CHECK(rows[0].stamp_ns == 1672875115412000123);
  CHECK(rows[0].x_m == 1);
  CHECK(rows[0].z_m == 3);
  CHECK(rows[0].pitch_rad == 0.2);
  CHECK(rows[0].yaw_rad == 0.5);
  CHECK(rows[0].speed_mps == 40);
  CHECK(rows[0].yaw_rate_rps == 0.3);
}

TEST_CASE("ego file: columns that are not read are named") {
  const TempFolder folder;
  std::vector<std::string> notes;
  io::read_ego_file(folder.write("all.csv", "time(s),x,y,phi,z,roll_rad,pitch_rad,vx,omega\n1,2,3,0,0,0,0,9,0\n"),
                    &notes);
  CHECK(notes.empty());
  io::read_ego_file(folder.write("index.csv", ",stamp_ns,x_m,y_m,yaw_rad\n0,1,2,3,0\n"), &notes);
  CHECK(notes.empty());
  const std::string path = folder.write("ego.csv", "stamp_ns,x_m,y_m,yaw_rad,sped_mps,yaw_rate_dps\n1,2,3,0,40,1\n");
  io::read_ego_file(path, &notes);
  CHECK(notes == std::vector{path + " has columns that are not read: sped_mps, yaw_rate_dps"});
}

TEST_CASE("ego file: time may be in seconds, and missing speed and yaw rate follow from the neighbours") {
  const TempFolder folder;
  // A circle of 100 m at 20 m/s: yaw rate 0.2 rad/s, through the wrap at pi.
  std::string text = "time(s),x(m),y(m),phi(rad)\n";
  for (int32_t i = 0; i < 100; ++i) {
    const double t = 0.05 * i, a = 0.2 * t + 2.8;
    text += std::to_string(t) + "," + std::to_string(100 * std::sin(a)) + "," + std::to_string(-100 * std::cos(a)) +
            "," + std::to_string(std::remainder(a, 2 * 3.14159265358979)) + "\n";
  }
  const auto rows = io::read_ego_file(folder.write("ego.csv", text));
  CHECK(rows[20].stamp_ns == 1000000000);
  for (const auto& row : rows) {
    CHECK(row.speed_mps == doctest::Approx(20).epsilon(0.001));
    CHECK(row.yaw_rate_rps == doctest::Approx(0.2).epsilon(0.001));
  }
}

TEST_CASE("ego file: each kind of bad file gets its error") {
  const TempFolder folder;
  struct Row {
    const char* text;
    const char* sentence;
  };
  const Row rows[] = {{"stamp_ns,x_m,y_m\n1,2,3\n", ": no column yaw_rad or heading_rad"},
                      {"x_m,y_m,yaw_rad\n1,2,3\n", ": no column stamp_ns or timestamp_ns"},
                      {"stamp_ns,x_m,y_m,yaw_rad\n5,0,0,0\n5,0,0,0\n", ":3:1: the stamp does not grow"},
                      {"time,x_m,y_m,yaw_rad\n1e18,0,0,0\n", ":2:1: time is not in seconds"},
                      {"stamp_ns,x_m,y_m,yaw_rad\n5,0,inf,0\n", ":2:5: y_m is not finite"},
                      {"stamp_ns,x_m,y_m,yaw_rad,roll_deg,pitch_rad\n5,0,0,0,0,0\n",
                       ": has pitch_rad and no roll_rad (there are: stamp_ns, x_m, y_m, yaw_rad, roll_deg, pitch_rad)"},
                      {"stamp_ns,x_m,y_m,yaw_rad,roll_rad\n5,0,0,0,0\n", ": has roll_rad and no pitch_rad"}};
  for (const Row& row : rows) {
    const std::string path = folder.write("ego.csv", row.text);
    const std::string error = error_of([&] { io::read_ego_file(path); });
    CHECK_MESSAGE(error.rfind(path + row.sentence, 0) == 0, error);
  }
}
