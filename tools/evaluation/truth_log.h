// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// A log with the true positions of the cars: frames, the localisation published so far, and the truth.
#pragma once

#include <limits>
#include <map>
#include <string>
#include <vector>

#include "tools/io/angles.h"
#include "tools/io/ego_file.h"
#include "tools/io/rig.h"
#include "tools/io/sensor_scan.h"

namespace overtake::evaluation {

// Map frame; the middle of a car on the road, the ego's rear axle.
struct CarTruth {
  int32_t car = 0;
  bool is_ego = false;
  double x_m = 0, y_m = 0, z_m = 0, roll_rad = 0, pitch_rad = 0, heading_rad = 0;
  double course_rad = 0, speed_mps = 0, yaw_rate_rps = 0;
  double offset_m = std::numeric_limits<double>::quiet_NaN();  // left of the true centre line; NaN: unknown
};

struct PublishedPose {
  io::EgoRow row;
  int64_t publish_ns = 0;
};

struct LogFrame {
  io::FrameScans scans;
  std::vector<std::vector<uint16_t>> surface;  // of each scan's points; empty if unknown
};

class TruthLog {
 public:
  virtual ~TruthLog() = default;
  virtual const io::Rig& rig() const = 0;
  virtual const std::string& map_text() const = 0;  // "": none
  // What is known of the log. "without": "map", "poses" or both, which the log then does not hold.
  virtual const std::map<std::string, std::string>& about() const = 0;
  // The next frame; truth and poses are known up to two periods after it. False: the end, or damage.
  virtual bool next(LogFrame& out) = 0;
  // After the first frame: the frames that begin earlier than `until_ns` after it may be left out, or be without scans,
  // which saves time. At least `pose_count` poses before `until_ns` stay, or all. Returns the number of frames that the
  // log leaves out.
  virtual int64_t skip_frames(int64_t /*until_ns*/, int64_t /*pose_count*/) { return 0; }
  virtual const std::string& damage() const = 0;  // the reason of an early end; "": none
  virtual double progress() const = 0;            // 0 to 1

  virtual const std::vector<PublishedPose>& poses() const = 0;  // so far, in order
  // Every car at a time. Empty: unknown.
  virtual std::vector<CarTruth> cars_at(int64_t stamp_ns) const = 0;
};

// Whether the log says that it holds no `what`: "map" or "poses".
inline bool lacks(const TruthLog& log, const std::string& what) {
  const auto found = log.about().find("without");
  return found != log.about().end() && found->second.find(what) != std::string::npos;
}

// For the user, of a log that ended early.
inline std::string damage_sentence(const std::string& path, const std::string& damage) {
  return path + ": " + damage + "; results are from the part before it";
}

using io::wrap_angle;

}  // namespace overtake::evaluation
