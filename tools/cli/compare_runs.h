// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// Two runs of one recording (folders of `overtake run`) without truth: what both found, and what only one did.
#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "tools/evaluation/metrics/summary.h"

namespace overtake::cli {

inline constexpr double kSamePlaceM = 2.0;

enum class Reference { kUnknown, kMap, kVehicle };

struct RunTables {
  struct Detection {
    double x_m, y_m, heading_rad;
  };
  struct Track {
    uint64_t id;
    bool confirmed;
    double x_m, y_m, speed_mps, ahead_m, left_m;  // NaN: not known
  };
  std::string folder;
  Reference reference = Reference::kUnknown;             // of the tracks' x_m, y_m
  std::map<int64_t, std::vector<Detection>> detections;  // by frame
  std::map<int64_t, std::vector<Track>> tracks;          // by frame
  std::map<int64_t, int64_t> stamp_of_frame;             // of the frames with a detection or a track
};
// Reads detections.csv and tracks.csv. Throws io::Error with file and line.
RunTables read_run(const std::string& folder);

// A track that is confirmed in one run, and within kSamePlaceM of no confirmed track of the other run in more than half
// of its frames. Place: where it was confirmed first.
struct LoneTrack {
  uint64_t id = 0;
  int64_t frames = 0, matched = 0;
  double from_s = 0, duration_s = 0;  // from_s: after the first frame with a track
  double x_m = 0, y_m = 0, ahead_m = 0, left_m = 0;
  double s_m = 0, d_m = 0;  // on the map; NaN: none was given
};

struct RunCounts {
  Reference reference = Reference::kUnknown;
  int64_t detections = 0, frames_with_detections = 0, tracks = 0, confirmed_tracks = 0, confirmed_rows = 0;
  int64_t lone_detections = 0, lone_rows = 0;  // without a match in the other run
  std::vector<LoneTrack> lone_tracks;          // in order of time
};

struct RunComparison {
  RunCounts a, b;
  bool by_vehicle =
      false;  // one run's tracks are in the map, the other's are not: matched by ahead_m, left_m, no speeds
  // Sizes of the differences of the matched ones.
  metrics::Summary detection_distance_m, detection_turn_rad, track_distance_m, track_speed_mps;
};
// Matches in the same frame, nearest pairs first. Throws io::Error if the runs are of
// different recordings.
RunComparison compare_runs(const RunTables& a, const RunTables& b);
// Fills s_m and d_m of tracks in the map. Throws io::Error.
void place_on_map(RunComparison& comparison, const std::string& map_file);

}  // namespace overtake::cli
