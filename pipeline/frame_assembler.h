// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// Groups scans into frames by their stamps. One thread (the intake). A frame opens with its first scan and closes when
// every sensor that is not silent is in it, when a scan arrives that does not belong to it, or when the caller names a
// time that is too late for it. Segmentation starts with each scan, not with the frame's last.
//
// A scan older than what was closed, or than the frame that waits, is a frame of its own: the tracker takes it in at
// its place in time. A frame's sequence number is that of its closing.
//
// A scan whose stamp the clock watch holds is kept here, one of each sensor: the next held one replaces it.
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
  uint64_t ticket = 0;  // as of a Scan
  EgoMark ego;
  int32_t reference = OVT_REFERENCE_MAP;
};

// What became of a scan (or of pushed detections) that was offered. kNoSlot: offer it again. kHeld: take_settled() says
// it later.
enum class Taken { kUsed, kLate, kDuplicate, kNoSlot, kHeld };

// What became of scans and pushed detections that were answered kHeld, or kLate before a clock jump.
struct Settled {
  int32_t used = 0, late = 0;
  int32_t late_before_jump = 0;  // of the clock that is now believed: dropped, then
  int32_t external_used = 0, external_dropped = 0;
};

// Ego poses against the sensors' time, frame by frame. Poses that stepped ahead (a run of the buffer) are believed when
// they lead the sensors by no more than poses did before.
struct EgoWatch {
  static constexpr int32_t kLearnFrames = 16;
  static constexpr int32_t kDriftFrames = 8;  // one alone may have been worked on out of turn
  int32_t frames = 0;                         // that taught what is usual
  int64_t usual_lead_ns = 0;  // newest pose minus the sensors' newest stamp: the most of the first frames
  int64_t believed_run = -1;  // runs up to this one are believed
  int32_t ahead = 0;          // frames in a row in which they led by more
  int64_t refused = 0;        // poses that the buffer had refused by the last frame
  int64_t count = 0;          // poses by the last frame
  int32_t named = 0;          // frames until the poses are no suspects any more
};

class FrameAssembler {
 public:
  FrameAssembler(const AssemblerParams& params, FramePool& pool, EgoBuffer& ego, FrameRunner& runner)
      : params_(params),
        pool_(pool),
        ego_(ego),
        runner_(runner),
        clock_(params.sensor_count, params.period_ns, params.tolerance_ns) {}
  // Memory for what is held. False: there is none.
  [[nodiscard]] bool build(const int32_t* point_capacity, int32_t external_capacity, const Allocator& allocator);

  // Swaps the scan's table into the frame's.
  Taken take_scan(int32_t sensor, Scan& scan) noexcept;
  // Pushed detections: a frame of their own, after the open one, which may have the same stamp.
  Taken take_external(ExternalScan& scan) noexcept;
  // False when a frame slot was needed and none is free: try again.
  bool advance(int64_t now_ns) noexcept;
  void flush() noexcept;                                                   // what is still held is refused
  int64_t admitted() const noexcept { return next_sequence_; }             // frames closed so far
  Settled take_settled() noexcept { return std::exchange(settled_, {}); }  // since the last call
  int64_t clock_jumps() const noexcept { return clock_jumps_; }
  int64_t near_ns() const noexcept { return clock_.near_ns(); }

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

  // Pushed detections that wait for the sensors.
  struct HeldExternal {
    ExternalScan scan;
    int64_t base_ns = 0;  // the sensors' newest stamp when it came
  };
  static constexpr int32_t kHeldExternals = 8;

  // A verdict that is not kNoSlot ends it; else the stamp is believed.
  Taken check_stamp(int32_t source, int64_t stamp_ns) noexcept;
  void settle() noexcept;
  // False: something held is good, and there is no slot for it.
  bool place_accepted() noexcept;
  bool place_scan(int32_t sensor, Scan& scan) noexcept;
  bool place_external(ExternalScan& scan) noexcept;
  bool joins(int32_t sensor, int64_t stamp_ns) const noexcept;
  void hold_external(ExternalScan& scan) noexcept;
  void drop_external(int32_t index) noexcept;
  bool settle_externals() noexcept;
  EgoMark watch_ego(const EgoMark& mark, Frame& frame) noexcept;
  Frame* open(int64_t stamp_ns, FrameKind kind) noexcept;
  void put_scan(Frame& frame, int32_t sensor, Scan& scan) noexcept;
  void forget_judged(int32_t source, int64_t stamp_ns) noexcept {
    judged_ = judged_ && (judged_source_ != source || judged_stamp_ns_ != stamp_ns);
  }
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
  Settled settled_;
  int64_t clock_jumps_ = 0;
  Arena held_arena_;
  Scan held_[kMaxSensors];
  uint32_t accepted_ = 0;  // of the held scans, those to place
  HeldExternal held_external_[kHeldExternals];
  int32_t held_externals_ = 0;
  EgoWatch ego_watch_;
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
