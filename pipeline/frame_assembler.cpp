// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
#include "pipeline/frame_assembler.h"

#include <algorithm>
#include <utility>

namespace overtake {
namespace {

int64_t distance_ns(int64_t a, int64_t b) noexcept { return a > b ? difference_ns(a, b) : difference_ns(b, a); }

}  // namespace

Taken FrameAssembler::check_stamp(int32_t source, int64_t stamp_ns) noexcept {
  if (judged_ && judged_source_ == source && judged_stamp_ns_ == stamp_ns) return Taken::kNoSlot;
  if (recent_[source].holds(stamp_ns)) return Taken::kDuplicate;
  switch (clock_.judge(source, stamp_ns)) {
    case Believe::kBehind: return Taken::kLate;
    case Believe::kAhead: return Taken::kDropped;
    case Believe::kGood: break;
    case Believe::kJump:
      close_open();
      for (Recent& recent : recent_) recent = {};
      std::fill(std::begin(seen_ns_), std::end(seen_ns_), stamp_ns);
      late_before_jump_ += clock_.behind_before_jump();
      ++clock_jumps_;
      closed_any_ = false;
      restart_next_ = true;
  }
  judged_ = true;
  judged_source_ = source;
  judged_stamp_ns_ = stamp_ns;
  return Taken::kNoSlot;
}

Taken FrameAssembler::take_scan(int32_t sensor, Scan& scan) noexcept {
  if (const Taken verdict = check_stamp(sensor, scan.stamp_ns); verdict != Taken::kNoSlot) return verdict;
  const uint32_t bit = 1u << sensor;
  const bool joins =
      open_ && !(open_->sensor_mask & bit) && distance_ns(scan.stamp_ns, open_->first_stamp_ns) <= params_.tolerance_ns;
  if (!joins) {
    if (belongs_before(scan.stamp_ns)) {
      Frame* frame = open(scan.stamp_ns, FrameKind::kScans);
      if (!frame) return Taken::kNoSlot;
      const EgoMark mark = scan.ego;
      put_scan(*frame, sensor, scan);
      close(*frame, mark);
      return Taken::kUsed;
    }
    close_open();
    open_ = open(scan.stamp_ns, FrameKind::kScans);
    if (!open_) return Taken::kNoSlot;
    open_mark_ = scan.ego;
    if (!started_) std::fill(std::begin(seen_ns_), std::end(seen_ns_), scan.stamp_ns);
    started_ = true;
  }
  if (scan.ego.count > open_mark_.count) open_mark_ = scan.ego;
  put_scan(*open_, sensor, scan);
  if (complete()) close_open();
  return Taken::kUsed;
}

Taken FrameAssembler::take_external(ExternalScan& scan) noexcept {
  const int32_t source = ClockWatch::kExternal;
  if (const Taken verdict = check_stamp(source, scan.stamp_ns); verdict != Taken::kNoSlot) return verdict;
  if (open_ && scan.stamp_ns >= open_->stamp_ns) close_open();
  if (!started_ && !closed_any_) std::fill(std::begin(seen_ns_), std::end(seen_ns_), scan.stamp_ns);
  Frame* frame = open(scan.stamp_ns, FrameKind::kExternal);
  if (!frame) return Taken::kNoSlot;
  judged_ = false;
  recent_[source].add(scan.stamp_ns);
  std::swap(frame->external, scan.table);
  frame->external_reference = scan.reference;
  frame->flags |= OVT_FLAG_EXTERNAL;
  close(*frame, scan.ego);
  return Taken::kUsed;
}

bool FrameAssembler::advance(int64_t now_ns) noexcept {
  if (open_) {
    if (difference_ns(now_ns, open_->first_stamp_ns) >= params_.wait_ns) close_open();
    return true;
  }
  if (!closed_any_ || difference_ns(now_ns, closed_stamp_ns_) < params_.predict_after_ns) return true;
  Frame* frame = open(now_ns, FrameKind::kPrediction);
  if (!frame) return false;
  close(*frame, ego_.mark());
  return true;
}

Frame* FrameAssembler::open(int64_t stamp_ns, FrameKind kind) noexcept {
  Frame* frame = pool_.acquire();
  if (!frame) return nullptr;
  frame->kind = kind;
  frame->first_stamp_ns = frame->stamp_ns = stamp_ns;
  frame->pending.store(1, std::memory_order_relaxed);
  return frame;
}

void FrameAssembler::put_scan(Frame& frame, int32_t sensor, Scan& scan) noexcept {
  judged_ = false;
  recent_[sensor].add(scan.stamp_ns);
  SensorPart& part = frame.sensors[sensor];
  std::swap(part.scan, scan.table);
  part.present = true;
  part.stamp_ns = scan.stamp_ns;
  part.spans[OVT_STAGE_LOAD] = scan.load;
  frame.pushed_ns = std::max(frame.pushed_ns, scan.load.start_ns + scan.load.duration_ns);
  frame.sensor_mask |= 1u << sensor;
  frame.first_stamp_ns = std::min(frame.first_stamp_ns, scan.stamp_ns);
  frame.stamp_ns = std::max(frame.stamp_ns, scan.stamp_ns);
  seen_ns_[sensor] = std::max(seen_ns_[sensor], scan.stamp_ns);
  runner_.start_segment(frame, sensor);
}

void FrameAssembler::close_open() noexcept {
  if (!open_) return;
  close(*std::exchange(open_, nullptr), open_mark_);
}

void FrameAssembler::close(Frame& frame, const EgoMark& mark) noexcept {
  frame.sequence = next_sequence_++;
  if (std::exchange(restart_next_, false)) {
    frame.restart = true;
    frame.flags |= OVT_FLAG_CLOCK_JUMP;
  }
  // A prediction names a time at which nothing was measured: scans of that time may still come.
  if (frame.kind != FrameKind::kPrediction) {
    if (closed_any_ && frame.stamp_ns < closed_stamp_ns_) {
      frame.flags |= OVT_FLAG_OUT_OF_SEQUENCE;
    } else {
      closed_any_ = true;
      closed_stamp_ns_ = frame.stamp_ns;
      closed_kind_ = frame.kind;
    }
  }
  ego_.copy_window(mark, frame.first_stamp_ns, frame.stamp_ns, frame.ego);
  if (frame.kind == FrameKind::kPrediction) frame.flags |= OVT_FLAG_PREDICTION | OVT_FLAG_NO_DATA;
  for (int32_t s = 0; s < params_.sensor_count; ++s) {
    if (frame.kind != FrameKind::kExternal && !(frame.sensor_mask >> s & 1u)) frame.flags |= OVT_FLAG_SENSOR_MISSING;
    if (difference_ns(frame.stamp_ns, seen_ns_[s]) > params_.wait_ns) frame.stale_mask |= 1u << s;
  }
  if (frame.stale_mask) frame.flags |= OVT_FLAG_SENSOR_STALE;
  frame.closed_ns.store(steady_now_ns(), std::memory_order_relaxed);
  runner_.close(frame);
}

// The open frame has begun later, or a frame of scans has taken the stamp; pushed detections of the same stamp leave
// room for the scans.
bool FrameAssembler::belongs_before(int64_t stamp_ns) const noexcept {
  if (open_ && stamp_ns <= open_->first_stamp_ns) return true;
  if (!closed_any_) return false;
  return stamp_ns < closed_stamp_ns_ || (stamp_ns == closed_stamp_ns_ && closed_kind_ == FrameKind::kScans);
}

// Every sensor is in it, but for those silent for more than 1.5 periods.
bool FrameAssembler::complete() const noexcept {
  for (int32_t s = 0; s < params_.sensor_count; ++s)
    if (!(open_->sensor_mask >> s & 1u) && difference_ns(open_->first_stamp_ns, seen_ns_[s]) <= params_.wait_ns)
      return false;
  return true;
}

}  // namespace overtake
