// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
#include <cmath>
#include <set>

#include "tools/baselines/euclidean_clusters.h"
#include "tools/baselines/grid_ground.h"
#include "tools/evaluation/judge.h"
#include "tools/sim/material.h"

namespace overtake::evaluation {

// Both ends of a cluster's bounds inside the car's rectangle, 1 m larger on each side, in the vehicle frame.
void Judge::add_boxed(const ovt_clusters& clusters, const std::vector<CarTruth>& cars) {
  constexpr double kHalfLength = 4.921 / 2 + 1, kHalfWidth = 1.886 / 2 + 1;
  const CarTruth* ego = nullptr;
  for (const CarTruth& c : cars)
    if (c.is_ego) ego = &c;
  for (const CarTruth& c : cars) {
    if (c.is_ego || !ego) continue;
    const Seen at = see(*ego, c.x_m, c.y_m, c.z_m);
    const double turn = c.heading_rad - ego->heading_rad, ct = std::cos(turn), st = std::sin(turn);
    const auto inside = [&](float x, float y) {
      const double dx = double(x) - at.ahead_m, dy = double(y) - at.left_m;
      return std::fabs(ct * dx + st * dy) <= kHalfLength && std::fabs(ct * dy - st * dx) <= kHalfWidth;
    };
    for (int32_t i = 0; i < clusters.count; ++i)
      boxed_[c.car] +=
          inside(clusters.min_x_m[i], clusters.min_y_m[i]) && inside(clusters.max_x_m[i], clusters.max_y_m[i]) &&
          inside(clusters.min_x_m[i], clusters.max_y_m[i]) && inside(clusters.max_x_m[i], clusters.min_y_m[i]);
  }
}

void Judge::add_baselines(const CloudPoints& cloud) {
  const double frame = double(frame_->scans.frame);
  const std::vector<bool> grid = baselines::mark_nonground(cloud.x_m, cloud.y_m, cloud.z_m);
  double tp = 0, fp = 0, fn = 0, tn = 0;
  for (std::size_t i = 0; i < grid.size(); ++i) {
    const Kind kind = kind_of(cloud.surface[i]);
    const bool positive = kind == Kind::kCar || kind == Kind::kObstacle;
    (grid[i] ? (positive ? tp : fp) : (positive ? fn : tn)) += 1;
  }
  tables_["grid"].add({frame, tp, fp, fn, tn});

  CloudPoints found;
  bool any_car = false;
  for (std::size_t i = 0; i < cloud.found.size(); ++i) {
    if (!cloud.found[i]) continue;
    found.x_m.push_back(cloud.x_m[i]), found.y_m.push_back(cloud.y_m[i]), found.z_m.push_back(cloud.z_m[i]);
    found.surface.push_back(cloud.surface[i]);
    any_car = any_car || kind_of(cloud.surface[i]) == Kind::kCar;
  }
  if (!any_car) return;
  for (const double radius : {0.2, 0.3, 0.5, 0.75, 1.0, 1.25, 1.5, 2.0, 2.5, 3.0}) {
    const std::vector<int32_t> cluster = baselines::cluster_points(found.x_m, found.y_m, found.z_m, radius);
    std::map<int32_t, std::set<int32_t>> of_car;
    std::set<int32_t> with_car, with_other;
    for (std::size_t i = 0; i < cluster.size(); ++i) {
      const Kind kind = kind_of(found.surface[i]);
      if (kind == Kind::kCar) {
        of_car[found.surface[i] - int32_t(sim::Surface::car)].insert(cluster[i]);
        with_car.insert(cluster[i]);
      } else if (kind == Kind::kObstacle) {
        with_other.insert(cluster[i]);
      }
    }
    double mixed = 0;
    for (const int32_t c : with_car) mixed += with_other.count(c) ? 1 : 0;
    for (const auto& [car, clusters] : of_car)
      tables_["euclid"].add({frame, radius, double(car), double(clusters.size())});
    tables_["euclid"].add({frame, radius, -1, mixed});
  }
}

}  // namespace overtake::evaluation
