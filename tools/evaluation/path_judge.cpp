// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
#include "tools/evaluation/path_judge.h"

#include <algorithm>
#include <cmath>
#include <map>

#include "tools/client/circuit_file.h"
#include "tools/evaluation/metrics/consistency.h"
#include "tools/evaluation/numbers.h"

namespace overtake::evaluation {
namespace {

constexpr int64_t kSampleNs = 100'000'000;

// Keeps the change of the larger size.
void keep_larger(double change, double& most) {
  if (!(std::fabs(change) <= std::fabs(most))) most = change;
}

}  // namespace

void PathJudge::use_circuit(const std::string& map_file) { circuit_ = cli::read_circuit(map_file); }

double PathJudge::steady_square(const Point& p, const double (&error)[2]) {
  if (!(p.steady_along_m > 0 && p.steady_across_m > 0)) return kNan;
  const double c = std::cos(p.course_rad), s = std::sin(p.course_rad);
  const double along = (c * error[0] + s * error[1]) / p.steady_along_m;
  const double across = (c * error[1] - s * error[0]) / p.steady_across_m;
  return along * along + across * across;
}

double PathJudge::offset_of(const CarTruth& car, int32_t& segment) const {
  if (std::isfinite(car.offset_m) || circuit_.empty()) return car.offset_m;
  const MapProjection at = circuit_.project(car.x_m, car.y_m, segment);
  segment = at.segment;
  return at.d_m;
}

void PathJudge::add(double frame, const ovt_tracks& t, int32_t row, const CarTruth& car) {
  Path path;
  path.frame = frame, path.car = car.car, path.speed_mps = car.speed_mps;
  path.sample_ns = t.publish_ns + kSampleNs;
  path.offset_m = offset_of(car, path.segment);
  path.offset_change_m = std::isfinite(path.offset_m) ? 0 : kNan;
  for (const double horizon_s : kHorizonsS) {
    if (!(t.path_points > 0 && t.path_step_s > 0)) return;
    const int64_t k = std::llround(horizon_s / t.path_step_s) - 1;
    if (k < 0 || k >= t.path_points) continue;
    const std::size_t at = std::size_t(row) * std::size_t(t.path_points) + std::size_t(k);
    const int64_t stamp_ns = t.publish_ns + std::llround(double(k + 1) * t.path_step_s * 1e9);
    const bool has_steady = t.path_steady_along_m && t.path_steady_across_m;
    path.points.push_back({horizon_s, stamp_ns, t.path_x_m[at], t.path_y_m[at], t.path_var_x[at], t.path_cov_xy[at],
                           t.path_var_y[at], has_steady ? t.path_course_rad[at] : 0.0,
                           has_steady ? t.path_steady_along_m[at] : 0.0,
                           has_steady ? t.path_steady_across_m[at] : 0.0});
  }
  if (!path.points.empty()) open_.push_back(std::move(path));
}

void PathJudge::advance(int64_t until_ns, const CarsAt& cars_at, Table& out) {
  std::map<int64_t, std::vector<CarTruth>> known;  // paths of several frames and cars share their times
  const auto finish = [&](Path& path) {
    while (path.next < path.points.size()) {
      const int64_t stamp_ns = std::min(path.sample_ns, path.points[path.next].stamp_ns);
      if (stamp_ns > until_ns) return false;
      const auto [at, is_new] = known.try_emplace(stamp_ns);
      if (is_new) at->second = cars_at(stamp_ns);
      if (!sample(path, stamp_ns, at->second, out)) return true;
    }
    return true;
  };
  std::erase_if(open_, finish);
}

bool PathJudge::sample(Path& path, int64_t stamp_ns, const std::vector<CarTruth>& cars, Table& out) {
  const auto car = std::find_if(cars.begin(), cars.end(), [&](const CarTruth& c) { return c.car == path.car; });
  if (car == cars.end()) return false;
  keep_larger(car->speed_mps - path.speed_mps, path.speed_change_mps);
  keep_larger(offset_of(*car, path.segment) - path.offset_m, path.offset_change_m);
  if (stamp_ns == path.sample_ns) path.sample_ns += kSampleNs;
  for (; path.next < path.points.size() && path.points[path.next].stamp_ns == stamp_ns; ++path.next) {
    const Point& p = path.points[path.next];
    const double error[2] = {p.x_m - car->x_m, p.y_m - car->y_m}, covariance[3] = {p.var_x, p.cov_xy, p.var_y};
    const double c = std::cos(car->course_rad), s = std::sin(car->course_rad);
    out.add({path.frame, double(path.car), p.horizon_s, c * error[0] + s * error[1], c * error[1] - s * error[0],
             metrics::normalized_square(error, covariance, 2), path.speed_change_mps, path.offset_change_m,
             steady_square(p, error)});
  }
  return true;
}

}  // namespace overtake::evaluation
