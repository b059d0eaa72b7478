// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// Writes the pipeline's input and results as an MCAP file for Foxglove (protobuf messages of Foxglove's schemas; the
// numbers as JSON with a JSON Schema):
//
//   /tf                      FrameTransform   map to vehicle (if the ego pose is known), vehicle to each sensor
//   /SENSOR/points           PointCloud       x y z intensity layer, label, cluster, reason; sensor frame
//   /SENSOR/image/NAME       RawImage         range, angle_smooth, height, range_repaired (32FC1), nonground (mono8),
//                                             labels (rgb8); those that the preset computes
//   /detections, /tracks     SceneUpdate      candidates with both headings; tracks with covariance and predicted path
//   /map                     SceneUpdate      centre line and bounds, once
//   /detections/numbers, /tracks/numbers, /times, /counters       JSON: all columns; ns per stage; ovt_stats
//
// Attachment config.toml holds the effective configuration.
#pragma once

#include <map>
#include <string>

#include "pipeline/overtake.h"
#include "tools/client/config.h"
#include "tools/io/mcap_writer.h"

namespace overtake::cli {

class McapView {
 public:
  // Reads the config's map file. Throws io::Error.
  McapView(const std::string& path, const Config& config);
  // Adds the reader's frame, and the detector's counters at that time.
  void add(ovt_reader* reader);
  void add_counters(int64_t stamp_ns, const ovt_stats& stats);
  // partial: the reason why the file ends early; "" if it is complete.
  void close(const std::string& partial = "");

 private:
  uint16_t channel(const std::string& topic, const std::string& schema);
  void add_transforms(const ovt_frame_info& info);
  void add_clouds(ovt_reader* reader, const ovt_frame_info& info);
  void add_images(ovt_reader* reader, int32_t sensor, int64_t stamp_ns);
  void add_detections(const ovt_frame_info& info, const ovt_detections& detections);
  void add_tracks(const ovt_frame_info& info, const ovt_tracks& tracks);
  void add_map(int64_t stamp_ns);
  void add_times(ovt_reader* reader, const ovt_frame_info& info);

  const Config config_;
  io::McapWriter log_;
  std::map<std::string, uint16_t> channels_;
  bool map_written_ = false;
  int64_t last_ns_ = 0;
};

}  // namespace overtake::cli
