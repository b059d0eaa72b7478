// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// A detector of the C API for the command line: a Session builds it from a Config and pushes a recording's frames and
// ego poses.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "pipeline/overtake.h"
#include "tools/client/config.h"
#include "tools/client/map_direction.h"
#include "tools/io/cloud_view.h"
#include "tools/io/ego_file.h"
#include "tools/io/map_file.h"
#include "tools/io/recording.h"

namespace overtake::cli {

// Throws io::Error with the text of the status unless it is OVT_OK.
void check(ovt_status status, const std::string& what);

// Conversions from file types to C API types. to_map_def and to_points point into the memory of their argument.
ovt_sensor_def to_sensor_def(const io::RigSensor& sensor);
ovt_map_def to_map_def(const io::MapData& map);
ovt_points to_points(const io::SensorScan& scan);
ovt_points to_points(const io::CloudView& cloud, int32_t sensor);
ovt_ego_pose to_pose(const io::EgoRow& row);

class Session {
 public:
  // Reads the map and ego files of the config. on_frame may be null. Throws io::Error.
  Session(const Config& config, ovt_frame_fn* on_frame, void* user);
  ~Session();
  Session(const Session&) = delete;
  Session& operator=(const Session&) = delete;

  // Appends poses of the recording itself.
  void add_ego(const std::vector<io::EgoRow>& rows) { ego_.insert(ego_.end(), rows.begin(), rows.end()); }
  // Stamp of the first known pose; 0 without poses.
  int64_t ego_first_ns() const { return ego_.empty() ? 0 : ego_.front().stamp_ns; }
  int64_t ego_last_ns() const { return ego_.empty() ? 0 : ego_.back().stamp_ns; }
  // Pushes the ego poses up to the first one at or after the stamp.
  void push_ego_until(int64_t stamp_ns);
  // Sentences about what the readers of the config's map and ego poses left out or changed.
  const std::vector<std::string>& file_notes() const { return file_notes_; }
  const MapDirection& direction() const { return direction_; }  // of the poses pushed so far
  std::string bad_poses() const;  // a sentence about poses that the library cannot use; "" if there are none
  // A sentence about a recording of which no frame has a usable point. `damage`: why reading ended early, or "".
  std::string why_no_data(const std::string& damage) const;
  // Pushes the poses that the frame's points need, then its scans. A scan that the library reports as late or as a
  // duplicate is not an error: the library counts it.
  void push(const io::FrameScans& frame);
  // Pushes one scan of a live sensor; the caller judges the status.
  ovt_status push_scan(const ovt_points& scan);
  void flush();

  ovt_detector* detector() const { return detector_; }
  ovt_stats stats() const;
  // One sentence for each capacity that was too small, with the number of frames; empty if all were large enough. The
  // session compares the counters after each push, so with several workers two frames that finish together may count
  // as one. `remedy` stands before "NAME=ROWS" in the advice.
  std::vector<std::string> full_capacities(std::string_view remedy = "--capacity ") const;

 private:
  void count_overflows();
  void push_pieces(const io::FrameScans& frame);

  struct Overflow {
    const char* capacity;
    int64_t rows = 0, frames = 0;
  };
  int64_t period_ns_;
  io::Capacities capacities_;
  bool in_pieces_;
  int64_t frames_ = 0;
  Overflow overflows_[3] = {{"clusters"}, {"candidates"}, {"tracks"}};
  std::vector<io::EgoRow> ego_;
  std::size_t next_ego_ = 0;
  int64_t bad_poses_ = 0, first_bad_pose_ns_ = 0;
  std::vector<std::string> file_notes_;
  CircuitMap circuit_;
  MapDirection direction_;
  double map_margin_m_;
  ovt_detector* detector_ = nullptr;
  const io::Rig rig_;
};

}  // namespace overtake::cli
