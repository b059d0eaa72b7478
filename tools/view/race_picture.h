// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// Pictures of a simulated race at one moment.
#pragma once

#include <string>

#include "tools/sim/simulator.h"

namespace overtake::cli {

// Writes FOLDER/above.png (the circuit with every car's path, and all points around the ego vehicle by surface) and
// FOLDER/front.png, left.png, right.png (each sensor's scan, scan_picture.h). Uses the first frame at or after at_s,
// at the race's end the last one. Throws io::Error.
void write_race_pictures(const std::string& folder, sim::Simulator& simulator, double at_s);

}  // namespace overtake::cli
