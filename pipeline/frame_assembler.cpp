// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
#include "pipeline/frame_assembler.h"

#include <algorithm>
#include <utility>

namespace overtake {
namespace {

// a - b, saturated.
int64_t difference(int64_t a, int64_t b) noexcept {
  int64_t out;
  if (!__builtin_sub_overflow(a, b, &out)) return out;
  return a > b ? INT64_MAX : INT64_MIN;
}

int64_t distance(int64_t a, int64_t b) noexcept { return a > b ? difference(a, b) : difference(b, a); }

}  // namespace

Taken FrameAssembler::take_scan(int32_t sensor, Scan& scan) noexcept {
  const uint32_t bit = 1u << sensor;
  const bool joins =
      open_ && !(open_->sensor_mask & bit) && distance(scan.stamp_ns, open_->first_stamp_ns) <= params_.tolerance_ns;
  if (!joins) {
    if (open_ && scan.stamp_ns <= open_->first_stamp_ns) return Taken::kLate;
    if (is_closed(scan.stamp_ns)) return Taken::kLate;
    if (open_) close();
    if (!open(scan.stamp_ns, FrameKind::kScans)) return Taken::kNoSlot;
    if (!started_) {
      std::fill(std::begin(seen_ns_), std::end(seen_ns_), scan.stamp_ns);
      started_ = true;
    }
  }
  Frame& frame = *open_;
  SensorPart& part = frame.sensors[sensor];
  std::swap(part.scan, scan.table);
  part.present = true;
  part.stamp_ns = scan.stamp_ns;
  part.spans[OVT_STAGE_LOAD] = scan.load;
  frame.pushed_ns = std::max(frame.pushed_ns, scan.load.start_ns + scan.load.duration_ns);
  frame.sensor_mask |= bit;
  frame.first_stamp_ns = std::min(frame.first_stamp_ns, scan.stamp_ns);
  frame.stamp_ns = std::max(frame.stamp_ns, scan.stamp_ns);
  open_ego_count_ = std::max(open_ego_count_, scan.ego_count);
  seen_ns_[sensor] = scan.stamp_ns;
  runner_.start_segment(frame, sensor);
  if (complete()) close();
  return Taken::kUsed;
}

Taken FrameAssembler::take_external(int64_t stamp_ns, int32_t reference, int64_t ego_count,
                                    const ExternalTable& rows) noexcept {
  if (open_ && stamp_ns < open_->stamp_ns) return Taken::kLate;
  if (!open_ && closed_any_ && stamp_ns < closed_stamp_ns_) return Taken::kLate;
  if (open_) close();
  if (!open(stamp_ns, FrameKind::kExternal)) return Taken::kNoSlot;
  ExternalTable& out = open_->external;
  out.count = rows.count;
  const auto copy = [&](const double* from, double* to) { std::copy(from, from + rows.count, to); };
  copy(rows.x_m, out.x_m);
  copy(rows.y_m, out.y_m);
  copy(rows.heading_rad, out.heading_rad);
  copy(rows.var_x, out.var_x);
  copy(rows.var_y, out.var_y);
  copy(rows.cov_xy, out.cov_xy);
  open_->external_reference = reference;
  open_->flags |= OVT_FLAG_EXTERNAL;
  open_ego_count_ = ego_count;
  close();
  return Taken::kUsed;
}

bool FrameAssembler::advance(int64_t now_ns) noexcept {
  if (open_) {
    if (difference(now_ns, open_->first_stamp_ns) >= params_.wait_ns) close();
    return true;
  }
  if (!closed_any_ || difference(now_ns, closed_stamp_ns_) < params_.predict_after_ns) return true;
  if (!open(now_ns, FrameKind::kPrediction)) return false;
  open_ego_count_ = ego_.count();
  close();
  return true;
}

bool FrameAssembler::open(int64_t stamp_ns, FrameKind kind) noexcept {
  Frame* frame = pool_.acquire();
  if (!frame) return false;
  frame->sequence = next_sequence_++;
  frame->kind = kind;
  frame->first_stamp_ns = frame->stamp_ns = stamp_ns;
  frame->pending.store(1, std::memory_order_relaxed);
  open_ego_count_ = 0;
  open_ = frame;
  return true;
}

void FrameAssembler::close() noexcept {
  if (!open_) return;
  Frame& frame = *open_;
  open_ = nullptr;
  // A prediction names a time at which nothing was measured: scans of that time may still come.
  if (frame.kind != FrameKind::kPrediction) {
    closed_any_ = true;
    closed_stamp_ns_ = frame.stamp_ns;
    closed_kind_ = frame.kind;
  }
  ego_.copy_window(open_ego_count_, frame.first_stamp_ns, frame.stamp_ns, frame.ego);
  if (frame.kind == FrameKind::kScans) {
    for (int32_t s = 0; s < params_.sensor_count; ++s) {
      if (!(frame.sensor_mask >> s & 1u)) frame.flags |= OVT_FLAG_SENSOR_MISSING;
      if (difference(frame.stamp_ns, seen_ns_[s]) > params_.wait_ns) frame.flags |= OVT_FLAG_SENSOR_STALE;
    }
  }
  runner_.close(frame);
}

// A frame of scans has taken the stamp; pushed detections of the same stamp leave room for the scans.
bool FrameAssembler::is_closed(int64_t stamp_ns) const noexcept {
  if (!closed_any_) return false;
  return stamp_ns < closed_stamp_ns_ || (stamp_ns == closed_stamp_ns_ && closed_kind_ == FrameKind::kScans);
}

// Every sensor is in it, but for those silent for more than 1.5 periods.
bool FrameAssembler::complete() const noexcept {
  for (int32_t s = 0; s < params_.sensor_count; ++s)
    if (!(open_->sensor_mask >> s & 1u) && difference(open_->first_stamp_ns, seen_ns_[s]) <= params_.wait_ns)
      return false;
  return true;
}

}  // namespace overtake
