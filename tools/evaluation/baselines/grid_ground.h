// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// The 2.5-D binary grid of Himmelsbach, von Hundelshausen & Wuensche 2009: a cell whose points differ in height by more
// than a threshold is an obstacle, and so are all of its points; all others are ground.
#pragma once

#include <cstdint>
#include <vector>

namespace overtake::baselines {

// Tuned for F1 on las_vegas_15, the five tune seeds (overtake evaluate --tune; tools/evaluation/README.md).
struct GridGroundParams {
  double cell_m = 0.75, height_m = 0.3, reach_m = 150;  // points farther out than reach count as ground
};
// Points in the vehicle frame; true: non-ground. Throws std::invalid_argument: columns of different lengths.
std::vector<bool> mark_nonground(const std::vector<float>& x_m, const std::vector<float>& y_m,
                                 const std::vector<float>& z_m, const GridGroundParams& params = {});

}  // namespace overtake::baselines
