// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
#include "tools/io/map_file.h"

#include <algorithm>
#include <cmath>
#include <filesystem>

#include "core/circuit_map.h"
#include "tools/io/bag_reader.h"
#include "tools/io/csv.h"
#include "tools/io/error.h"
#include "tools/io/text.h"

namespace overtake::io {
namespace {

struct Line {
  std::vector<double> x, y;
  std::vector<std::size_t> row;  // in the file; repeated points are left out
  bool closed = false;
};

// Points in file order without repetitions (also of the first point at the end). Closed if the distance of the ends is
// at most three median steps and the line is much longer than that.
Line clean_line(const Csv& csv, int32_t column_x, int32_t column_y) {
  const auto x = csv.numbers(column_x), y = csv.numbers(column_y);
  Line line;
  std::vector<double> steps;
  for (std::size_t i = 0; i < x.size(); ++i) {
    const double step = line.x.empty() ? 1.0 : std::hypot(x[i] - line.x.back(), y[i] - line.y.back());
    if (step < 1e-6) continue;
    if (!line.x.empty()) steps.push_back(step);
    line.x.push_back(x[i]);
    line.y.push_back(y[i]);
    line.row.push_back(i);
  }
  if (line.x.size() < 3) throw Error(csv.path(), 0, "a track needs at least 3 different points");
  double length = 0;
  for (const double step : steps) length += step;
  std::sort(steps.begin(), steps.end());
  const double gap = std::hypot(line.x.front() - line.x.back(), line.y.front() - line.y.back());
  line.closed = gap <= 3 * steps[steps.size() / 2] && length > 10 * gap;
  if (gap < 1e-6) {
    line.x.pop_back();
    line.y.pop_back();
    line.row.pop_back();
  }
  return line;
}

// Sum over the points of cross(driving direction, vector at the point): positive if the vectors point to the left.
template <class VectorX, class VectorY>
double sum_leftness(const Line& line, VectorX&& vector_x, VectorY&& vector_y) {
  double sum = 0;
  const std::size_t n = line.x.size();
  for (std::size_t i = 0; i < n; ++i) {
    const std::size_t before = i > 0 ? i - 1 : line.closed ? n - 1 : 0;
    const std::size_t after = i + 1 < n ? i + 1 : line.closed ? 0 : n - 1;
    sum += (line.x[after] - line.x[before]) * vector_y(i) - (line.y[after] - line.y[before]) * vector_x(i);
  }
  return sum;
}

std::vector<double> pick(const Csv& csv, const Line& line, int32_t column) {
  std::vector<double> values(line.row.size());
  for (std::size_t i = 0; i < values.size(); ++i) values[i] = csv.number(line.row[i], column);
  return values;
}

std::vector<double> pick_banking(const Csv& csv, const Line& line, int32_t column) {
  auto banking = pick(csv, line, column);
  for (std::size_t i = 0; i < banking.size(); ++i)
    if (std::fabs(banking[i]) > kMaxMapBanking_rad)
      csv.fail(line.row[i], column, "banking_rad is beyond 1 rad (degrees?)");
  return banking;
}

std::vector<double> pick_width(const Csv& csv, const Line& line, int32_t column) {
  auto widths = pick(csv, line, column);
  for (std::size_t i = 0; i < widths.size(); ++i)
    if (widths[i] < 0) csv.fail(line.row[i], column, "a width is negative");
  return widths;
}

// Points at least 5 m apart: over shorter steps the measurement noise turns the line more than the circuit does.
std::vector<std::size_t> thin_out(const Line& line) {
  constexpr double kStep_m = 5;
  std::vector<std::size_t> kept = {0};
  for (std::size_t i = 1; i < line.x.size(); ++i)
    if (std::hypot(line.x[i] - line.x[kept.back()], line.y[i] - line.y[kept.back()]) >= kStep_m) kept.push_back(i);
  return kept;
}

// Whether on the whole the outer side of the turns is the lower one, if positive banking raises the right side. A
// circuit is not built so (a turn here and there may be): the file has the opposite sign. A bank counts by the angle
// that the line turns on it.
bool leans_outwards(const Line& line, const std::vector<double>& banking_rad) {
  constexpr double kLeast_rad2 = 0.05;  // 30 degrees of a turn, banked by 6: less than that tells nothing
  constexpr double kLeastShare = 0.2;   // of the banks' whole weight; where they contradict each other, none is changed
  const std::vector<std::size_t> at = thin_out(line);
  const std::size_t n = at.size();
  double sum = 0, weight = 0;  // rad^2; left turns and banks to the left are positive
  for (std::size_t k = 0; k < n; ++k) {
    if (!line.closed && (k == 0 || k + 1 == n)) continue;
    const std::size_t a = at[(k + n - 1) % n], b = at[k], c = at[(k + 1) % n];
    const double in_x = line.x[b] - line.x[a], in_y = line.y[b] - line.y[a];
    const double out_x = line.x[c] - line.x[b], out_y = line.y[c] - line.y[b];
    const double turn = std::atan2(in_x * out_y - in_y * out_x, in_x * out_x + in_y * out_y);
    sum += turn * banking_rad[b];
    weight += std::fabs(turn * banking_rad[b]);
  }
  return sum < -kLeast_rad2 && sum < -kLeastShare * weight;
}

MapData read_center_line(const Csv& csv) {
  const std::string& path = csv.path();
  if (csv.column_count() == 2) throw Error(path, 0, "is one bound; a map of bounds needs two files, FILE1,FILE2");
  if (!csv.has_header() && csv.column_count() != 4 && csv.column_count() != 5)
    throw Error(path, csv.line(0), "no header line names the columns");
  const bool named = csv.has_header();
  const auto column = [&](int32_t position, std::initializer_list<std::string_view> names) {
    return named ? csv.need(names) : position;
  };
  const int32_t x = column(0, {"x_ref_m", "x_m", "x"}), y = column(1, {"y_ref_m", "y_m", "y"});
  const int32_t right = column(2, {"width_right_m", "w_tr_right_m", "w_right_m", "width_right"});
  const int32_t left = column(3, {"width_left_m", "w_tr_left_m", "w_left_m", "width_left"});
  const int32_t banking = named ? csv.find({"banking_rad", "banking"}) : csv.column_count() == 5 ? 4 : -1;

  const Line line = clean_line(csv, x, y);
  MapData map;
  map.closed = line.closed;
  map.x_m = line.x;
  map.y_m = line.y;
  map.width_right_m = pick_width(csv, line, right);
  map.width_left_m = pick_width(csv, line, left);
  if (banking >= 0) map.banking_rad = pick_banking(csv, line, banking);
  if (banking >= 0 && leans_outwards(line, map.banking_rad)) {
    for (double& angle : map.banking_rad) angle = -angle;
    map.notes.push_back(path +
                        ": its banking has the opposite sign (positive: the right side is higher): it is turned round");
  }

  // The right bound is at ref + normvec * width_right. If the vectors point to the left of the points' direction, the
  // line was reversed after they were made: its "right" is the driver's left.
  const int32_t normal_x = named ? csv.find({"x_normvec_m", "x_normvec"}) : -1;
  const int32_t normal_y = named ? csv.find({"y_normvec_m", "y_normvec"}) : -1;
  if (normal_x >= 0 && normal_y >= 0) {
    const auto nx = pick(csv, line, normal_x), ny = pick(csv, line, normal_y);
    const double leftness = sum_leftness(
        line, [&](std::size_t i) { return nx[i]; }, [&](std::size_t i) { return ny[i]; });
    if (leftness > 0) std::swap(map.width_left_m, map.width_right_m);
  }
  csv.note_unread({x, y, right, left, banking, normal_x, normal_y}, map.notes);
  return map;
}

Line read_bound(const std::string& path, std::vector<std::string>& notes) {
  const Csv csv = Csv::read(path);
  const bool named = csv.has_header();
  if (!named && csv.column_count() != 2)
    throw Error(path, csv.line(0), "a bound has two columns, x and y, or a header that names them");
  const int32_t x = named ? csv.need({"x_m", "x"}) : 0, y = named ? csv.need({"y_m", "y"}) : 1;
  csv.note_unread({x, y}, notes);
  return clean_line(csv, x, y);
}

std::size_t nearest(const Line& line, double x, double y) {
  std::size_t best = 0;
  for (std::size_t i = 1; i < line.x.size(); ++i)
    if (std::hypot(line.x[i] - x, line.y[i] - y) < std::hypot(line.x[best] - x, line.y[best] - y)) best = i;
  return best;
}

MapData read_bounds(const std::string& path_a, const std::string& path_b) {
  MapData map;
  Line a = read_bound(path_a, map.notes), b = read_bound(path_b, map.notes);
  if (a.closed != b.closed)
    throw Error(path_b, 0, std::string("is ") + (b.closed ? "closed" : "open") + ", " + path_a + " is not");
  std::vector<std::size_t> partner(a.x.size());
  for (std::size_t i = 0; i < partner.size(); ++i) partner[i] = nearest(b, a.x[i], a.y[i]);

  // b must run in the direction of a: compares steps of b with the matching steps of a.
  double agreement = 0;
  for (std::size_t i = 0; i + 1 < a.x.size(); ++i) {
    const std::size_t from = std::min(partner[i], b.x.size() - 2);
    agreement +=
        (a.x[i + 1] - a.x[i]) * (b.x[from + 1] - b.x[from]) + (a.y[i + 1] - a.y[i]) * (b.y[from + 1] - b.y[from]);
  }
  const double leftness = sum_leftness(
      a, [&](std::size_t i) { return b.x[partner[i]] - a.x[i]; },
      [&](std::size_t i) { return b.y[partner[i]] - a.y[i]; });
  if (agreement < 0) {
    std::reverse(b.x.begin(), b.x.end());
    std::reverse(b.y.begin(), b.y.end());
  }
  map.closed = a.closed;
  if (leftness > 0) std::swap(a, b);  // b is the left bound
  map.left_x_m = std::move(a.x);
  map.left_y_m = std::move(a.y);
  map.right_x_m = std::move(b.x);
  map.right_y_m = std::move(b.y);
  return map;
}

}  // namespace

MapData read_map(const std::string& path_or_two_paths) {
  const auto comma = path_or_two_paths.find(',');
  std::error_code code;
  if (comma == std::string::npos && !std::filesystem::exists(path_or_two_paths, code))
    throw Error(path_or_two_paths, 0, "no such file");
  if (comma == std::string::npos || std::filesystem::exists(path_or_two_paths, code)) {
    refuse_special_file(path_or_two_paths);
    if (auto own = read_attached(path_or_two_paths, "map.csv"))
      return read_center_line(Csv::parse(path_or_two_paths + ": map.csv", std::move(*own)));
    if (is_bag(path_or_two_paths))
      throw Error(path_or_two_paths, 0, "holds no map (attachment map.csv of an MCAP log)");
    return read_center_line(Csv::read(path_or_two_paths));
  }
  return read_bounds(path_or_two_paths.substr(0, comma), path_or_two_paths.substr(comma + 1));
}

}  // namespace overtake::io
