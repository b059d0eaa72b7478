// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// The parts of metrics.json that contain more than one figure's numbers.
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

#include "tools/evaluation/figures.h"

namespace overtake::evaluation {

// Adds to one variant's entry: automatic labels, clusters by the paper's rule, seams, more on tracking.
void add_measures(const Figures& figures, nlohmann::json& entry);
// [{"preset", "scenario", "claims": [...], "costs": [...], "controls": [...]}]: one per preset and scenario.
nlohmann::json judgements_json(const std::vector<Figures>& all);

// {"frame_ms", "frames_per_second", "segmentation_share"}: from the frame's wall time, one frame at a time.
nlohmann::json times_json(const Figures& figures);
// Adds results that are measured once, from files beside the runs: recordings.json to `metrics`, scaling.json to
// `times`.
void add_measured(const std::string& out, nlohmann::json& metrics, nlohmann::json& times);

}  // namespace overtake::evaluation
