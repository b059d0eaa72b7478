// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// The tracker alone on recorded traffic and on a recorded drive, seeds 1 to 4 together. Of traffic, detections are the
// labels' centres with Gaussian noise of 0.2 m, one in ten is missed.
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <string>
#include <string_view>

#include "tools/client/config.h"

namespace overtake::evaluation {

// Vehicles with four or more wheels, in the names of any data set.
bool is_vehicle_category(std::string_view category);

// KITTI's labels end at the edge of the camera's picture: tracks outside (40 deg) without a label are not evaluated.
// `preset`: preset or configuration; its map and poses are not used.
nlohmann::json evaluate_kitti_tracks(const std::string& folder, const std::string& sequence,
                                     const cli::Options& preset);
nlohmann::json evaluate_av2_tracks(const std::string& folder, const std::string& log, const cli::Options& preset);
// MOTA of these sequences together; id switches and fragments of all of them, of one seed.
nlohmann::json sum_tracks(const nlohmann::json& sequences);

// One car's recorded drive (columns time, x, y, vx, vy, phi, omega): detections are its places with noise of 0.3 m,
// every fifth is dropped. Root mean square errors of the nearest confirmed track while the car drives, over 3 m/s;
// course against the car's heading phi, and against phi with its slip angle. `followed`: share of the iterations with a
// confirmed track; `tracks`: ids of confirmed tracks, of one seed. `map`: as --map, "none" without.
nlohmann::json evaluate_drive(const std::string& path, const std::string& map, const cli::Options& preset);

}  // namespace overtake::evaluation
