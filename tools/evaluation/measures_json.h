// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// The parts of metrics.json that are not one figure's numbers alone.
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

#include "tools/evaluation/figures.h"

namespace overtake::evaluation {

// Added to one contestant's entry: automatic labels, clusters by the paper's rule, seams, more of tracking.
void add_measures(const Figures& figures, nlohmann::json& entry);
// [{"preset", "scenario", "claims": [...], "costs": [...], "controls": [...]}]: of each preset and scenario.
nlohmann::json judgements_json(const std::vector<Figures>& all);

// {"frame_ms", "frames_per_second", "segmentation_share"}: of the frame's time by the clock, one frame at a time.
nlohmann::json times_json(const Figures& figures);
// What is measured once and lies beside the runs: recordings.json into `metrics`, scaling.json into `times`.
void add_measured(const std::string& out, nlohmann::json& metrics, nlohmann::json& times);

}  // namespace overtake::evaluation
