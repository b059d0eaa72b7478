// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// The numbers of a frame as JSON (from core/columns.def and pipeline/stats.def), and a JSON Schema for each:
// "overtake.Detections", "overtake.Tracks", "overtake.Truth", "overtake.Times", "overtake.Counters". Stamps are strings
// of ns, because JSON numbers lose digits beyond 2^53. Values that are not finite are null.
#pragma once

#include <string>
#include <vector>

#include "pipeline/overtake.h"
#include "tools/io/rig.h"
#include "tools/io/sensor_scan.h"

namespace overtake::cli {

std::string number_schema(const std::string& name);
std::string format_detections(const ovt_frame_info& info, const ovt_detections& detections);
std::string format_tracks(const ovt_frame_info& info, const ovt_tracks& tracks);
std::string format_truth(int64_t stamp_ns, bool in_map, const std::vector<io::KnownCar>& cars);
std::string format_times(ovt_reader* reader, const ovt_frame_info& info, const io::Rig& rig);
std::string format_counters(const ovt_stats& stats);

}  // namespace overtake::cli
