// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <array>
#include <cmath>

#include "tools/cli/doctor.h"
#include "tools/io/mounting.h"

namespace overtake::cli {
namespace {

struct Point {
  double x, y, z;
};

// Points in the vehicle frame, 3 to 30 m away from the sensor, in the vehicle's lane: a banked road is level to the
// vehicle there and bends beside it. Leaves out points far above the sensor, because the rig's height may be wrong.
std::vector<Point> low_points(const io::SensorScan& scan, const io::RigSensor& sensor) {
  constexpr double kLane = 4;
  const io::Mounting mounting(sensor);
  std::vector<Point> points;
  for (std::size_t i = 0; i < std::size_t(scan.count); ++i) {
    const double x = scan.x.value(i), y = scan.y.value(i), z = scan.z.value(i);
    const double range = std::hypot(x, y);
    if (!(range > 3 && range < 30) || !std::isfinite(z)) continue;
    const auto [ahead, left, up] = mounting.to_vehicle(x, y, z);
    if (up < sensor.z_m + 1 && std::fabs(left) < kLane) points.push_back({ahead, left, up});
  }
  return points;
}

// z = a + b x + c y through three points.
std::optional<std::array<double, 3>> plane_through(const Point& p, const Point& q, const Point& s) {
  const double dx1 = q.x - p.x, dy1 = q.y - p.y, dz1 = q.z - p.z, dx2 = s.x - p.x, dy2 = s.y - p.y, dz2 = s.z - p.z;
  const double det = dx1 * dy2 - dx2 * dy1;
  if (std::fabs(det) < 1) return std::nullopt;  // nearly one line
  const double b = (dz1 * dy2 - dz2 * dy1) / det, c = (dx1 * dz2 - dx2 * dz1) / det;
  if (std::hypot(b, c) > 0.4) return std::nullopt;  // a wall
  return std::array<double, 3>{p.z - b * p.x - c * p.y, b, c};
}

}  // namespace

std::optional<Ground> fit_ground(const io::SensorScan& scan, const io::RigSensor& sensor) {
  const auto points = low_points(scan, sensor);
  if (points.size() < 200) return std::nullopt;
  uint64_t state = 88172645463325252u;  // a fixed seed: the same draws for the same scan
  const auto draw = [&] {
    state ^= state << 13;
    state ^= state >> 7;
    state ^= state << 17;
    return points[std::size_t(state % points.size())];
  };
  const std::size_t step = std::max<std::size_t>(1, points.size() / 2000);
  std::array<double, 3> best{};
  std::size_t best_count = 0;
  for (int32_t k = 0; k < 300; ++k) {
    const Point p = draw(), q = draw(), s = draw();
    const auto plane = plane_through(p, q, s);
    if (!plane) continue;
    std::size_t count = 0;
    for (std::size_t i = 0; i < points.size(); i += step)
      count += std::fabs((*plane)[0] + (*plane)[1] * points[i].x + (*plane)[2] * points[i].y - points[i].z) < 0.06;
    if (count > best_count) best_count = count, best = *plane;
  }
  if (best_count * step * 4 < points.size()) return std::nullopt;  // less than a quarter of the points: not a road
  return Ground{best[0] + best[1] * sensor.x_m + best[2] * sensor.y_m, -std::atan(best[1]), std::atan(best[2])};
}

}  // namespace overtake::cli
