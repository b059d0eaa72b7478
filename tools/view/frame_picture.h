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

// The frame the reader stands on, in the ego vehicle's frame: driving direction to the right, left is up, 90 m ahead,
// 30 m behind, 26 m to either side. Ground points are dark, others grey, those of a detection orange; a rectangle of
// the known size at each detection (orange) and confirmed track (blue), the track's id and speed, its path with a dot
// every half second and the 95 % ellipse at each whole one, where it is not larger than the road is wide. Throws
// io::Error.
io::Picture draw_frame(ovt_reader* reader, const io::Rig& rig, const ovt_params& params, const std::string& caption);

}  // namespace overtake::cli
