// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// Elements of the report's page, and its sections.
#pragma once

#include <string>
#include <vector>

#include "tools/evaluation/differences.h"
#include "tools/evaluation/figures.h"
#include "tools/evaluation/quality.h"
#include "tools/evaluation/snapshot_picker.h"
#include "tools/evaluation/track_quality.h"

namespace overtake::evaluation {

inline constexpr const char* kBlue = "#2f7fd0";
inline constexpr const char* kOrange = "#e07b16";
inline constexpr const char* kGreen = "#2f9e44";
inline constexpr const char* kPurple = "#9b5fc0";

std::string table_html(const Rows& rows);
std::string paragraph(const std::string& text);
std::string heading(const std::string& id, const std::string& text);
std::string page_begin(const std::string& title);  // with the style sheet, light and dark
std::string page_end();
std::string mean_and_deviation(const std::vector<double>& values, int32_t digits);  // no value: "not measured"
std::string words_of(Origin origin);  // "simulated", "recorded", "simulated and recorded"

// Sections; `f` is the source of the figures.
std::string ground_section(const Figures& f);
std::string clustering_section(const std::vector<Figures>& all, const Figures& f);
std::string detection_plot(const Figures& f);
std::string detection_section(const Figures& f);
std::string error_section(const Figures& f);
std::string time_section(const Figures& f);
std::string claims_section(const std::vector<Figures>& all, const Figures& f);
std::string oracle_section(const std::vector<Figures>& all, const Figures& f);
std::string quality_section(const std::vector<Quality>& all, const std::vector<Run>& runs);
// "": nothing to compare.
std::string difference_section(const Differences& differences);
// `main`: the scenario of the tables that are not folded.
std::string track_section(const std::vector<TrackQuality>& all, const std::string& main);
std::string scenario_section(const std::vector<Figures>& all, const std::vector<Run>& runs);
std::string picture_section(const std::map<std::string, NamedPicture>& pictures, const Figures& f,
                            const std::vector<Run>& runs);
std::string parameter_section();

// Sections from scaling.json and recordings.json: "" if missing. Throws io::Error for a damaged file.
std::string scaling_section(const std::string& out);
std::string recordings_section(const std::string& out);

}  // namespace overtake::evaluation
