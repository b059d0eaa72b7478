// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// The tracker alone on recorded traffic: detections are the labels' centres with Gaussian noise of 0.2 m, one in ten is
// missed; seeds 1 to 4 together.
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <string>
#include <string_view>

namespace overtake::evaluation {

// Vehicles on four wheels or more, of any data set's names.
bool is_vehicle_category(std::string_view category);

// Labels of KITTI end where the camera's picture does: tracks outside of it (40 deg) and at no label are not judged.
nlohmann::json judge_kitti_tracks(const std::string& folder, const std::string& sequence, const std::string& preset);
nlohmann::json judge_av2_tracks(const std::string& folder, const std::string& log, const std::string& preset);

}  // namespace overtake::evaluation
