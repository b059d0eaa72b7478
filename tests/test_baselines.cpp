// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// The baselines on clouds that are small enough to check by hand, and against a search over all pairs.
#include <doctest/doctest.h>

#include <cmath>
#include <numeric>
#include <random>
#include <stdexcept>

#include "tools/evaluation/baselines/euclidean_clusters.h"
#include "tools/evaluation/baselines/grid_ground.h"
#include "tools/evaluation/baselines/label_ground.h"

using namespace overtake::baselines;

TEST_CASE("grid_ground: if a cell's points differ by more than the threshold, all its points are non-ground") {
  // side view, cells of 0.5 m:   | . 0.1 |  ground    | 0 .. 0.3 |  obstacle    | 0.25 alone |  ground
  const std::vector<float> x = {0.1f, 0.4f, 0.6f, 0.9f, -0.1f}, y(5, 0.2f), z = {0, 0.1f, 0, 0.3f, 0.25f};
  CHECK(mark_nonground(x, y, z, {0.5, 0.2, 150}) == std::vector<bool>{false, false, true, true, false});
}

TEST_CASE("grid_ground: a point outside of the grid or without a height is ground") {
  const std::vector<float> x = {500, 500, NAN, 1}, y(4, 0), z = {0, 5, 0, NAN};
  CHECK(mark_nonground(x, y, z) == std::vector<bool>(4, false));
  CHECK_THROWS_AS(mark_nonground(x, y, {}), std::invalid_argument);
}

TEST_CASE("euclidean_clusters: agrees with joining every pair within the radius") {
  std::mt19937 random(3);
  for (int32_t round = 0; round < 40; ++round) {
    const double radius = 0.3 + 0.1 * (round % 8);
    const std::size_t n = std::size_t(random() % 150);
    std::uniform_real_distribution<float> place(-3, 3);
    std::vector<float> x(n), y(n), z(n);
    for (std::size_t i = 0; i < n; ++i) x[i] = place(random), y[i] = place(random), z[i] = 0.3f * place(random);
    std::vector<int32_t> expected(n);
    std::iota(expected.begin(), expected.end(), 0);
    for (bool changed = true; changed;) {  // labels decrease until nothing changes
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

TEST_CASE("euclidean_clusters: refuses invalid input") {
  CHECK_THROWS_AS(cluster_points({0}, {0}, {0}, 0), std::invalid_argument);
  CHECK_THROWS_AS(cluster_points({NAN}, {0}, {0}, 1), std::invalid_argument);
  CHECK_THROWS_AS(cluster_points({0}, {}, {0}, 1), std::invalid_argument);
}

TEST_CASE("label_ground: separates a road from a wall, and outvotes a single wrong normal") {
  // rings of a road out to 20 m, a wall at x = 22 from the road up to 1 m
  std::vector<float> x, y, z;
  std::vector<bool> expected;
  for (float r = 5; r <= 20; r += 0.5f)
    for (float a = -0.5f; a <= 0.5f; a += 0.02f) {
      x.push_back(r * std::cos(a)), y.push_back(r * std::sin(a)), z.push_back(0.005f * float(x.size() % 3));
      expected.push_back(false);
    }
  for (float h = 0.3f; h <= 1.3f; h += 0.1f)
    for (float side = -5; side <= 5; side += 0.2f) {
      x.push_back(24), y.push_back(side), z.push_back(h);
      expected.push_back(true);
    }
  CHECK(label_nonground(x, y, z) == expected);
  // a bank of 20 degrees is ground, a bank of 60 degrees is not
  for (const double bank_deg : {20.0, 60.0}) {
    std::vector<float> bx, by, bz;
    for (float u = 0; u < 4; u += 0.25f)
      for (float v = 0; v < 4; v += 0.25f) {
        bx.push_back(u), by.push_back(v * float(std::cos(bank_deg * M_PI / 180)));
        bz.push_back(v * float(std::sin(bank_deg * M_PI / 180)));
      }
    CHECK(label_nonground(bx, by, bz) == std::vector<bool>(bx.size(), bank_deg > 40));
  }
}

TEST_CASE("label_ground: a line has no normal, so its neighbours decide; empty and invalid input does not crash") {
  // far rings of a road, 3 m apart, their points 5 cm apart: the nearest 12 points of a point lie on its own ring
  std::vector<float> x, y, z;
  for (float line = 30; line <= 33; line += 3)
    for (float side = -1; side <= 1; side += 0.05f) x.push_back(line), y.push_back(side), z.push_back(0);
  CHECK(label_nonground(x, y, z) == std::vector<bool>(x.size(), false));
  CHECK(label_nonground({}, {}, {}).empty());
  CHECK(label_nonground({NAN}, {0}, {0}) == std::vector<bool>{false});
  CHECK_THROWS_AS(label_nonground({1}, {0}, {}), std::invalid_argument);
  LabelGroundParams bad;
  bad.neighbours = 2;
  CHECK_THROWS_AS(label_nonground({1}, {0}, {0}, bad), std::invalid_argument);
}
