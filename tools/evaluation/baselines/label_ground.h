// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// Ground and obstacles of a scan without a human: the paper's automatic labelling (section V-A). A plane is fitted to
// each point's nearest neighbours; a point with a nearly vertical normal is ground, any other an obstacle; then each
// point takes the vote of its nearest neighbours. Not a part of the method: it is slow and judges the method where
// there is no truth.
//
// The paper leaves the numbers open. Here neighbours are taken until they span a plane: along a scan line far away they
// all lie on one straight line, and a line has no normal. Where even `most` of them do, the point has no opinion and
// takes that of its neighbours.
#pragma once

#include <cstdint>
#include <vector>

namespace overtake::baselines {

// Tuned in the same way on the first of them.
struct LabelGroundParams {
  int32_t neighbours = 8, most = 96;  // of the plane: at first, and doubled up to
  double spread = 0.15;               // a plane: second extent of the neighbours over their first
  double flat_deg = 30;               // a normal this close to the vertical is ground; a banked turn has 20 deg
  int32_t voters = 24;
};

// Points in a frame whose z is up; true: non-ground. Points that are not finite are ground. Throws
// std::invalid_argument: columns of different lengths, parameters below 3 neighbours or 1 voter.
std::vector<bool> label_nonground(const std::vector<float>& x_m, const std::vector<float>& y_m,
                                  const std::vector<float>& z_m, const LabelGroundParams& params = {});

}  // namespace overtake::baselines
