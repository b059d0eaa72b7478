// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// What the recorded data says (README: "Recorded data"; folders as there; what is missing is left out and said):
//
//   racecar         every frame: detections at the opponent's GNSS box and how far off, clusters inside its box made 1
//   m
//                   larger, points of its cluster outside of that (wall), ground against the automatic labels, the grid
//   av2, nuscenes   one sweep each: detections within 2 m of boxes that pass for the vehicle by size (length up to 10 %
//                   over the known one, 3 points and more), by range; detections at no box of any kind
//   kitti, av2      the tracker alone on label centres with noise of 0.2 m, one in ten missed: CLEAR MOT, HOTA, GOSPA
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <string>

namespace overtake::evaluation {

// Writes OUT/recordings.json and prints the numbers. Throws io::Error: nothing of it is in the folder, or a damaged
// file.
nlohmann::json judge_recordings(const std::string& folder, const std::string& preset, const std::string& out,
                                bool print);

}  // namespace overtake::evaluation
