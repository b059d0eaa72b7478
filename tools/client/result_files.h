// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// The result tables: one row per detection, per track, per stage and frame. They read from the C API's reader.
#pragma once

#include <string>
#include <string_view>

#include "core/hash.h"
#include "pipeline/overtake.h"
#include "tools/io/csv.h"
#include "tools/io/rig.h"

namespace overtake::cli {

inline constexpr const char* kTimingHeader = "frame,stamp_ns,sensor,stage,time_us";

// The name of a value: entry number `value` of `words`, which are separated by spaces (core/columns.def).
std::string_view word_of(std::string_view words, int64_t value);
// First lines of the CSV files: the columns that core/columns.def lists for them, those of the frame, and at the end
// those that only some methods compute, where the table has them.
std::string detections_header(const ovt_detections& detections);
std::string tracks_header(const ovt_tracks& tracks);
// heading_source: "ref" (map or ego heading) or "var" (from the points).
void write_detections(io::CsvWriter& csv, int64_t frame, const ovt_detections& detections);
// state: tentative or confirmed. ahead_m, left_m: in the ego vehicle's frame at the frame's stamp; empty where the
// tracks are in the map frame and no ego pose is known. name: track_name(id).
void write_tracks(io::CsvWriter& csv, int64_t frame, const ovt_frame_info& info, const ovt_tracks& tracks);
// sensor: its name; empty for the stages of the whole frame. Leaves out stages that did not run.
void write_times(io::CsvWriter& csv, int64_t frame, int64_t stamp_ns, const io::Rig& rig, ovt_reader* reader);

// Hash of all detections and tracks of a run, frame by frame. It contains no frame numbers, and its stamps count from
// the first frame, so the same scans with the same time differences give the same hash from every file format.
class ResultHash {
 public:
  void add(const ovt_frame_info& info, const ovt_detections& detections, const ovt_tracks& tracks);
  uint64_t value() const { return hash_.value(); }

 private:
  Hash hash_;
  bool any_ = false;
  int64_t first_ns_ = 0;
};

// The yaw of the ego vehicle's frame in the map, as detections and tracks have it (ego_heading_offset_rad).
double vehicle_yaw_rad(const ovt_frame_info& info);

// A track at the frame's stamp, in the ego vehicle's frame; NaN if no ego pose is known.
struct Place {
  double ahead_m, left_m;
};
Place place_of(const ovt_frame_info& info, const ovt_tracks& tracks, int32_t i);

// "34:1" (slot and generation): a readable form of the 64-bit id.
std::string track_name(uint64_t id);

double read_time_us(ovt_reader* reader, int32_t sensor, ovt_stage stage);  // NaN: did not run

}  // namespace overtake::cli
