// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// Time of a frame against 1 to 8 sensors and 1 to N workers, on the first sweeps of a log. Sensors beyond the rig's are
// its own again, turned by 40 deg: as much work, no sense.
#pragma once

#include <string>

namespace overtake::evaluation {

// Writes OUT/scaling.json: CPU, load average at the start, and of each (sensors, workers) the time from the push of the
// first scan to the tracks with one frame at a time (median, p90), the stages' medians, and the frames a second where
// frames may overlap. Throws io::Error.
void measure_scaling(const std::string& log, const std::string& preset, const std::string& out, bool print);

}  // namespace overtake::evaluation
