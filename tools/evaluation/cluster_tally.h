// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// Counts how well a frame's clusters fit its cars, for any clustering method:
//   by truth         clusters with a point of the car; mixed: points of a car and another obstacle, or of two cars
//   by the paper     clusters inside the car's rectangle enlarged by 1 m on each side; mixed: a cluster with a point in
//                    the car's rectangle (enlarged by 0.3 m) that is longer than a car with 10 % slack (x, y or z of
//                    its bounds)
// The paper's rule does not need surfaces, only the positions of the cars. Vehicle frame.
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
  // Adds one point of a cluster; `car` by truth, -1 none. `cluster` may be any number.
  void add(int64_t cluster, const std::array<double, 3>& at_m, Kind kind, int32_t car);

  struct OfCar {
    int64_t clusters = 0, inside = 0;  // by truth; by the paper's rule
  };
  std::map<int32_t, OfCar> of_car() const;  // every given car, and every car with a point
  struct Mixed {
    int64_t other = 0, cars = 0, by_size = 0;
  };
  Mixed mixed() const;

 private:
  struct Content {
    std::array<double, 3> low, high;
    std::set<int32_t> cars;
    bool other = false, at_a_car = false;
    std::vector<bool> inside;  // per enlarged rectangle: true while all points are inside
  };
  std::vector<CarPlace> cars_;
  std::unordered_map<int64_t, Content> clusters_;
};

// Whether a car over a seam is one cluster: by car, the clusters of its points in the scan of each sensor.
class SeamTally {
 public:
  void add(int32_t car, int32_t sensor, int64_t cluster) {
    Seen& seen = cars_[car][sensor];
    ++seen.points, seen.clusters.insert(cluster);
  }
  struct Car {
    int32_t car, sensors;  // that have at least 3 points of it
    bool joined;           // one cluster has points of all of them
  };
  std::vector<Car> over_seams() const;  // the cars of at least two sensors

 private:
  struct Seen {
    int64_t points = 0;
    std::set<int64_t> clusters;
  };
  std::map<int32_t, std::map<int32_t, Seen>> cars_;
};

}  // namespace overtake::evaluation
