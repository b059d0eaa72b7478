// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// Input of bench_latency: the demo scene, made in memory, or a recording. It repeats for the whole run, and its stamps
// continue. Stamps advance by the sensors' period at any rate of the run: the library reads no other clock.
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
  int64_t offset_ns;  // offset after the frame's first stamp
  ovt_points points;  // points into the input; push sets the stamp
};

struct ReplayDef {
  std::string recording, rig, map, ego;  // files and names as for `overtake run`; recording "": the scene
  int32_t scene_frames = 60;
  uint64_t scene_seed = 1;
};

class LatencyInput {
 public:
  explicit LatencyInput(const ReplayDef& def);  // throws io::Error
  LatencyInput(const LatencyInput&) = delete;
  LatencyInput& operator=(const LatencyInput&) = delete;

  const std::string& source() const { return source_; }  // description
  int64_t period_ns() const { return period_ns_; }       // period of the stamps
  int32_t sensor_count() const { return int32_t(sensors_.size()); }
  void fill(ovt_detector_def& def) const;  // sets sensors and map, which point into the input

  // Frame k of the run, k >= 0. Null: the frame has no scan of the sensor.
  const ReplayScan* scan(int64_t k, int32_t sensor) const;
  int64_t frame_stamp_ns(int64_t k) const { return k * period_ns_; }
  int64_t frame_of_stamp(int64_t first_stamp_ns) const { return first_stamp_ns / period_ns_; }
  // The poses that the points of frame k need, without those of frame k - 1. Any thread, one at a time.
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
  // owners of the memory that ReplayScan points to
  std::vector<std::vector<char>> scene_points_;
  std::vector<io::FrameScans> recorded_;
  std::vector<int64_t> recorded_stamp_ns_;  // first stamp per frame
  std::vector<io::EgoRow> ego_;
  std::unique_ptr<Scene> scene_;
};

}  // namespace overtake::bench
