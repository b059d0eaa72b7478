// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// Pictures of a simulated race at one moment.
#pragma once

#include <string>

#include "tools/sim/simulator.h"

namespace overtake::cli {

// FOLDER/above.png: the track with the way of every car, and the surroundings of the ego vehicle with all points by
// surface. FOLDER/front.png, left.png, right.png: each sensor's scan (scan_picture.h). The sweep taken is the first one
// at or after at_s, or the last. Throws io::Error.
void write_race_pictures(const std::string& folder, sim::Simulator& simulator, double at_s);

}  // namespace overtake::cli
