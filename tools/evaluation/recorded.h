// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// Results on the recorded data (README: "Recorded data"; folders as there; missing data sets are reported and left
// out):
//
//   racecar         every frame: detections at the opponent's GNSS box and their offsets, clusters inside its box
//                   enlarged by 1 m, points of its cluster outside of it (wall), ground against the automatic labels,
//                   the grid; detections on the road between the walls that are not at the opponent
//   av2, nuscenes   all scans of a data set together: detections within 2 m of boxes with a vehicle's size (up to 10 %
//                   longer than the known one, 3 points and more), by range; detections at no box of any kind. Labelled
//                   cars to 60 m: one cluster (one has 3 points or more in the box, and none outside of the box
//                   enlarged by 1 m), detected, centre error
//   kitti           12 frames: labelled cars to 60 m, as above
//   kitti, av2      the tracker alone on label centres with noise of 0.2 m, one in ten missed: CLEAR MOT, HOTA, GOSPA
//   lvms            the tracker alone on the places of a driving AV-21, without a map and on that of its two bounds:
//                   errors of speed, course, yaw rate and place
#pragma once

#include <map>
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

#include "tools/evaluation/table.h"

namespace overtake::evaluation {

// Writes OUT/recordings.json and prints it and a table, with a column for each of `presets`; a name in `configs` is
// that of a configuration, with its file. The results of the first one are the object itself, those of the others are
// in "others". Throws io::Error if the folder has none of the data sets, or a file is damaged.
nlohmann::json evaluate_recordings(const std::string& folder, const std::vector<std::string>& presets,
                                   const std::map<std::string, std::string>& configs, const std::string& out,
                                   bool print);
// The presets and configurations among the names, because variants need a log. If there are only variants: the preset
// of the first one; "paper" without a name.
std::vector<std::string> names_for_recordings(const std::vector<std::string>& names);
// The table of recordings.json.
Rows recording_rows(const nlohmann::json& recordings);

}  // namespace overtake::evaluation
