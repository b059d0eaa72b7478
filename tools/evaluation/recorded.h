// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// Results on the recorded data (README: "Recorded data"; folders as there; missing data sets are reported and left
// out):
//
//   racecar         every frame: detections at the opponent's GNSS box and their offsets, clusters inside its box
//                   enlarged by 1 m, points of its cluster outside of it (wall), ground against the automatic labels,
//                   the grid

//   av2, nuscenes   one frame each: detections within 2 m of boxes with a vehicle's size (up to 10 % longer than the
//                   known one, 3 points and more), by range; detections at no box of any kind
//   kitti, av2      the tracker alone on label centres with noise of 0.2 m, one in ten missed: CLEAR MOT, HOTA, GOSPA
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <string>

namespace overtake::evaluation {

// Writes OUT/recordings.json and prints the numbers. Throws io::Error if the folder has none of the data sets, or a
// file is damaged.
nlohmann::json evaluate_recordings(const std::string& folder, const std::string& preset, const std::string& out,
                                   bool print);

}  // namespace overtake::evaluation
