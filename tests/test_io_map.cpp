// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
#include "tools/io/map_file.h"

#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>

#include "tests/support/bags.h"
#include "tests/support/recorded.h"
#include "tests/support/temp_folder.h"
#include "tools/io/csv.h"

using namespace overtake;
using io::MapData;

namespace {

constexpr double kPi = 3.14159265358979323846;

// A circle of 100 m with the left bound 3 m and the right one 5 m away; turn +1: counter-clockwise.
struct Circle {
  int32_t points = 200, turn = 1;
  bool open = false, repeat_first = false;
  double radius = 100;

  template <class F>
  std::string rows(F&& row) const {
    std::string text;
    const int32_t n = open ? points / 2 : points;
    for (int32_t i = 0; i < n + (repeat_first ? 1 : 0); ++i) {
      const double a = turn * 2 * kPi * (i % points) / points;
      text += row(std::cos(a), std::sin(a));
    }
    return text;
  }
  std::string bound(double at_radius) const {
    return rows(
        [&](double c, double s) { return std::to_string(at_radius * c) + "," + std::to_string(at_radius * s) + "\n"; });
  }
};

std::string line_of(std::initializer_list<double> cells, const char* delimiter = ",") {
  std::string text;
  for (const double cell : cells) text += (text.empty() ? "" : delimiter) + std::to_string(cell);
  return text + "\n";
}

// Bounds of the map at point i, from the direction of the points: left is to the left of it.
struct Sides {
  double left_x, left_y, right_x, right_y;
};
Sides sides_at(const MapData& map, std::size_t i) {
  const std::size_t n = map.x_m.size(), before = (i + n - 1) % n, after = (i + 1) % n;
  const double dx = map.x_m[after] - map.x_m[before], dy = map.y_m[after] - map.y_m[before],
               length = std::hypot(dx, dy);
  const double nx = -dy / length, ny = dx / length;
  return {map.x_m[i] + nx * map.width_left_m[i], map.y_m[i] + ny * map.width_left_m[i],
          map.x_m[i] - nx * map.width_right_m[i], map.y_m[i] - ny * map.width_right_m[i]};
}

double nearest(const std::vector<double>& x, const std::vector<double>& y, double px, double py) {
  double best = 1e9;
  for (std::size_t i = 0; i < x.size(); ++i) best = std::min(best, std::hypot(x[i] - px, y[i] - py));
  return best;
}

}  // namespace

TEST_CASE("map file: in a counter-clockwise centre line, left is inside") {
  const TempFolder folder;
  for (const bool header : {true, false})
    for (const bool repeat : {true, false}) {
      Circle circle;
      circle.repeat_first = repeat;
      const std::string rows = circle.rows([](double c, double s) { return line_of({100 * c, 100 * s, 5, 3}); });
      const MapData map =
          io::read_map(folder.write("map.csv", (header ? "x_m,y_m,w_tr_right_m,w_tr_left_m\n" : "") + rows));
      CHECK(map.closed);
      CHECK(map.x_m.size() == 200);  // the repeated first point is dropped
      CHECK(map.banking_rad.empty());
      const Sides sides = sides_at(map, 17);
      CHECK(std::hypot(sides.left_x, sides.left_y) == doctest::Approx(97).epsilon(1e-4));
      CHECK(std::hypot(sides.right_x, sides.right_y) == doctest::Approx(105).epsilon(1e-4));
    }
}

