// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// Time of a frame over 1 to 8 sensors and 1 to N workers, on the first frames of a log. Sensors beyond the rig's are
// copies of them, rotated by 40 deg: the work is the same, the result has no meaning.
#pragma once

#include <string>

#include "tools/client/config.h"

namespace overtake::evaluation {

// Writes OUT/scaling.json: CPU and load average at the start. For each (sensors, workers): the time from the push of
// the first scan to the tracks with one frame at a time (median, p90), the stages' medians, and the frames per second
// with overlapping frames. Throws io::Error.
void measure_scaling(const std::string& log, const cli::Options& preset, const std::string& out, bool print);

}  // namespace overtake::evaluation
