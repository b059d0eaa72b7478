// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// The baselines on clouds small enough to see, and against trying every pair.
#include <doctest/doctest.h>

#include <cmath>
#include <numeric>
#include <random>
#include <stdexcept>

#include "tools/baselines/euclidean_clusters.h"
#include "tools/baselines/grid_ground.h"

using namespace overtake::baselines;

TEST_CASE("grid_ground: points of a cell higher than the threshold are non-ground, its lowest ones included") {
  // side view, cells of 0.5 m:   | . 0.1 |  ground    | 0 .. 0.3 |  obstacle    | 0.25 alone |  ground
  const std::vector<float> x = {0.1f, 0.4f, 0.6f, 0.9f, -0.1f}, y(5, 0.2f), z = {0, 0.1f, 0, 0.3f, 0.25f};
  CHECK(mark_nonground(x, y, z) == std::vector<bool>{false, false, true, true, false});
}

TEST_CASE("grid_ground: a point out of reach or without a height is ground") {
  const std::vector<float> x = {500, 500, NAN, 1}, y(4, 0), z = {0, 5, 0, NAN};
  CHECK(mark_nonground(x, y, z) == std::vector<bool>(4, false));
  CHECK_THROWS_AS(mark_nonground(x, y, {}), std::invalid_argument);
}

TEST_CASE("euclidean_clusters agrees with joining every pair within the radius") {
  std::mt19937 random(3);
  for (int32_t round = 0; round < 40; ++round) {
    const double radius = 0.3 + 0.1 * (round % 8);
    const std::size_t n = std::size_t(random() % 150);
    std::uniform_real_distribution<float> place(-3, 3);
    std::vector<float> x(n), y(n), z(n);
    for (std::size_t i = 0; i < n; ++i) x[i] = place(random), y[i] = place(random), z[i] = 0.3f * place(random);
    std::vector<int32_t> expected(n);
    std::iota(expected.begin(), expected.end(), 0);
    for (bool changed = true; changed;) {  // labels sink until nothing moves
      changed = false;
      for (std::size_t i = 0; i < n; ++i)
        for (std::size_t j = 0; j < n; ++j) {
          const double dx = double(x[i]) - double(x[j]), dy = double(y[i]) - double(y[j]),
                       dz = double(z[i]) - double(z[j]);
          if (dx * dx + dy * dy + dz * dz <= radius * radius && expected[i] > expected[j])
            expected[i] = expected[j], changed = true;
        }
    }
    const std::vector<int32_t> found = cluster_points(x, y, z, radius);
    CAPTURE(round);
    REQUIRE(found.size() == n);
    std::vector<int32_t> first(n, -1);  // cluster -> its first point
    for (std::size_t i = 0; i < n; ++i) {
      if (first[std::size_t(found[i])] < 0) first[std::size_t(found[i])] = int32_t(i);
      CHECK(first[std::size_t(found[i])] == expected[i]);
    }
  }
}

TEST_CASE("euclidean_clusters refuses what it cannot cluster") {
  CHECK_THROWS_AS(cluster_points({0}, {0}, {0}, 0), std::invalid_argument);
  CHECK_THROWS_AS(cluster_points({NAN}, {0}, {0}, 1), std::invalid_argument);
  CHECK_THROWS_AS(cluster_points({0}, {}, {0}, 1), std::invalid_argument);
}