TEST_CASE("map file: in a race line table normvec and widths give the bounds, for either direction of normvec") {
  const TempFolder folder;
  for (const int32_t turn : {1, -1})
    for (const int32_t outward : {1, -1}) {
      CAPTURE(turn);
      CAPTURE(outward);
      // bound "right" = ref + normvec * 5, bound "left" = ref - normvec * 3
      Circle circle;
      circle.turn = turn;
      const std::string rows = circle.rows([&](double c, double s) {
        return line_of({100 * c, 100 * s, 5, 3, outward * c, outward * s, -0.1}, "; ");
      });
      const MapData map = io::read_map(folder.write(
          "map.csv",
          "# a\n# b\n# x_ref_m; y_ref_m; width_right_m; width_left_m; x_normvec_m; y_normvec_m; banking_rad\n" + rows));
      CHECK(map.closed);
      REQUIRE(map.banking_rad.size() == 200);
      CHECK(map.notes.size() == (turn > 0));  // in a left turn, -0.1 leans outwards
      CHECK(map.banking_rad[3] == (turn > 0 ? 0.1 : -0.1));
      const Sides sides = sides_at(map, 17);
      const double outer = outward > 0 ? 105 : 103, inner = outward > 0 ? 97 : 95;
      const double left = turn > 0 ? inner : outer, right = turn > 0 ? outer : inner;
      CHECK(std::hypot(sides.left_x, sides.left_y) == doctest::Approx(left).epsilon(1e-4));
      CHECK(std::hypot(sides.right_x, sides.right_y) == doctest::Approx(right).epsilon(1e-4));
    }
}

TEST_CASE("map file: banking of the opposite sign is turned round, as it is kept where it tells nothing") {
  const TempFolder folder;
  struct Row {
    int32_t turn;
    double banking, odd;  // odd: of a tenth of the points
    bool turned, open = false;
  };
  const Row rows[] = {{1, 0.3, 0.3, false},       {1, -0.3, -0.3, true}, {-1, -0.3, -0.3, false},
                      {-1, 0.3, 0.3, true},       {1, -0.3, 0.3, true},  {1, 0.3, -0.3, false},
                      {1, -0.005, -0.005, false}, {1, 0.0, 0.0, false},  {1, -0.3, -0.3, true, true},
                      {1, 0.3, 0.3, false, true}};
  for (const Row& row : rows) {
    CAPTURE(row.turn);
    CAPTURE(row.banking);
    CAPTURE(row.odd);
    Circle circle;
    circle.points = 1000;  // every 0.6 m, to the decimetre: the line turns more by rounding than by the circuit
    circle.turn = row.turn;
    circle.open = row.open;
    int32_t i = 0;
    std::string text = "x_m,y_m,w_tr_right_m,w_tr_left_m,banking_rad\n";
    text += circle.rows([&](double c, double s) {
      return line_of({std::round(1e3 * c) / 10, std::round(1e3 * s) / 10, 5, 3, i++ < 100 ? row.odd : row.banking});
    });
    const MapData map = io::read_map(folder.write("map.csv", text));
    CHECK(map.closed != row.open);
    CHECK(map.notes.size() == row.turned);
    CHECK(map.banking_rad[50] == (row.turned ? -row.odd : row.odd));
    CHECK(map.banking_rad[400] == (row.turned ? -row.banking : row.banking));
  }
}

TEST_CASE("map file: a chicane whose turns lean outwards as much as inwards is kept") {
  const TempFolder folder;
  std::string text = "x_m,y_m,w_tr_right_m,w_tr_left_m,banking_rad\n";
  for (int32_t i = 0; i <= 100; ++i) text += line_of({5.0 * i, 40 * std::sin(2 * kPi * i / 100), 5, 5, -0.3});
  CHECK(io::read_map(folder.write("map.csv", text)).notes.empty());
}

