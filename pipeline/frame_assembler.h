// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// Groups scans into frames by their stamps. One thread (the intake). A frame opens with its first scan and closes when
// every sensor that is not silent is in it, when a scan arrives that does not belong to it, or when the caller names a
// time that is too late for it. Segmentation starts with each scan, not with the frame's last.
#pragma once

#include "pipeline/ego_buffer.h"
#include "pipeline/frame_pool.h"
#include "pipeline/mailbox.h"

namespace overtake {

// What runs the stages: inline, or the graph.
class FrameRunner {
 public:
  virtual ~FrameRunner() = default;
  virtual void start_segment(Frame& frame, int32_t sensor) = 0;   // sensors[sensor].scan is ready
  virtual void close(Frame& frame) = 0;                           // nothing more comes for it
};

struct AssemblerParams {
  int32_t sensor_count = 0;
  int64_t period_ns = 50'000'000, tolerance_ns = 25'000'000;
  int64_t wait_ns = 75'000'000;        // after a frame's first stamp; older, ovt_advance closes it
  int64_t predict_after_ns = 75'000'000;
};

// What became of a scan that was offered.
enum class Taken { kUsed, kLate, kNoSlot };

class FrameAssembler {
 public:
  FrameAssembler(const AssemblerParams& params, FramePool& pool, EgoBuffer& ego, FrameRunner& runner)
      : params_(params), pool_(pool), ego_(ego), runner_(runner) {}

  // Swaps the scan's table into the frame's.
  Taken take_scan(int32_t sensor, Scan& scan) noexcept;
  // Pushed detections: a frame of their own, after the open one, which may have the same stamp.
  Taken take_external(int64_t stamp_ns, int32_t reference, int64_t ego_count, const ExternalTable& rows) noexcept;
  // False when a frame slot was needed and none is free: try again.
  bool advance(int64_t now_ns) noexcept;
  void flush() noexcept { close(); }
  int64_t admitted() const noexcept { return next_sequence_; }   // frames so far

 private:
  bool open(int64_t stamp_ns, FrameKind kind) noexcept;
  void close() noexcept;
  bool complete() const noexcept;
  bool is_closed(int64_t stamp_ns) const noexcept;

  AssemblerParams params_;
  FramePool& pool_;
  EgoBuffer& ego_;
  FrameRunner& runner_;
  Frame* open_ = nullptr;
  int64_t open_ego_count_ = 0;
  int64_t next_sequence_ = 0;
  bool started_ = false;                               // a scan was taken
  bool closed_any_ = false;
  int64_t closed_stamp_ns_ = 0;                        // last stamp of the last closed frame, predictions apart
  FrameKind closed_kind_ = FrameKind::kScans;
  int64_t seen_ns_[kMaxSensors] = {};                  // last scan of each sensor; before its first: the first frame's
};

}  // namespace overtake
