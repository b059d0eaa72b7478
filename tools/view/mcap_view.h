// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// The pipeline's input and results as messages for Foxglove and for overtake's own pages (protobuf messages of
// Foxglove's schemas; the numbers as JSON with a JSON Schema). Sinks (view_sink.h) take the messages; one that nobody
// wants is not encoded. README.md lists the topics and describes the log.
#pragma once

#include <map>
#include <optional>
#include <string>
#include <vector>

#include "pipeline/overtake.h"
#include "tools/client/config.h"
#include "tools/io/map_file.h"
#include "tools/io/sensor_scan.h"
#include "tools/view/frames_record.h"
#include "tools/view/mcap_file.h"
#include "tools/view/view_sink.h"

namespace overtake::cli {

// What a recording knows of a frame besides its scans.
struct ViewFrame {
  int64_t number = 0;  // in the recording
  std::optional<io::Box> opponent;
  std::vector<io::KnownCar> cars;
};

class McapView {
 public:
  // Reads the config's map file. The sinks must outlive the view. Throws io::Error.
  McapView(const Config& config, std::vector<ViewSink*> sinks);
  // Adds the reader's frame.
  void add(ovt_reader* reader, const ViewFrame& frame);
  // The detector's counters. Call it between frames.
  void add_counters(int64_t stamp_ns, const ovt_stats& stats);
  // Writes the attachments and the metadata of a complete log and closes it. partial: the reason why the file ends
  // early; "" if it is complete.
  void close(McapFile& file, const std::string& partial = "") const;

 private:
  // The channel of a topic if any sink wants its next message; 0: none does.
  uint16_t wanted(const std::string& topic, const std::string& schema, ViewKind kind = ViewKind::kNumbers,
                  bool once = false);
  void write(uint16_t channel, int64_t stamp_ns, const std::string& data);
  void add_transforms(const ovt_frame_info& info);
  void add_clouds(ovt_reader* reader, const ovt_frame_info& info);
  void add_images(ovt_reader* reader, int32_t sensor, int64_t stamp_ns);
  void add_detections(const ovt_frame_info& info, const ovt_detections& detections);
  void add_tracks(const ovt_frame_info& info, const ovt_tracks& tracks);
  void add_map(int64_t stamp_ns);
  void add_truth(const ovt_frame_info& info, const ViewFrame& frame);

  const Config config_;
  std::vector<ViewSink*> sinks_;
  std::map<std::string, uint16_t> channels_;
  FramesRecord frames_;  // empty without a sink that keeps it: a live run has no end
  bool keeps_frames_;
  io::MapData map_;
  int64_t last_ns_ = 0;
};

}  // namespace overtake::cli
