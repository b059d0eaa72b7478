// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
#include "pipeline/frame_assembler.h"

#include <algorithm>
#include <bit>
#include <utility>

#include "pipeline/early_segment.h"
#include "pipeline/scan_builder.h"

namespace overtake {
namespace {

// A sensor slower than this counts as silent in between: nobody would notice one that loses most of its scans.
constexpr int64_t kMostPeriods = 4;

// A hash of at most `most` points of a scan, spread over it; 0 where fewer than half of them are returns.
uint64_t hash_points(const ScanTable& scan, int32_t most) noexcept {
  uint64_t hash = 14695981039346656037u;  // FNV-1a
  const int32_t count = std::min(most, scan.count);
  int32_t returns = 0;
  for (int32_t i = 0; i < count; ++i) {
    const int32_t k = int32_t(int64_t(i) * scan.count / count);
    const float x = scan.x_m[k], y = scan.y_m[k], z = scan.z_m[k];
    returns += x * x + y * y + z * z > 0.0f;  // not when it is NaN
    for (const float v : {x, y, z}) hash = (hash ^ std::bit_cast<uint32_t>(v)) * 1099511628211u;
  }
  hash = (hash ^ uint32_t(scan.count)) * 1099511628211u;
  return count > 0 && 2 * returns >= count ? hash | 1u : 0u;
}

}  // namespace

bool FrameAssembler::build(const int32_t* point_capacity, int32_t external_capacity, const Allocator& allocator) {
  return held_arena_.build(allocator, [&](Carver& carver) {
    for (int32_t s = 0; s < params_.sensor_count; ++s)
      carve_table(carver, held_[s].table, scan_rows(point_capacity[s]));
    for (HeldExternal& held : held_external_) carve_table(carver, held.scan.table, external_capacity);
  });
}

IntakeResult FrameAssembler::check_stamp(int32_t source, int64_t stamp_ns) noexcept {
  if (classified_ == Source{source, stamp_ns}) return IntakeResult::kNoSlot;
  // A clock that goes back by whole periods repeats stamps that were used. The clock watch must see the late ones of
  // them to accept the new time; only the sensor's very last stamp is a duplicate at any age.
  const bool late = clock_.any() && difference_ns(clock_.newest_ns(), stamp_ns) > kLateNs;
  if (late ? recent_[source].is_last(stamp_ns) : recent_[source].holds(stamp_ns)) return IntakeResult::kDuplicate;
  const StampVerdict verdict = clock_.classify(source, stamp_ns);
  if (verdict == StampVerdict::kJump) {
    close_open();
    for (Recent& recent : recent_) recent = {};
    for (Print& print : print_) print = {};
    std::fill(std::begin(seen_ns_), std::end(seen_ns_), stamp_ns);
    for (SensorRhythm& rhythm : rhythm_) rhythm.forget_last();
    settled_.late_before_jump += clock_.late_before_jump();
    ++clock_jumps_;
    closed_ns_.reset(), closed_scans_ns_.reset(), opens_next_.reset();
    // Held rows of the old clock become late soon; those of the new one become good.
    for (int32_t i = 0; i < held_externals_; ++i) held_external_[i].base_ns = stamp_ns;
    restart_next_ = true;
    if (profile_) profile_->restart();
    ego_watch_ = {.refused = ego_watch_.refused};
  }
  settle();
  if (verdict == StampVerdict::kHold) return IntakeResult::kHeld;
  if (verdict == StampVerdict::kLate) return IntakeResult::kLate;
  classified_ = {source, stamp_ns};
  return IntakeResult::kNoSlot;
}

IntakeResult FrameAssembler::take_scan(int32_t sensor, Scan& scan) noexcept {
  if (!place_accepted()) return IntakeResult::kNoSlot;
  // A held scan needs a slot soon. Without a free slot it stays in the mailbox, where a newer one may replace it.
  if (clock_.any() && scan.stamp_ns > clock_.newest_ns() && !joins(sensor, scan.stamp_ns) && !pool_.has_free())
    return IntakeResult::kNoSlot;
  const IntakeResult verdict = check_stamp(sensor, scan.stamp_ns);
  if (verdict == IntakeResult::kHeld) std::swap(held_[sensor], scan);
  if (verdict != IntakeResult::kNoSlot) return verdict;
  if (params_.drops_repeats && is_repeat(sensor, scan)) {
    forget_classified({sensor, scan.stamp_ns});
    recent_[sensor].add(scan.stamp_ns, clock_.newest_ns());
    return IntakeResult::kRepeat;
  }
  return place_accepted() && place_scan(sensor, scan) ? IntakeResult::kUsed : IntakeResult::kNoSlot;
}

// A driver that hangs may publish its last points again, with new stamps. A vehicle that moves sees no scan twice. Some
// points are the same on a level road without noise, so then all points are compared: from the second repeat on.
bool FrameAssembler::is_repeat(int32_t sensor, const Scan& scan) noexcept {
  constexpr int32_t kSome = 64;
  Print& print = print_[sensor];
  if (print.stamp_ns == scan.stamp_ns) return false;  // again, as no slot was free
  print.stamp_ns = scan.stamp_ns;
  const uint64_t some = hash_points(scan.table, kSome), before = std::exchange(print.some, some);
  if (some != before || some == 0) {
    print.changes = print.changes || (some != 0 && before != 0);
    print.all = 0;
    return false;
  }
  if (!print.changes) return false;
  const uint64_t all = hash_points(scan.table, scan.table.count);
  if (std::exchange(print.all, all) != all) return false;
  EgoPose pose;
  return scan.ego.count > ego_.oldest_safe(scan.ego) && ego_.read(scan.ego.count - 1, pose) &&
         distance_ns(pose.stamp_ns, scan.stamp_ns) <= kEgoLostNs && is_moving(pose);
}

IntakeResult FrameAssembler::take_external(ExternalScan& scan) noexcept {
  if (!place_accepted()) return IntakeResult::kNoSlot;
  const IntakeResult verdict = check_stamp(ClockWatch::kExternal, scan.stamp_ns);
  if (verdict == IntakeResult::kHeld) hold_external(scan);
  if (verdict != IntakeResult::kNoSlot) return verdict;
  return place_accepted() && place_external(scan) ? IntakeResult::kUsed : IntakeResult::kNoSlot;
}

// Collects the clock watch's results for held scans.
void FrameAssembler::settle() noexcept {
  settled_.late += std::popcount(clock_.take_rejected());
  accepted_ |= clock_.take_accepted();
}

// Places accepted scans in the order of their stamps.
bool FrameAssembler::place_accepted() noexcept {
  while (accepted_) {
    int32_t first = -1;
    for (int32_t s = 0; s < params_.sensor_count; ++s)
      if ((accepted_ >> s & 1u) && (first < 0 || held_[s].stamp_ns < held_[first].stamp_ns)) first = s;
    if (!place_scan(first, held_[first])) return false;
    accepted_ &= ~(1u << first);
    ++settled_.used;
  }
  return settle_externals();
}

bool FrameAssembler::joins(int32_t sensor, int64_t stamp_ns) const noexcept {
  return open_ && !(open_->sensor_mask >> sensor & 1u) &&
         distance_ns(stamp_ns, open_->first_stamp_ns) <= params_.tolerance_ns;
}

bool FrameAssembler::place_scan(int32_t sensor, Scan& scan) noexcept {
  if (!joins(sensor, scan.stamp_ns)) {
    const bool was_placed = opens_next_ == Source{sensor, scan.stamp_ns};
    if (!was_placed && belongs_before(scan.stamp_ns)) {
      Frame* frame = open(scan.stamp_ns, FrameKind::kScans);
      if (!frame) return false;
      const EgoRange range = scan.ego;
      put_scan(*frame, sensor, scan);
      close(*frame, range);
      return true;
    }
    opens_next_ = {sensor, scan.stamp_ns};  // also when no slot is free and the scan is offered again
    close_open();
    open_ = open(scan.stamp_ns, FrameKind::kScans);
    if (!open_) return false;
    opens_next_.reset();
    open_range_ = scan.ego;
    if (!started_) std::fill(std::begin(seen_ns_), std::end(seen_ns_), scan.stamp_ns);
    started_ = true;
  }
  if (scan.ego.count > open_range_.count) open_range_ = scan.ego;
  put_scan(*open_, sensor, scan);
  if (complete()) close_open();
  return true;
}

bool FrameAssembler::place_external(ExternalScan& scan) noexcept {
  if (open_ && difference_ns(scan.stamp_ns, open_->first_stamp_ns) >= 2 * params_.wait_ns) close_open();
  if (!started_ && !closed_ns_) std::fill(std::begin(seen_ns_), std::end(seen_ns_), scan.stamp_ns);
  Frame* frame = open(scan.stamp_ns, FrameKind::kExternal);
  if (!frame) return false;
  forget_classified({ClockWatch::kExternal, scan.stamp_ns});
  recent_[ClockWatch::kExternal].add(scan.stamp_ns, clock_.newest_ns());
  std::swap(frame->external, scan.table);
  frame->external_reference = scan.reference;
  frame->flags |= OVT_FLAG_EXTERNAL;
  close(*frame, scan.ego);
  return true;
}

void FrameAssembler::hold_external(ExternalScan& scan) noexcept {
  if (held_externals_ == kHeldExternals) drop_external(0);
  HeldExternal& held = held_external_[held_externals_++];
  std::swap(held.scan, scan);
  held.base_ns = clock_.newest_ns();
}

void FrameAssembler::drop_external(int32_t index) noexcept {
  clock_.note_suspect(ClockWatch::kExternal);
  ++settled_.external_dropped;
  std::rotate(held_external_ + index, held_external_ + index + 1, held_external_ + held_externals_);
  --held_externals_;
}

bool FrameAssembler::settle_externals() noexcept {
  for (int32_t i = 0; i < held_externals_;) {
    ExternalScan& scan = held_external_[i].scan;
    const StampVerdict verdict = clock_.classify_held(scan.stamp_ns, held_external_[i].base_ns);
    if (verdict == StampVerdict::kHold) {
      ++i;
    } else if (verdict == StampVerdict::kLate) {
      drop_external(i);
    } else {
      if (!place_external(scan)) return false;
      ++settled_.external_used;
      std::rotate(held_external_ + i, held_external_ + i + 1, held_external_ + held_externals_);
      --held_externals_;
    }
  }
  return true;
}

bool FrameAssembler::flush() noexcept {
  clock_.reject_held();
  settle();
  const bool placed = place_accepted();
  if (placed)
    while (held_externals_ > 0) drop_external(0);
  close_open();
  return placed;
}

bool FrameAssembler::advance(int64_t now_ns, int64_t pose_count) noexcept {
  clock_.name_time(now_ns);
  if (!place_accepted()) return false;
  if (open_) {
    if (difference_ns(now_ns, open_->first_stamp_ns) >= params_.wait_ns) close_open();
    return true;
  }
  if (!closed_ns_ || difference_ns(now_ns, *closed_ns_) < params_.predict_after_ns) return true;
  Frame* frame = open(now_ns, FrameKind::kPrediction);
  if (!frame) return false;
  EgoRange poses = ego_.range();
  poses.count = std::min(poses.count, pose_count);
  close(*frame, poses);
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
  forget_classified({sensor, scan.stamp_ns});
  recent_[sensor].add(scan.stamp_ns, clock_.newest_ns());
  SensorPart& part = frame.sensors[sensor];
  std::swap(part.scan, scan.table);
  take_early(part, scan.early);
  part.present = true;
  part.stamp_ns = scan.stamp_ns;
  part.spans[OVT_STAGE_LOAD] = scan.load;
  frame.pushed_ns = std::max(frame.pushed_ns, scan.pushed_ns);
  frame.sensor_mask |= 1u << sensor;
  if (scan.is_incomplete) {
    frame.incomplete_mask |= 1u << sensor;
    frame.flags |= OVT_FLAG_SCAN_INCOMPLETE;
  }
  frame.first_stamp_ns = std::min(frame.first_stamp_ns, scan.stamp_ns);
  frame.stamp_ns = std::max(frame.stamp_ns, scan.stamp_ns);
  seen_ns_[sensor] = std::max(seen_ns_[sensor], scan.stamp_ns);
  rhythm_[sensor].note_stamp(scan.stamp_ns, kMostPeriods * params_.period_ns + params_.tolerance_ns);
  if (profile_) profile_->describe(ego_, scan.ego, scan.stamp_ns, part.road);
  runner_.start_segment(frame, sensor);
}

void FrameAssembler::close_open() noexcept {
  if (!open_) return;
  close(*std::exchange(open_, nullptr), open_range_);
}

void FrameAssembler::close(Frame& frame, const EgoRange& range) noexcept {
  frame.sequence = next_sequence_++;
  if (std::exchange(restart_next_, false)) {
    frame.restart = true;
    frame.flags |= OVT_FLAG_CLOCK_JUMP;
  }
  // A prediction contains no measurement: scans of that time may still come.
  if (frame.kind != FrameKind::kPrediction) {
    if (closed_ns_ && frame.stamp_ns < *closed_ns_)
      frame.flags |= OVT_FLAG_OUT_OF_SEQUENCE;
    else
      closed_ns_ = frame.stamp_ns;
  }
  if (frame.kind == FrameKind::kScans)
    closed_scans_ns_ = std::max(closed_scans_ns_.value_or(frame.stamp_ns), frame.stamp_ns);
  ego_.copy_window(watch_ego(range, frame), frame.first_stamp_ns, frame.stamp_ns, frame.ego);
  frame.suspect_mask |= clock_.suspect_mask();
  if (frame.suspect_mask) frame.flags |= OVT_FLAG_CLOCK_SUSPECT;
  if (frame.kind == FrameKind::kPrediction) frame.flags |= OVT_FLAG_PREDICTION | OVT_FLAG_NO_DATA;
  for (int32_t s = 0; s < params_.sensor_count; ++s) {
    if (frame.kind != FrameKind::kExternal && !(frame.sensor_mask >> s & 1u)) frame.flags |= OVT_FLAG_SENSOR_MISSING;
    if (difference_ns(frame.stamp_ns, seen_ns_[s]) > patience_ns(s)) frame.stale_mask |= 1u << s;
  }
  if (frame.stale_mask) frame.flags |= OVT_FLAG_SENSOR_STALE;
  frame.closed_ns.store(steady_now_ns(), std::memory_order_relaxed);
  runner_.close(frame);
}

// A step of the clock shows as a gap of the stamps, at least as large as what the lead grew by.
bool EgoWatch::is_step(int64_t lead_ns, int64_t gaps_ns, int64_t near_ns) const noexcept {
  const int64_t most_ns = gaps_ns > INT64_MAX - near_ns ? INT64_MAX : gaps_ns + near_ns;
  return frames > 0 && gaps_ns > near_ns && difference_ns(lead_ns, known_lead_ns()) <= most_ns;
}

bool EgoWatch::look(int64_t lead_ns, int64_t run, int64_t gaps_ns, int64_t near_ns) noexcept {
  const bool stepped = is_step(lead_ns, gaps_ns, near_ns);
  if (!stepped && frames < kLearnFrames) learn(lead_ns);
  const bool is_ahead = frames > 0 && difference_ns(lead_ns, stepped ? known_lead_ns() : usual_lead_ns) > near_ns;
  ahead = is_ahead ? std::min(ahead + 1, kDriftFrames) : 0;
  if (!is_ahead || !stepped) {
    believed_run = std::max(believed_run, run);
    see(lead_ns, near_ns / kSinkFrames);
    doubts = 0;
    if (was_late && lead_ns >= -kEgoFreshNs) learn_again(lead_ns);  // they come in time now
  } else if (is_unsure() && ++doubts >= kLearnFrames) {
    believed_run = run;
    named = 3;
    doubts = ahead = 0;
    learn_again(lead_ns);
  }
  return stepped;
}

// Selects the poses of the range that the frame may use. The time is the sensors' newest stamp, or the frame's stamp if
// there is none.
EgoRange FrameAssembler::watch_ego(const EgoRange& range, Frame& frame) noexcept {
  EgoWatch& watch = ego_watch_;
  EgoRange used = range;
  if (watch.named > 0) --watch.named;
  if (range.refused > watch.refused) watch.named = 3;
  watch.refused = std::max(watch.refused, range.refused);
  if (range.count > ego_.oldest_safe(range)) {
    const int64_t now_ns = clock_.any() ? clock_.newest_ns() : frame.stamp_ns;
    const int64_t lead_ns = difference_ns(ego_.stamp_at(range.count - 1), now_ns), run = ego_.run_at(range.count - 1);
    const int64_t gaps_ns = run > watch.believed_run ? ego_.gaps_after(range, watch.believed_run) : 0;
    const bool in_sequence = frame.kind != FrameKind::kPrediction && !(frame.flags & OVT_FLAG_OUT_OF_SEQUENCE);
    const bool stepped = in_sequence ? watch.look(lead_ns, run, gaps_ns, clock_.near_ns())
                                     : watch.is_step(lead_ns, gaps_ns, clock_.near_ns());
    const bool step_ahead = watch.ahead > 0 && stepped;
    if (step_ahead) used.count = ego_.first_run_after(range, watch.believed_run);
    // The frame may close long after its last scan: after a pause of all sensors.
    const bool late = range.count > watch.count && lead_ns < -kLateNs &&
                      difference_ns(ego_.stamp_at(range.count - 1), frame.stamp_ns) < -kLateNs;
    if (step_ahead || watch.ahead == EgoWatch::kDriftFrames || late) watch.named = 3;
    watch.count = std::max(watch.count, range.count);
  }
  if (watch.named > 0) frame.suspect_mask |= OVT_SUSPECT_EGO;
  return used;
}

// The open frame starts later, or a frame of scans has this stamp or a later one. Frames of pushed detections do not
// count: a radar may deliver before the scans of the same time, which still belong together.
bool FrameAssembler::belongs_before(int64_t stamp_ns) const noexcept {
  if (open_ && stamp_ns <= open_->first_stamp_ns) return true;
  return closed_scans_ns_ && stamp_ns <= *closed_scans_ns_;
}

// 0: the sensor is not slow, or its interval or those of all others are not known yet. The fastest sensor counts with
// at least a period, so that one short step of it (a driver that divides a scan, say) makes no other sensor slow.
int64_t FrameAssembler::slow_interval_ns(int32_t sensor) const noexcept {
  int64_t fastest_ns = INT64_MAX / 2;
  for (const SensorRhythm& rhythm : rhythm_)
    if (const int64_t interval_ns = rhythm.interval_ns()) fastest_ns = std::min(fastest_ns, interval_ns);
  fastest_ns = std::max(fastest_ns, params_.period_ns);
  const int64_t own_ns = rhythm_[sensor].interval_ns();
  return own_ns > fastest_ns + fastest_ns / 2 ? own_ns : 0;
}

// A sensor without a scan for longer is silent.
int64_t FrameAssembler::patience_ns(int32_t sensor) const noexcept {
  const int64_t slow_ns = slow_interval_ns(sensor);
  return slow_ns > 0 ? slow_ns + slow_ns / 2 : params_.wait_ns;
}

// Whether the sensor's next scan may belong to the open frame.
bool FrameAssembler::is_due(int32_t sensor) const noexcept {
  const int64_t slow_ns = slow_interval_ns(sensor);
  if (slow_ns == 0 || !rhythm_[sensor].knows_last()) return true;
  return difference_ns(open_->first_stamp_ns, seen_ns_[sensor]) >= slow_ns - params_.tolerance_ns;
}

// Whether the frame has every sensor that is due, except those that are silent. After a gap of all sensors the silence
// is that before the gap: the other sensors are likely to come back with this one.
bool FrameAssembler::complete() const noexcept {
  const bool after_gap = closed_scans_ns_ && difference_ns(open_->first_stamp_ns, *closed_scans_ns_) > params_.wait_ns;
  const int64_t until_ns = after_gap ? *closed_scans_ns_ : open_->first_stamp_ns;
  for (int32_t s = 0; s < params_.sensor_count; ++s)
    if (!(open_->sensor_mask >> s & 1u) && is_due(s) && difference_ns(until_ns, seen_ns_[s]) <= patience_ns(s))
      return false;
  return true;
}

}  // namespace overtake
