// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// Labels ground and obstacles of a scan automatically, as the paper does (section V-A). Fits a plane to each point's
// nearest neighbours: a point with a nearly vertical normal is ground, any other an obstacle. Then each point takes the
// majority of its nearest neighbours. This is not a part of the method: it is slow, and evaluates the method where
// there is no truth.
//
// The paper does not give the parameters. Here neighbours are added until they span a plane: far away, neighbours on
// one scan line are on one straight line, which has no normal. If even `most` of them are, the point has no opinion and
// takes that of its neighbours.

#pragma once

#include <cstdint>
#include <vector>

namespace overtake::baselines {

// Tuned in the same way on the first of these seeds.
struct LabelGroundParams {
  int32_t neighbours = 8, most = 96;  // for the plane: first number, doubled up to the second
  double spread = 0.15;               // a plane: second extent of the neighbours divided by the first
  double flat_deg = 30;               // a normal this close to the vertical means ground; a banked turn has 20 deg
  int32_t voters = 24;
};

// Points in a frame with z up; true: non-ground. Points that are not finite are ground. Throws std::invalid_argument
// for columns of different lengths, and parameters below 3 neighbours or 1 voter.
std::vector<bool> label_nonground(const std::vector<float>& x_m, const std::vector<float>& y_m,
                                  const std::vector<float>& z_m, const LabelGroundParams& params = {});

}  // namespace overtake::baselines
