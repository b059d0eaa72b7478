// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// Plans for a series of overtakes between two cars: the passed car passes next.
#pragma once

#include <vector>

#include "tools/sim/motion.h"

namespace overtake::sim {

struct Overtake {
  bool ego_passes = true, on_left = true, defends = false;
  double passer_mps = 70, passed_mps = 60;
};

// Sets start, speed and lane of both cars, and the total time. In each overtake the gap (centre to centre, along the
// track, seen from the passer) goes from -kOvertakeGap to +kOvertakeGap.
inline constexpr double kOvertakeGap = 95;
void plan_overtakes(const std::vector<Overtake>& list, CarPlan& ego, CarPlan& other, double& seconds);

}  // namespace overtake::sim
