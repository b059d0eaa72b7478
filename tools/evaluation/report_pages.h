// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// The report as one HTML file. The figures show the scenario with the most frames, the tables all scenarios.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "tools/evaluation/differences.h"
#include "tools/evaluation/figures.h"
#include "tools/evaluation/quality.h"
#include "tools/evaluation/snapshot_picker.h"
#include "tools/evaluation/track_quality.h"

namespace overtake::evaluation {

// The source of the figures: the unchanged preset with the most frames; null: there is none.
const Figures* main_figures(const std::vector<Figures>& all);
std::string format_report(const std::vector<Figures>& all, const std::vector<Run>& runs,
                          const std::vector<Quality>& quality, const std::vector<TrackQuality>& tracks,
                          const Differences& differences, const std::map<std::string, NamedPicture>& pictures,
                          const std::string& out);

std::string cpu_name();

}  // namespace overtake::evaluation
