// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// Counts how a frame's clusters fit its cars, whoever made the clusters:
//   by truth         clusters with a point of the car; mixed ones: points of a car and of another obstacle, of two cars
//   by the paper     clusters wholly inside the car's rectangle made 1 m larger on each side; a mixed one has a
//                    point in the car's rectangle (0.3 m larger) and is longer than a car with 10 % slack (x, y or z of
//                    its bounds)
// The paper's rule needs no surfaces, only where the cars are. Vehicle frame.
#pragma once

#include <map>
#include <set>
#include <unordered_map>
#include <vector>

#include "tools/evaluation/places.h"

namespace overtake::evaluation {

enum class Kind { kGround, kNoise, kObstacle, kCar };

class ClusterTally {
 public:
  explicit ClusterTally(std::vector<CarPlace> cars) : cars_(std::move(cars)) {}
  // One point of a cluster; `car` by truth, -1 none. Any number may name a cluster.
  void add(int64_t cluster, const std::array<double, 3>& at_m, Kind kind, int32_t car);

  struct OfCar {
    int64_t clusters = 0, inside = 0;  // by truth; by the paper's rule
  };
  std::map<int32_t, OfCar> of_car() const;  // every car given, and every car with a point
  struct Mixed {
    int64_t other = 0, cars = 0, by_size = 0;
  };
  Mixed mixed() const;

 private:
  struct Content {
    std::array<double, 3> low, high;
    std::set<int32_t> cars;
    bool other = false, at_a_car = false;
    std::vector<bool> inside;  // of each car's enlarged rectangle: so far every point
  };
  std::vector<CarPlace> cars_;
  std::unordered_map<int64_t, Content> clusters_;
};

}  // namespace overtake::evaluation