TEST_CASE("map file: with two bounds in any order and direction, left is left of the first file's points") {
  const TempFolder folder;
  for (const int32_t turn_first : {1, -1})
    for (const int32_t turn_second : {1, -1})
      for (const bool inner_first : {true, false}) {
        CAPTURE(turn_first);
        CAPTURE(turn_second);
        CAPTURE(inner_first);
        Circle first, second;
        first.turn = turn_first;
        second.turn = turn_second;
        second.points = 173;
        second.repeat_first = true;
        const MapData map = io::read_map(folder.write("a.csv", first.bound(inner_first ? 95 : 103)) + "," +
                                         folder.write("b.csv", second.bound(inner_first ? 103 : 95)));
        REQUIRE(map.is_bounds());
        CHECK(map.closed);
        CHECK(map.left_x_m.size() + map.right_x_m.size() == 373);
        CHECK(std::hypot(map.left_x_m[5], map.left_y_m[5]) == doctest::Approx(turn_first > 0 ? 95 : 103).epsilon(1e-4));
        for (const auto& [x, y] : {std::pair(&map.left_x_m, &map.left_y_m), std::pair(&map.right_x_m, &map.right_y_m)})
          CHECK((((*x)[0] * (*y)[1] - (*x)[1] * (*y)[0]) > 0) == (turn_first > 0));  // both run like the first file
      }
}

TEST_CASE("map file: columns that no reader knows are named, in each of two bounds") {
  const TempFolder folder;
  const std::string line =
      folder.write("map.csv", "x_m,y_m,w_tr_right_m,w_tr_left_m,banking_deg\n0,0,5,5,8.5\n9,0,5,5,8.5\n18,0,5,5,8.5\n");
  CHECK(io::read_map(line).notes == std::vector{line + " has a column that is not read: banking_deg"});
  const std::string left = folder.write("a.csv", "x_m,y_m,z_m,s_m\n0,5,0,0\n9,5,0,9\n18,5,0,18\n");
  const std::string right = folder.write("b.csv", "x_m,y_m\n0,0\n9,0\n18,0\n");
  CHECK(io::read_map(left + "," + right).notes == std::vector{left + " has columns that are not read: z_m, s_m"});
}

TEST_CASE("map file: a line whose ends do not meet is open") {
  const TempFolder folder;
  Circle circle;
  circle.open = true;
  const std::string rows = circle.rows([](double c, double s) { return line_of({100 * c, 100 * s, 5, 3}); });
  CHECK_FALSE(io::read_map(folder.write("map.csv", rows)).closed);
}

TEST_CASE("map file: each kind of bad file gets its error") {
  const TempFolder folder;
  struct Row {
    const char* text;
    const char* sentence;
  };
  const Row rows[] = {{"1,2\n3,4\n5,6\n", ": is one bound; a map of bounds needs two files, FILE1,FILE2"},
                      {"x_m,y_m,w\n1,2,3\n", ": no column width_right_m or w_tr_right_m"},
                      {"1,2,3\n3,4,5\n", ":1: no header line names the columns"},
                      {"1,2,3,3\n2,2,3,3\n", ": a track needs at least 3 different points"},
                      {"1,2,3,3\n1,2,3,3\n1,2,3,3\n2,2,3,3\n", ": a track needs at least 3 different points"},
                      {"1,2,3,3\n2,2,3,-3\n3,2,3,3\n", ":2:7: a width is negative"},
                      {"1,2,3,3,0\n2,2,3,3,8.5\n3,2,3,3,0\n", ":2:9: banking_rad is beyond 1 rad (degrees?)"},
                      {"1,2,3,3,0\n2,2,3,3,-1.1\n3,2,3,3,0\n", ":2:9: banking_rad is beyond 1 rad (degrees?)"},
                      {"1,2,3,3\n2,2,3,wide\n3,2,3,3\n", ":2:7: 'wide' is not a number"}};
  for (const Row& row : rows) {
    const std::string path = folder.write("map.csv", row.text);
    const std::string error = error_of([&] { io::read_map(path); });
    CHECK_MESSAGE(error.rfind(path + row.sentence, 0) == 0, error);
  }
  const std::string log = folder.path("log.mcap");
  test::write_mcap(log, test::straight_drive("/odometry", 0, 100'000'000));
  CHECK(error_of([&] { io::read_map(log); }) == log + ": holds no map (attachment map.csv of an MCAP log)");
  Circle closed, open;
  open.open = true;
  const std::string a = folder.write("a.csv", closed.bound(95)), b = folder.write("b.csv", open.bound(103));
  CHECK(error_of([&] { io::read_map(a + "," + b); }) == b + ": is open, " + a + " is not");
  CHECK(error_of([&] { io::read_map(a + "," + folder.path("no.csv")); }) == folder.path("no.csv") + ": no such file");
}

