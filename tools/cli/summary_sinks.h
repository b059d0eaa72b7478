// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// Sinks for the summary that `overtake run` prints at its end.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "tools/cli/frame_sink.h"
#include "tools/client/console.h"
#include "tools/client/result_files.h"
#include "tools/io/rig.h"

namespace overtake::cli {

class HashSink : public FrameSink {
 public:
  void add(const FinishedFrame& frame) override { hash_.add(frame.info, frame.detections, frame.tracks); }
  uint64_t value() const { return hash_.value(); }

 private:
  ResultHash hash_;
};

// Counts the frames, and the frames with each flag.
class CountSink : public FrameSink {
 public:
  void add(const FinishedFrame& frame) override;
  bool reads_paths() const override { return true; }
  int64_t frames() const { return frames_; }
  int64_t frames_with(uint32_t flag) const;
  int64_t frames_with_ego() const { return frames_with_ego_; }  // with a recent ego pose
  int64_t first_stamp_ns() const { return first_stamp_ns_; }
  int64_t last_stamp_ns() const { return last_stamp_ns_; }
  double off_map_m() const { return off_map_m_; }  // largest distance of the ego vehicle from the map

 private:
  int64_t frames_ = 0, frames_with_ego_ = 0, first_stamp_ns_ = 0, last_stamp_ns_ = 0;
  std::map<uint32_t, int64_t> frames_with_;  // by flag
  double off_map_m_ = 0;
};

// Times of the stages, over all frames and sensors.
class TimesSink : public FrameSink {
 public:
  explicit TimesSink(const io::Rig& rig) : sensor_count_(int32_t(rig.sensors.size())) {}
  void add(const FinishedFrame& frame) override;
  std::string format() const;

 private:
  int32_t sensor_count_;
  std::map<int32_t, std::vector<double>> times_us_;
};

// One row per frame: counts, time, and the track nearest to the opponent's position in the recording.
class FrameTableSink : public FrameSink {
 public:
  void add(const FinishedFrame& frame) override;
  bool any_opponent() const { return any_opponent_; }
  std::string format() const;

 private:
  std::vector<std::vector<std::string>> rows_;
  bool any_opponent_ = false;
};

// The confirmed tracks of the last frame, at most ten; tracks that look like cars come first.
class TrackTableSink : public FrameSink {
 public:
  static constexpr std::size_t kMost = 10;

  explicit TrackTableSink(int32_t window) : window_(window) {}  // tracker.window: hits count in so many iterations
  void add(const FinishedFrame& frame) override;
  std::size_t count() const { return count_; }
  std::string format() const { return table_.format(); }

 private:
  int32_t window_;
  std::size_t count_ = 0;
  TextTable table_{{}};
};

}  // namespace overtake::cli
