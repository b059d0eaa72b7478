// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// The 2.5-D binary grid of Himmelsbach, von Hundelshausen & Wuensche 2009: if the heights of a cell's points differ by
// more than a threshold, the cell and all its points are an obstacle; all other points are ground.
#pragma once

#include <cstdint>
#include <vector>

namespace overtake::baselines {

// Tuned for F1 on las_vegas_15 with the five tune seeds (overtake evaluate --tune; tools/evaluation/README.md).
struct GridGroundParams {
  double cell_m = 0.75, height_m = 0.3, reach_m = 150;  // points beyond reach count as ground
};
// Points in the vehicle frame; true: non-ground. Throws std::invalid_argument for columns of different lengths.
std::vector<bool> mark_nonground(const std::vector<float>& x_m, const std::vector<float>& y_m,
                                 const std::vector<float>& z_m, const GridGroundParams& params = {});

}  // namespace overtake::baselines
