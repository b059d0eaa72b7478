// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
#include "tools/evaluation/cluster_tally.h"

#include <algorithm>
#include <utility>

namespace overtake::evaluation {

namespace {
constexpr double kOversizeM = 1.0, kTouchM = 0.3, kLongestM = 1.1 * kCarLengthM;
}

void ClusterTally::add(int64_t cluster, const std::array<double, 3>& at_m, Kind kind, int32_t car) {
  const auto [it, is_new] = clusters_.try_emplace(cluster);
  Content& c = it->second;
  if (is_new) c.low = c.high = at_m, c.inside.assign(cars_.size(), true);
  for (std::size_t k = 0; k < 3; ++k) c.low[k] = std::min(c.low[k], at_m[k]), c.high[k] = std::max(c.high[k], at_m[k]);
  if (kind == Kind::kCar) c.cars.insert(car);
  if (kind == Kind::kObstacle) c.other = true;
  for (std::size_t i = 0; i < cars_.size(); ++i) {
    c.inside[i] = c.inside[i] && cars_[i].holds(at_m[0], at_m[1], kOversizeM);
    c.at_a_car = c.at_a_car || cars_[i].holds(at_m[0], at_m[1], kTouchM);
  }
}

std::map<int32_t, ClusterTally::OfCar> ClusterTally::of_car() const {
  std::map<int32_t, OfCar> out;
  for (const CarPlace& c : cars_) out[c.car];
  for (const auto& [cluster, content] : clusters_) {
    for (const int32_t car : content.cars) ++out[car].clusters;
    for (std::size_t i = 0; i < cars_.size(); ++i) out[cars_[i].car].inside += content.inside[i] ? 1 : 0;
  }
  return out;
}

ClusterTally::Mixed ClusterTally::mixed() const {
  Mixed m;
  for (const auto& [cluster, c] : clusters_) {
    m.other += !c.cars.empty() && c.other ? 1 : 0;
    m.cars += c.cars.size() > 1 ? 1 : 0;
    double longest = 0;
    for (std::size_t k = 0; k < 3; ++k) longest = std::max(longest, c.high[k] - c.low[k]);
    m.by_size += c.at_a_car && longest > kLongestM ? 1 : 0;
  }
  return m;
}

std::vector<SeamTally::Car> SeamTally::over_seams() const {
  std::vector<Car> out;
  for (const auto& [car, of_sensor] : cars_) {
    std::set<int64_t> common;
    int32_t sensors = 0;
    for (const auto& [sensor, seen] : of_sensor) {
      if (seen.points < 3) continue;
      std::set<int64_t> both;
      for (const int64_t cluster : seen.clusters)
        if (sensors == 0 || common.contains(cluster)) both.insert(cluster);
      common = std::move(both), ++sensors;
    }
    if (sensors > 1) out.push_back({car, sensors, !common.empty()});
  }
  return out;
}

}  // namespace overtake::evaluation
