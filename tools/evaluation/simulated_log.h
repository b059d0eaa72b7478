// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// A log of `overtake simulate` (MCAP) with its truth, read once: each frame with the surface of every point, the
// localisation published so far, and the true position of every car. skip_frames goes on by the file's index.
#pragma once

#include <deque>
#include <map>
#include <string>
#include <vector>

#include "tools/evaluation/truth_log.h"
#include "tools/io/mcap_reader.h"

namespace overtake::evaluation {

struct TruthFrame {
  int64_t stamp_ns = 0, frame = -1;
  std::vector<CarTruth> cars;  // by number
};

class SimulatedLog : public TruthLog {
 public:
  // Throws io::Error for a file that is not MCAP or not from overtake simulate, or has no rig or map (a log that says
  // it has no map, see TruthLog::about, needs none).
  explicit SimulatedLog(const std::string& path);

  const io::Rig& rig() const override { return rig_; }
  const std::string& map_text() const override { return map_text_; }
  const std::map<std::string, std::string>& about() const override { return about_; }  // scenario, seed, ego
  // The next frame; truth and poses are known up to two periods after it. False: the end, or damage.
  bool next(LogFrame& out) override;
  int64_t skip_frames(int64_t until_ns, int64_t pose_count) override;
  const std::string& damage() const override { return reader_.damage(); }
  double progress() const override { return double(reader_.position()) / double(reader_.file_bytes()); }

  const std::vector<PublishedPose>& poses() const override { return poses_; }  // so far, in order
  // Every car at a time (linear between frames, angles the shorter way; constant for 0.1 s beyond the ends). Empty:
  // unknown.
  std::vector<CarTruth> cars_at(int64_t stamp_ns) const override;

 private:
  bool read_message();
  void take_message(const std::string& topic, const io::McapMessage& message);
  void start();
  void forget();

  io::McapReader reader_;
  io::Rig rig_;
  std::string map_text_;
  std::map<std::string, std::string> about_;
  std::vector<PublishedPose> poses_;
  std::vector<TruthFrame> truth_;
  std::map<int64_t, CarTruth> ego_truth_;
  struct Half {
    io::SensorScan scan;
    std::vector<uint16_t> surface;
    bool has_scan = false, has_surface = false;
  };
  std::map<std::pair<int64_t, int32_t>, Half> waiting_;  // by stamp and sensor
  int64_t newest_ns_ = INT64_MIN, frame_ = 0, first_scan_ns_ = INT64_MIN, skip_ns_ = INT64_MIN;
  bool ended_ = false;
};

}  // namespace overtake::evaluation
