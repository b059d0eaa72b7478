// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
#include "tools/cli/doctor_lines.h"
#include "tools/io/angles.h"

#include <algorithm>
#include <cmath>

namespace overtake::cli {
namespace {

constexpr std::size_t kFewest = 50;  // fewest points of a line that is tested
constexpr double kMaxAlong_deg = 3;
constexpr double kSameHeight_m = 0.03;  // tolerance for lines of one sensor
constexpr double kGoodFit_m = 0.05;

}  // namespace

struct LineShapes::Cone {
  double height_m = NAN, misfit_m = NAN;
};

void LineShapes::add(const io::SensorScan& scan) {
  if (scans_++ >= 3) return;
  for (std::size_t i = 0; i < std::size_t(scan.count); i += 3) {  // a step prime to the number of heads
    const double layer = scan.layer.value(i);
    if (!(layer >= 0 && layer < 65535) || layer != std::floor(layer)) continue;
    const Point p = {float(scan.x.value(i)), float(scan.y.value(i)), float(scan.z.value(i))};
    if (std::isfinite(p.z) && std::hypot(p.x, p.y) > 2) lines_[int64_t(layer)].push_back(p);
  }
}

LineShapes::Spread LineShapes::spread() const {
  std::vector<double> along, middle;
  for (const auto& [layer, points] : lines_) {
    if (points.size() < kFewest) continue;
    std::vector<double> elevation;
    for (const Point& p : points) elevation.push_back(io::deg(std::atan2(p.z, std::hypot(p.x, p.y))));
    std::sort(elevation.begin(), elevation.end());
    along.push_back(elevation[elevation.size() * 9 / 10] - elevation[elevation.size() / 10]);
    middle.push_back(elevation[elevation.size() / 2]);
  }
  if (along.size() < 8) return {};
  const auto [low, high] = std::minmax_element(middle.begin(), middle.end());
  return {median<double>(along), (*high - *low) / double(middle.size() - 1)};
}

bool LineShapes::one_sensor() const {
  const Spread spread = this->spread();
  return spread.along_deg <= kMaxAlong_deg || spread.along_deg <= 3 * spread.apart_deg;
}

// Fits a cone by least squares, four times, each time without the fifth of the points that fits worst: cars and walls
// lie on the cone as well, but points at the edges of objects do not.
LineShapes::Cone LineShapes::fit_cone(const std::vector<Point>& line, double x_m, double y_m) {
  std::vector<std::pair<double, double>> points;  // distance, height
  const std::size_t step = std::max<std::size_t>(1, line.size() / 200);
  for (std::size_t i = 0; i < line.size(); i += step) {
    const double d = std::hypot(line[i].x - x_m, line[i].y - y_m);
    if (d > 2 && d < 60) points.emplace_back(d, line[i].z);
  }
  Cone cone;
  for (int32_t pass = 0; pass < 4 && points.size() >= 30; ++pass) {
    const double n = double(points.size());
    double d_sum = 0, z_sum = 0, dd = 0, dz = 0;
    for (const auto& [d, z] : points) d_sum += d, z_sum += z;
    for (const auto& [d, z] : points) dd += (d - d_sum / n) * (d - d_sum / n), dz += (d - d_sum / n) * (z - z_sum / n);
    if (!(dd > n)) return {};  // all at one distance: any cone fits
    const double slope = dz / dd, height = (z_sum - slope * d_sum) / n;
    const auto off = [&](const auto& p) { return std::fabs(height + slope * p.first - p.second); };
    std::sort(points.begin(), points.end(), [&](const auto& a, const auto& b) { return off(a) < off(b); });
    points.resize(points.size() * 4 / 5);
    double sum = 0;
    for (const auto& p : points) sum += off(p);
    cone = {height, sum / double(points.size())};
  }
  return cone;
}

double LineShapes::misfit(double x_m, double y_m) const {
  std::vector<double> misfits;
  for (const auto& [layer, points] : lines_) {
    const Cone cone = fit_cone(points, x_m, y_m);
    if (std::isfinite(cone.misfit_m)) misfits.push_back(cone.misfit_m);
  }
  return misfits.size() < 8 ? HUGE_VAL : median(misfits);
}

std::vector<LineShapes::Source> LineShapes::sources() const {
  // Descends from the middle of the area where a roof may carry a sensor: the misfit has one minimum.
  double x = 0, y = 0, best = misfit(0, 0);
  for (double step = 1; step > 0.008;) {
    const double before = best;
    const double from_x = x, from_y = y;
    for (const auto& [dx, dy] : {std::pair(step, 0.0), {-step, 0.0}, {0.0, step}, {0.0, -step}}) {
      const double m = misfit(from_x + dx, from_y + dy);
      if (m < best) best = m, x = from_x + dx, y = from_y + dy;
    }
    if (best == before) step /= 2;
  }
  if (best > kGoodFit_m) return {};
  std::vector<int64_t> layers;
  std::vector<double> heights;
  for (const auto& [layer, points] : lines_) {
    const Cone cone = fit_cone(points, x, y);
    if (!std::isfinite(cone.height_m)) continue;
    layers.push_back(layer);
    heights.push_back(cone.height_m);
  }
  const auto same = [](const std::vector<double>& some) {
    const double middle = median(some);
    return std::count_if(some.begin(), some.end(), [&](double h) { return std::fabs(h - middle) < kSameHeight_m; });
  };
  const auto height_of = [&](std::size_t begin, std::size_t end) {
    return median<double>({heights.begin() + int64_t(begin), heights.begin() + int64_t(end)});
  };
  const auto place = [&](std::size_t begin, std::size_t end) {
    return Source{layers[begin], layers[end - 1], x, y, height_of(begin, end)};
  };
  // Finds where to cut the lines in two so that most are at the height of their half; does not cut for a small gain.
  const int64_t uncut = same(heights);
  std::size_t cut = heights.size();
  int64_t most = uncut;
  for (std::size_t k = 4; k + 4 <= heights.size(); ++k) {
    const auto middle = heights.begin() + int64_t(k);
    const int64_t count = same({heights.begin(), middle}) + same({middle, heights.end()});
    if (count > most) most = count, cut = k;
  }
  const bool two = most > uncut + 3 && std::fabs(height_of(0, cut) - height_of(cut, heights.size())) > 0.05;
  if (!two) most = uncut, cut = heights.size();
  if (most * 2 < int64_t(heights.size())) return {};
  std::vector<Source> found = {place(0, cut)};
  if (cut < heights.size()) {
    found.push_back(place(cut, heights.size()));
    found[0].last_line = found[1].first_line - 1;  // lines between have too few points to decide
  }
  found.front().first_line = lines_.begin()->first;
  found.back().last_line = lines_.rbegin()->first;
  return found;
}

}  // namespace overtake::cli
