// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// The tables a command leaves: one row per detection, per track, per stage and frame. Read from the C API's reader.
#pragma once

#include <string>
#include <string_view>

#include "core/hash.h"
#include "pipeline/overtake.h"
#include "tools/io/csv.h"
#include "tools/io/rig.h"

namespace overtake::cli {

inline constexpr const char* kTimingHeader = "frame,stamp_ns,sensor,stage,time_us";

// The name of a value: the one of that number in `words`, which spaces part (core/columns.def).
std::string_view word_of(std::string_view words, int64_t value);
// The columns that core/columns.def names for CSV files, and what is about the frame; detections_header, tracks_header:
// their first line.
std::string detections_header();
std::string tracks_header();
// heading_source: ref (map or ego heading) or var (the points).
void write_detections(io::CsvWriter& csv, int64_t frame, const ovt_detections& detections);
// state: tentative or confirmed. ahead_m, left_m: in the ego vehicle's frame at the frame's stamp, empty where the
// tracks are in the map and no ego pose is known. name: track_name of the id.
void write_tracks(io::CsvWriter& csv, int64_t frame, const ovt_frame_info& info, const ovt_tracks& tracks);
// sensor: its name, or empty for the stages of the whole frame. Stages that did not run are left out.
void write_times(io::CsvWriter& csv, int64_t frame, int64_t stamp_ns, const io::Rig& rig, ovt_reader* reader);

// Of all detections and tracks of a run, frame by frame. Frame numbers are not in it, stamps count from the first
// frame: the same scans at the same distance in time give the same hash, from whatever kind of file they came.
class ResultHash {
 public:
  void add(const ovt_frame_info& info, const ovt_detections& detections, const ovt_tracks& tracks);
  uint64_t value() const { return hash_.value(); }

 private:
  Hash hash_;
  bool any_ = false;
  int64_t first_ns_ = 0;
};

// Of a track at the frame's stamp in the ego vehicle's frame, whatever frame the tracks are in; NaN where that is not
// known.
struct Place {
  double ahead_m, left_m;
};
Place place_of(const ovt_frame_info& info, const ovt_tracks& tracks, int32_t i);

// "34:1", slot and generation: an id of 64 bits for people.
std::string track_name(uint64_t id);

double read_time_us(ovt_reader* reader, int32_t sensor, ovt_stage stage);  // NaN: did not run

}  // namespace overtake::cli
