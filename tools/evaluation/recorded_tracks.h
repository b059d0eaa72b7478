// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// The tracker alone on recorded traffic: detections are the labels' centres with Gaussian noise of 0.2 m, one in ten is
// missed; seeds 1 to 4 together.
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

}  // namespace overtake::evaluation
