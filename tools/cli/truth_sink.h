// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// overtake run --truth: the other cars' positions, with the nearest detections and tracks.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "tools/cli/frame_sink.h"

namespace overtake::cli {

// A car at the start of the frame's scans. NaN: not in the truth.
struct TrueCar {
  std::string name;
  double ahead_m, left_m;      // vehicle frame
  double x_m, y_m, speed_mps;  // map
};

// Reads a CSV, by frame number: frame,ego_x_m,ego_y_m[,name][,x_m,y_m][,speed_mps][,is_ego], as truth.csv of overtake
// simulate; leaves out rows with is_ego 1. Throws io::Error.
std::map<int64_t, std::vector<TrueCar>> read_truth(const std::string& path);

class TruthSink : public FrameSink {
 public:
  // source: a file for read_truth; kOwnTruth: the opponent's position in the recording.
  static constexpr const char* kOwnTruth = "own";
  explicit TruthSink(const std::string& source);

  void add(const FinishedFrame& frame) override;
  // Number of frames with truth.
  int64_t frame_count() const { return frame_count_; }
  // Two tables: detections in the vehicle frame; confirmed tracks in the map frame, if truth and tracks are in it. If
  // there are more than 24 frames, shows only every 10th (100th ...) frame.
  std::string format() const;

 private:
  struct Row {
    int64_t frame;
    TrueCar car;
    double detection_x_m, detection_y_m, detection_off_m;  // off NaN: none within kDetectionReach_m
    int32_t points;
    std::string track;  // "": none within kTrackReach_m
    double track_off_m, track_speed_mps;
  };
  Row match(const FinishedFrame& frame, const TrueCar& car) const;

  bool own_;
  std::map<int64_t, std::vector<TrueCar>> truth_;
  std::vector<Row> rows_;
  int64_t frame_count_ = 0;
  bool any_in_map_ = false;
};

}  // namespace overtake::cli
