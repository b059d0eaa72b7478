// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
#include "tools/evaluation/baselines/euclidean_clusters.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>
#include <stdexcept>
#include <unordered_map>

namespace overtake::baselines {

// Cells have a diagonal of one radius, so all points of a cell are one cluster, and two points within the radius are
// at most two cells apart on each axis.
std::vector<int32_t> cluster_points(const std::vector<float>& x_m, const std::vector<float>& y_m,
                                    const std::vector<float>& z_m, double radius_m) {
  if (x_m.size() != y_m.size() || x_m.size() != z_m.size()) throw std::invalid_argument("x, y and z differ in length");
  if (!(radius_m > 0)) throw std::invalid_argument("the radius must be positive");
  const std::size_t n = x_m.size();
  const double cell_m = radius_m / std::sqrt(3.0) * (1 - 1e-9), radius2 = radius_m * radius_m;
  const auto key = [](int64_t cx, int64_t cy, int64_t cz) {
    return ((cx + (1 << 20)) << 42) | ((cy + (1 << 20)) << 21) | (cz + (1 << 20));
  };
  std::unordered_map<int64_t, std::vector<std::size_t>> cells;
  std::vector<std::array<int64_t, 3>> place(n);
  for (std::size_t i = 0; i < n; ++i) {
    const double p[3] = {double(x_m[i]), double(y_m[i]), double(z_m[i])};
    for (std::size_t k = 0; k < 3; ++k) {
      if (!(std::fabs(p[k]) / cell_m < (1 << 20) - 3)) throw std::invalid_argument("a point lies too far out");
      place[i][k] = int64_t(std::floor(p[k] / cell_m));
    }
    cells[key(place[i][0], place[i][1], place[i][2])].push_back(i);
  }
  std::vector<std::size_t> root(n);
  std::iota(root.begin(), root.end(), std::size_t{0});
  const auto find = [&](std::size_t i) {
    while (root[i] != i) i = root[i] = root[root[i]];
    return i;
  };
  const auto near = [&](std::size_t a, std::size_t b) {
    const double dx = double(x_m[a]) - double(x_m[b]), dy = double(y_m[a]) - double(y_m[b]),
                 dz = double(z_m[a]) - double(z_m[b]);
    return dx * dx + dy * dy + dz * dz <= radius2;
  };
  for (const auto& [k, own] : cells) {
    for (const std::size_t i : own) root[find(i)] = find(own[0]);
    const auto& at = place[own[0]];
    for (int64_t dx = 0; dx <= 2; ++dx)
      for (int64_t dy = dx > 0 ? -2 : 0; dy <= 2; ++dy)
        for (int64_t dz = dx > 0 || dy > 0 ? -2 : 1; dz <= 2; ++dz) {
          const auto other = cells.find(key(at[0] + dx, at[1] + dy, at[2] + dz));
          if (other == cells.end() || find(own[0]) == find(other->second[0])) continue;
          for (const std::size_t i : own)
            if (std::any_of(other->second.begin(), other->second.end(), [&](std::size_t j) { return near(i, j); })) {
              root[find(i)] = find(other->second[0]);
              break;
            }
        }
  }
  std::vector<int32_t> cluster(n, -1), of_root(n, -1);
  int32_t count = 0;
  for (std::size_t i = 0; i < n; ++i) {
    int32_t& c = of_root[find(i)];
    if (c < 0) c = count++;
    cluster[i] = c;
  }
  return cluster;
}

}  // namespace overtake::baselines
