// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// A row of overtakes between two cars as plans: who was passed is next to pass.
#pragma once

#include <vector>

#include "tools/sim/motion.h"

namespace overtake::sim {

struct Overtake {
  bool ego_passes = true, on_left = true, defends = false;
  double passer_mps = 70, passed_mps = 60;
};

// Fills start, speed and lane of both cars and sets the time they take. From one overtake to the next the gap (centre
// to centre, along the track) goes from -kOvertakeGap to +kOvertakeGap, seen from the passer.
inline constexpr double kOvertakeGap = 95;
void plan_overtakes(const std::vector<Overtake>& list, CarPlan& ego, CarPlan& other, double& seconds);

}  // namespace overtake::sim
