// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// A recording with topics that contains the odometry of the ego and of an opponent: the truth is their odometry
// (pose_history.h). The surface of each point is unknown. The opponent's position is taken as its middle.
#pragma once

#include <memory>
#include <string>

#include "tools/evaluation/pose_history.h"
#include "tools/io/scan_stream.h"

namespace overtake::evaluation {

class OdometryLog : public TruthLog {
 public:
  // `map_file`: a centre line, or an MCAP log that contains one; "" none. Throws io::Error for a recording without
  // topics, without scans, or without odometry of ego or opponent, and for a map of two bounds.
  OdometryLog(const std::string& path, const io::Rig& rig, const std::string& map_file);

  const io::Rig& rig() const override { return rig_; }
  const std::string& map_text() const override { return map_text_; }
  const std::map<std::string, std::string>& about() const override { return about_; }
  bool next(LogFrame& out) override;
  const std::string& damage() const override { return stream_->damage(); }
  double progress() const override { return stream_->progress(); }
  const std::vector<PublishedPose>& poses() const override { return poses_; }
  std::vector<CarTruth> cars_at(int64_t stamp_ns) const override;

 private:
  const std::string path_;
  const io::Rig rig_;
  std::string map_text_;
  std::map<std::string, std::string> about_;
  PoseHistory ego_, opponent_;
  std::vector<PublishedPose> poses_;
  std::unique_ptr<io::ScanStream> stream_;
};

}  // namespace overtake::evaluation