TEST_CASE("map file: both recorded tables of one speedway give the same bounds, and left is the infield") {
  OVT_NEED_RECORDED("lvms/LVMS_2d_centerline_banking.csv");
  const MapData table = io::read_map(recorded("lvms/traj_ltpl_cl_LVMS_GPS.csv"));
  const MapData plain = io::read_map(recorded("lvms/LVMS_2d_centerline_banking.csv"));
  for (const MapData* map : {&table, &plain}) {
    CHECK(map->closed);
    CHECK(map->banking_rad.size() == map->x_m.size());
    CHECK(map->notes[0].ends_with(
        ": its banking has the opposite sign (positive: the right side is higher): it is turned "
        "round"));
    CHECK(*std::min_element(map->banking_rad.begin(), map->banking_rad.end()) > 0.09);
    double area = 0;  // positive: counter-clockwise, so the infield is on the left
    for (std::size_t i = 0; i < map->x_m.size(); ++i) {
      const std::size_t j = (i + 1) % map->x_m.size();
      area += (map->x_m[i] * map->y_m[j] - map->x_m[j] * map->y_m[i]) / 2;
    }
    CHECK(area > 400000);
  }
  std::vector<double> left_x, left_y, right_x, right_y;
  for (std::size_t i = 0; i < plain.x_m.size(); ++i) {
    const Sides sides = sides_at(plain, i);
    left_x.push_back(sides.left_x);
    left_y.push_back(sides.left_y);
    right_x.push_back(sides.right_x);
    right_y.push_back(sides.right_y);
  }
  for (std::size_t i = 0; i < table.x_m.size(); i += 20) {
    const Sides sides = sides_at(table, i);
    CHECK(nearest(left_x, left_y, sides.left_x, sides.left_y) < 0.3);
    CHECK(nearest(right_x, right_y, sides.right_x, sides.right_y) < 0.3);
  }
}

TEST_CASE("map file: the recorded drive lies within the recorded bounds, in the track's direction") {
  OVT_NEED_RECORDED("lvms/lvms_inner_bound.csv");
  const MapData map = io::read_map(recorded("lvms/lvms_inner_bound.csv") + "," + recorded("lvms/lvms_outer_bound.csv"));
  REQUIRE(map.is_bounds());
  CHECK(map.closed);
  const io::Csv drive = io::Csv::read(recorded("lvms/LVMS_23_01_04_B.csv"));
  const auto x = drive.numbers(drive.need({"x"})), y = drive.numbers(drive.need({"y"}));
  const auto vx = drive.numbers(drive.need({"vx"})), phi = drive.numbers(drive.need({"phi"}));
  int64_t driven = 0, along = 0;
  for (std::size_t i = 0; i < x.size(); i += 25) {
    if (vx[i] < 15) continue;  // not on the way to or from the pits
    std::size_t at = 0;
    for (std::size_t k = 1; k < map.left_x_m.size(); ++k)
      if (std::hypot(map.left_x_m[k] - x[i], map.left_y_m[k] - y[i]) <
          std::hypot(map.left_x_m[at] - x[i], map.left_y_m[at] - y[i]))
        at = k;
    const std::size_t next = (at + 1) % map.left_x_m.size();
    const double tx = map.left_x_m[next] - map.left_x_m[at], ty = map.left_y_m[next] - map.left_y_m[at];
    const double side = tx * (y[i] - map.left_y_m[at]) - ty * (x[i] - map.left_x_m[at]);
    ++driven;
    along += side < 0 && std::cos(phi[i] - std::atan2(ty, tx)) > 0.9;  // right of the left bound, same direction
  }
  CHECK(driven > 100);
  CHECK(along == driven);
}
