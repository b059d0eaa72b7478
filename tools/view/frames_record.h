// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// One record of all frames of a run: stamps, times of the stages, counts, flags. It is the attachment `frames` of a
// view's log, so that a reader draws the whole run without reading its messages. README.md describes its keys.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "pipeline/overtake.h"
#include "tools/io/rig.h"

namespace overtake::cli {

class FramesRecord {
 public:
  explicit FramesRecord(const io::Rig& rig);
  // number: of the frame in the recording, as in detections.csv.
  void add(ovt_reader* reader, int64_t number, const ovt_frame_info& info, const ovt_tracks& tracks);
  // JSON: columns, in the order of the stamps.
  std::string format() const;

 private:
  struct Row {
    int64_t stamp_ns, number, latency_ns;
    int32_t points, detections, tracks, confirmed, lost_scans;
    uint32_t flags;
    std::size_t times;  // index of its first time
  };
  std::size_t stage_count() const { return (sensors_.size() + 1) * OVT_STAGE_COUNT; }

  std::vector<std::string> sensors_;
  double period_s_;
  std::vector<Row> rows_;
  std::vector<float> times_us_;  // per row: those of the whole frame, then those of each sensor; NaN: did not run
};

}  // namespace overtake::cli
