// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// What the node publishes: each frame's detections, tracks, predicted paths and markers, from on_frame; static
// transforms and diagnostics, from the main loop.
#pragma once

#include <dds/dds.h>

#include <array>
#include <cstdint>
#include <mutex>
#include <string>
#include <utility>
#include <vector>

#include "pipeline/overtake.h"
#include "tools/io/rig.h"
#include "tools/ros2/faults.h"
#include "tools/ros2/names.h"
#include "tools/ros2/participant.h"
#include "tools/ros2/track_numbers.h"
#include "tools/ros2/window.h"

namespace overtake::ros2 {

// One entry of diagnostic_msgs/DiagnosticArray.
struct Status {
  std::string name, message;
  Level level = Level::kOk;
  std::vector<std::pair<std::string, std::string>> values;
};

class Outputs {
 public:
  Outputs(Participant& participant, Names& names, const std::string& map_frame, const std::string& vehicle_frame);

  // Frames of reference of the messages, from now on.
  void set_frames(const std::string& map, const std::string& vehicle);
  void publish_transforms(const io::Rig& rig, const std::string& vehicle_frame, int64_t stamp_ns);
  void publish_diagnostics(const std::vector<Status>& all, int64_t stamp_ns);
  static void on_frame(ovt_reader* reader, void* user);

  // What the frames said since the last call.
  struct Report {
    int64_t frames = 0, with_ego = 0, not_sent = 0, unnumbered_tracks = 0;
    uint32_t flags = 0, suspect_mask = 0, stale_mask = 0;
    double rate = 0, latency_p50_ms = 0, latency_p99_ms = 0, publish_p50_ms = 0, publish_p99_ms = 0;
    int64_t all_frames = 0, all_not_sent = 0;
    int32_t detections = 0, tracks = 0, confirmed = 0;  // of the newest frame
    ovt_frame_info newest{};
  };
  Report take_report(int64_t now_ns);
  const std::vector<dds_entity_t>& writers() const { return writers_; }
  const std::vector<std::string>& topics() const { return topics_; }  // of writers()
  const std::vector<std::string>& types() const { return types_; }

 private:
  struct Frames {
    std::string map, vehicle;
  };
  dds_entity_t add(Participant& participant, const std::string& name, const dds_topic_descriptor_t& type, Qos qos);
  void publish(ovt_reader* reader);
  void publish_detections(const ovt_frame_info& info, const ovt_detections& rows, const Frames& frames);
  void publish_tracks(const ovt_frame_info& info, const ovt_tracks& tracks, const std::string& frame);
  void publish_numbered(const ovt_tracks& tracks, const std::string& frame);
  void publish_markers(const ovt_frame_info& info, const ovt_detections& rows, const ovt_tracks& tracks,
                       const Frames& frames);
  void write(dds_entity_t writer, const void* message);

  std::vector<dds_entity_t> writers_;
  std::vector<std::string> topics_, types_;
  dds_entity_t detections_, tracks_, markers_, transforms_, diagnostics_;
  std::array<dds_entity_t, kTrackTopics> odometry_{}, paths_{};
  TrackNumbers numbers_;
  std::mutex mutex_;  // of what follows: on_frame may run on a thread of the library
  Frames frames_;
  Report report_;
  Window latency_ms_, publish_ms_;
};

}  // namespace overtake::ros2
