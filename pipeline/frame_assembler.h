// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// Groups scans into frames by their stamps. One thread (the intake). A frame opens with its first scan and closes when
// every sensor that is not silent is in it, when a scan arrives that does not belong to it, or when the caller names a
// time that is too late for it. Segmentation starts with each scan, not with the frame's last.
//
// A scan older than what was closed, or than the frame that waits, is a frame of its own: the tracker takes it in at
// its place in time. A frame's sequence number is that of its closing.
#pragma once

#include <algorithm>
#include <functional>
#include <utility>

#include "pipeline/clock_watch.h"
#include "pipeline/ego_buffer.h"
#include "pipeline/frame_pool.h"
#include "pipeline/mailbox.h"

namespace overtake {

// What runs the stages: inline, or the graph.
class FrameRunner {
 public:
  virtual ~FrameRunner() = default;
  // Runs the intake's loop, which is what calls the other two, where that must be.
  virtual void host(const std::function<void()>& loop) { loop(); }
  // In that loop, before the first frame: may take memory and threads.
  virtual void warm_up() {}
  virtual int32_t workers() const noexcept { return 1; }         // that came in the warm-up
  virtual void start_segment(Frame& frame, int32_t sensor) = 0;  // sensors[sensor].scan is ready
  virtual void close(Frame& frame) = 0;                          // nothing more comes for it
};

struct AssemblerParams {
  int32_t sensor_count = 0;
  int64_t period_ns = 50'000'000, tolerance_ns = 25'000'000;
  int64_t wait_ns = 75'000'000;  // after a frame's first stamp; older, ovt_advance closes it
  int64_t predict_after_ns = 75'000'000;
};

// Pushed detections on their way to a frame.
struct ExternalScan {
  ExternalTable table;
  int64_t stamp_ns = 0;
  EgoMark ego;
  int32_t reference = OVT_REFERENCE_MAP;
};

// What became of a scan (or of pushed detections) that was offered. kNoSlot: offer it again.
enum class Taken { kUsed, kLate, kDropped, kDuplicate, kNoSlot };

class FrameAssembler {
 public:
  FrameAssembler(const AssemblerParams& params, FramePool& pool, EgoBuffer& ego, FrameRunner& runner)
      : params_(params), pool_(pool), ego_(ego), runner_(runner), clock_(params.period_ns) {}

  // Swaps the scan's table into the frame's.
  Taken take_scan(int32_t sensor, Scan& scan) noexcept;
  // Pushed detections: a frame of their own, after the open one, which may have the same stamp.
  Taken take_external(ExternalScan& scan) noexcept;
  // False when a frame slot was needed and none is free: try again.
  bool advance(int64_t now_ns) noexcept;
  void flush() noexcept { close_open(); }
  int64_t admitted() const noexcept { return next_sequence_; }  // frames closed so far
  // Scans that were answered kLate, and turned out to be of the clock that is now believed: dropped, then. Since the
  // last call.
  int32_t take_late_before_jump() noexcept { return std::exchange(late_before_jump_, 0); }
  int64_t clock_jumps() const noexcept { return clock_jumps_; }

 private:
  // Stamps of a source that were used, to know one that comes again.
  struct Recent {
    static constexpr uint32_t kCapacity = 32;
    int64_t stamp_ns[kCapacity] = {};
    uint32_t count = 0;
    bool holds(int64_t stamp) const noexcept {
      return std::find(stamp_ns, stamp_ns + std::min(count, kCapacity), stamp) != stamp_ns + std::min(count, kCapacity);
    }
    void add(int64_t stamp) noexcept { stamp_ns[count++ % kCapacity] = stamp; }
  };

  // A verdict that is not kNoSlot ends it; else the stamp is believed.
  Taken check_stamp(int32_t source, int64_t stamp_ns) noexcept;
  Frame* open(int64_t stamp_ns, FrameKind kind) noexcept;
  void put_scan(Frame& frame, int32_t sensor, Scan& scan) noexcept;
  void close(Frame& frame, const EgoMark& mark) noexcept;
  void close_open() noexcept;
  bool complete() const noexcept;
  bool belongs_before(int64_t stamp_ns) const noexcept;

  AssemblerParams params_;
  FramePool& pool_;
  EgoBuffer& ego_;
  FrameRunner& runner_;
  ClockWatch clock_;
  Recent recent_[ClockWatch::kSources];
  Frame* open_ = nullptr;
  EgoMark open_mark_;
  int64_t next_sequence_ = 0;
  bool started_ = false;       // a scan was taken
  bool restart_next_ = false;  // the next frame is the first of another clock
  int32_t late_before_jump_ = 0;
  int64_t clock_jumps_ = 0;
  bool closed_any_ = false;
  int64_t closed_stamp_ns_ = 0;  // newest stamp of the closed frames, predictions apart
  FrameKind closed_kind_ = FrameKind::kScans;
  int64_t seen_ns_[kMaxSensors] = {};  // newest scan of each sensor; before its first: the first frame's
  // A stamp is judged once, also when no slot was free and the scan is offered again.
  bool judged_ = false;
  int32_t judged_source_ = 0;
  int64_t judged_stamp_ns_ = 0;
};

}  // namespace overtake
