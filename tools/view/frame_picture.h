// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// One frame from above: points, detections, tracks with their predicted paths.
#pragma once

#include <string>

#include "pipeline/overtake.h"
#include "tools/io/image.h"
#include "tools/io/rig.h"

namespace overtake::cli {

// The reader's frame in the ego vehicle's frame, driving direction to the right: 90 m ahead, 30 m behind, 26 m to
// either side. Throws io::Error.
//
//   points       ground dark, others grey, of a detection orange
//   detection    rectangle of the known size, orange
//   track        confirmed only, blue: rectangle, name, speed; predicted path with a dot every 0.5 s, and every 1 s
//                the 95 % ellipse and, inside of it, the 70 % ellipse where the method publishes a steady car's
//                deviations, unless they are wider than the road
io::Picture draw_frame(ovt_reader* reader, const io::Rig& rig, const ovt_params& params, const std::string& caption);
// "0:1  38.2 m/s": the name as in tables.
std::string track_label(uint64_t id, double speed_mps);

}  // namespace overtake::cli
