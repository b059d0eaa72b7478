// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// What bench_latency pushes: the demo scene made in memory, or a recording; repeated for as long as the run lasts, with
// stamps that go on. Stamps tick at the sensors' own period whatever the rate of the run: the library knows no other
// time.
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "pipeline/overtake.h"
#include "tests/support/scene.h"
#include "tools/io/ego_file.h"
#include "tools/io/map_file.h"
#include "tools/io/recording.h"

namespace overtake::bench {

struct ReplayScan {
  int64_t offset_ns;  // of its stamp after its frame's first one
  ovt_points points;  // borrowed from the input; the stamp is set at the push
};

struct ReplayDef {
  std::string recording, rig, map, ego;  // files and names as `overtake run` takes them; recording "": the scene
  int32_t scene_frames = 60;
  uint64_t scene_seed = 1;
};

class LatencyInput {
 public:
  explicit LatencyInput(const ReplayDef& def);  // throws io::Error
  LatencyInput(const LatencyInput&) = delete;
  LatencyInput& operator=(const LatencyInput&) = delete;

  const std::string& source() const { return source_; }  // in words
  int64_t period_ns() const { return period_ns_; }       // of the stamps
  int32_t sensor_count() const { return int32_t(sensors_.size()); }
  void fill(ovt_detector_def& def) const;  // sensors and map; borrows

  // Frame k of the run, k >= 0. Null: that sensor has no scan in it.
  const ReplayScan* scan(int64_t k, int32_t sensor) const;
  int64_t frame_stamp_ns(int64_t k) const { return k * period_ns_; }
  int64_t frame_of_stamp(int64_t first_stamp_ns) const { return first_stamp_ns / period_ns_; }
  // The poses that the points of frame k need and frame k - 1 did not. Any thread, one at a time.
  void poses(int64_t k, std::vector<ovt_ego_pose>& out) const;

 private:
  void load_scene(const ReplayDef& def);
  void load_recording(const ReplayDef& def);

  std::string source_;
  int64_t period_ns_ = 0;
  std::vector<ovt_sensor_def> sensors_;
  io::MapData map_;
  ovt_map_def map_def_;
  bool has_map_ = false;
  std::vector<std::vector<ReplayScan>> frames_;  // [frame][sensor]; points.struct_size 0: none
  // owners of what is borrowed
  std::vector<std::vector<char>> scene_points_;
  std::vector<io::FrameScans> recorded_;
  std::vector<int64_t> recorded_stamp_ns_;  // first stamp per frame
  std::vector<io::EgoRow> ego_;
  std::unique_ptr<Scene> scene_;
};

}  // namespace overtake::bench
