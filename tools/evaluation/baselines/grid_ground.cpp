// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
#include "tools/evaluation/baselines/grid_ground.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>

namespace overtake::baselines {

std::vector<bool> mark_nonground(const std::vector<float>& x_m, const std::vector<float>& y_m,
                                 const std::vector<float>& z_m, const GridGroundParams& params) {
  if (x_m.size() != y_m.size() || x_m.size() != z_m.size()) throw std::invalid_argument("x, y and z differ in length");
  const int64_t half = int64_t(std::ceil(params.reach_m / params.cell_m)), width = 2 * half;
  struct Cell {
    float low = std::numeric_limits<float>::infinity(), high = -std::numeric_limits<float>::infinity();
  };
  std::vector<Cell> cells(std::size_t(width * width));
  std::vector<int64_t> cell_of(x_m.size(), -1);
  for (std::size_t i = 0; i < x_m.size(); ++i) {
    const double cx = std::floor(double(x_m[i]) / params.cell_m), cy = std::floor(double(y_m[i]) / params.cell_m);
    if (!(std::abs(cx + 0.5) < double(half) && std::abs(cy + 0.5) < double(half)) || !std::isfinite(z_m[i])) continue;
    cell_of[i] = (int64_t(cy) + half) * width + int64_t(cx) + half;
    Cell& cell = cells[std::size_t(cell_of[i])];
    cell.low = std::min(cell.low, z_m[i]), cell.high = std::max(cell.high, z_m[i]);
  }
  std::vector<bool> nonground(x_m.size(), false);
  for (std::size_t i = 0; i < x_m.size(); ++i) {
    if (cell_of[i] < 0) continue;
    const Cell& cell = cells[std::size_t(cell_of[i])];
    nonground[i] = double(cell.high) - double(cell.low) > params.height_m;
  }
  return nonground;
}

}  // namespace overtake::baselines
