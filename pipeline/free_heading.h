// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// The heading of a race car that is not along the track: it spins, or has spun. psi_VAR is known modulo pi only, and
// turns away from the line of sight, because the points lie between a corner of the end that is seen and the far wheel.
#pragma once

#include "pipeline/car_profile.h"

namespace overtake {

// Which end of the points is the rear one: the wing at the rear is higher than the nose, by higher_m at least.
enum class RearEnd { kUnknown, kLow, kHigh };
RearEnd find_rear(const PointsAlong& points, float low_m, float high_m, float higher_m) noexcept;

// What psi_VAR has too much where the directed heading is view_rad from the line of sight: 0 where the sensor looks at
// the rear end, +-pi where it looks at the front. By simulated scans of a Dallara AV-21.
double psi_var_error(double view_rad) noexcept;

}  // namespace overtake
