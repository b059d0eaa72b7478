// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// A detector of the C API with the command line's inputs: made from a Config, fed with a recording's frames and
// ego poses.
#pragma once

#include <string>
#include <vector>

#include "pipeline/overtake.h"
#include "tools/client/config.h"
#include "tools/io/ego_file.h"
#include "tools/io/map_file.h"
#include "tools/io/recording.h"

namespace overtake::cli {

// Throws io::Error with the status' own sentence unless OVT_OK.
void check(ovt_status status, const std::string& what);

// What is read from files as the C API takes it. to_map_def and to_points borrow the vectors of what they are given.
ovt_sensor_def to_sensor_def(const io::RigSensor& sensor);
ovt_map_def to_map_def(const io::MapData& map);
ovt_points to_points(const io::SensorScan& scan);
ovt_ego_pose to_pose(const io::EgoRow& row);

class Session {
 public:
  // Reads the map and ego files of the config. on_frame may be null. Throws io::Error.
  Session(const Config& config, ovt_frame_fn* on_frame, void* user);
  ~Session();
  Session(const Session&) = delete;
  Session& operator=(const Session&) = delete;

  // Poses of the recording itself, behind those there are.
  void add_ego(const std::vector<io::EgoRow>& rows) { ego_.insert(ego_.end(), rows.begin(), rows.end()); }
  // Of the poses there are so far; 0 where there are none.
  int64_t ego_first_ns() const { return ego_.empty() ? 0 : ego_.front().stamp_ns; }
  int64_t ego_last_ns() const { return ego_.empty() ? 0 : ego_.back().stamp_ns; }
  // Ego poses up to the first one at or after the stamp.
  void push_ego_until(int64_t stamp_ns);
  // The poses a frame's points need, then its scans. A scan the library calls late or a duplicate is not an error: the
  // library counts it.
  void push(const io::FrameScans& frame);
  void flush();

  ovt_detector* detector() const { return detector_; }
  ovt_stats stats() const;
  // In how many frames each capacity was too small so far, as sentences; none where all were large enough. The counters
  // are looked at behind every push: with more than one worker two frames that finish together may count as one.
  std::vector<std::string> full_capacities() const;

 private:
  void count_overflows();

  struct Overflow {
    const char* capacity;
    int64_t rows = 0, frames = 0;
  };
  int64_t period_ns_;
  io::Capacities capacities_;
  int64_t frames_ = 0;
  Overflow overflows_[3] = {{"clusters"}, {"candidates"}, {"tracks"}};
  std::vector<io::EgoRow> ego_;
  std::size_t next_ego_ = 0;
  ovt_detector* detector_ = nullptr;
  const io::Rig rig_;
};

}  // namespace overtake::cli
