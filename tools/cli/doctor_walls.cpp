// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
#include "tools/cli/doctor_walls.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <numeric>

#include "tools/io/angles.h"
#include "tools/io/mounting.h"

namespace overtake::cli {
namespace {

constexpr double kLowest_m = 0.4, kHighest_m = 4;  // above the road: excludes the road and a grandstand's roof
constexpr double kFarthest_m = 40;
constexpr double kLongest_m = 2, kWidest_rad = 0.03;  // between two points of one surface
constexpr double kAlong_deg = 12;
constexpr double kEnough_m = 100;
// Shares of recorded and simulated walls: 0.5 to 1 with the right yaw, 0 to 0.11 with a wrong one.
constexpr double kFits = 0.4, kDoesNot = 0.2;

double fold(double degrees) { return degrees - 180 * std::floor(degrees / 180); }

double between(double a_deg, double b_deg) {
  const double d = fold(a_deg - b_deg);
  return std::min(d, 180 - d);
}

}  // namespace

void WallDirections::add(const io::SensorScan& scan, const io::RigSensor& sensor) {
  struct Point {
    double azimuth, x, y;
  };
  io::RigSensor without_yaw = sensor;
  without_yaw.x_m = without_yaw.y_m = without_yaw.yaw_deg = 0;
  const io::Mounting level(without_yaw);
  std::map<double, std::vector<Point>> lines;
  for (std::size_t i = 0; i < std::size_t(scan.count); ++i) {
    const double x = scan.x.value(i), y = scan.y.value(i), z = scan.z.value(i), layer = scan.layer.value(i);
    const auto [level_x, level_y, up] = level.to_vehicle(x, y, z);
    const double range = std::hypot(level_x, level_y);
    if (!(range > 2 && range < kFarthest_m && up > kLowest_m && up < kHighest_m) || std::isnan(layer)) continue;
    lines[layer].push_back({std::atan2(level_y, level_x), level_x, level_y});
  }
  for (auto& [layer, line] : lines) {
    std::sort(line.begin(), line.end(), [](const Point& a, const Point& b) { return a.azimuth < b.azimuth; });
    for (std::size_t i = 0; i + 3 < line.size(); ++i) {  // to the third next point: noise turns a short segment
      const Point &a = line[i], &b = line[i + 3];
      const double length = std::hypot(b.x - a.x, b.y - a.y);
      if (b.azimuth - a.azimuth > kWidest_rad || length > kLongest_m || length < 0.05) continue;
      const double direction = fold(io::deg(std::atan2(b.y - a.y, b.x - a.x)));
      length_m_[std::min<std::size_t>(35, std::size_t(direction / 5))] += length;
    }
  }
}

double WallDirections::length_m() const { return std::accumulate(length_m_.begin(), length_m_.end(), 0.0); }

double WallDirections::share_along(double yaw_deg) const {
  double along = 0;
  for (std::size_t k = 0; k < length_m_.size(); ++k)
    if (between(5 * double(k) + 2.5 + yaw_deg, 0) <= kAlong_deg) along += length_m_[k];
  return along / std::max(1.0, length_m());
}

std::vector<std::size_t> find_swapped_yaws(const io::Rig& rig, const std::vector<WallDirections>& walls) {
  const std::size_t count = rig.sensors.size();
  std::vector<std::size_t> own(count);
  std::iota(own.begin(), own.end(), std::size_t(0));
  if (rig.cloud_in_vehicle_frame || rig.shared_cloud) return own;
  std::vector<std::size_t> judged;
  for (std::size_t i = 0; i < count; ++i)
    if (walls[i].length_m() > kEnough_m) judged.push_back(i);
  std::vector<std::vector<double>> shares(count);
  for (std::size_t i = 0; i < count; ++i)
    for (const io::RigSensor& owner : rig.sensors) shares[i].push_back(walls[i].share_along(owner.yaw_deg));

  std::vector<std::size_t> order(judged.size()), best(judged.size());
  std::iota(order.begin(), order.end(), std::size_t(0));
  best = order;
  double most = -1;
  do {  // at most 8 sensors: 40,320 permutations
    double sum = 0;
    for (std::size_t k = 0; k < order.size(); ++k)
      sum += shares[judged[k]][judged[order[k]]] + (order[k] == k ? kDoesNot : 0);  // no swap for a small gain
    if (sum > most + 1e-9) most = sum, best = order;
  } while (std::next_permutation(order.begin(), order.end()));

  std::vector<std::size_t> found = own;
  for (std::size_t k = 0; k < judged.size(); ++k) {
    const std::size_t i = judged[k], owner = judged[best[k]];
    if (i == owner) continue;
    const bool differ = between(rig.sensors[i].yaw_deg, rig.sensors[owner].yaw_deg) > 2 * kAlong_deg;
    if (!differ || shares[i][owner] < kFits || shares[i][i] > kDoesNot) return own;
    found[i] = owner;
  }
  return found;
}

}  // namespace overtake::cli
