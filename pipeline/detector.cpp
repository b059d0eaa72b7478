// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
#include "pipeline/detector.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <new>
#include <stdexcept>
#include <type_traits>
#include <utility>

#include "core/float_mode.h"
#include "pipeline/frame_flags.h"

namespace overtake {
namespace {
static_assert(kReasonCount <= int32_t(std::extent_v<decltype(ovt_stats::points_bad)>));
// The detectors whose on_frame this thread runs: one's on_frame may push to another, whose on_frame then runs, too.
struct Callback {
  const Detector* detector;
  const Callback* outer;
};
// The innermost. initial-exec: the first use on a thread allocates no memory.
[[gnu::tls_model("initial-exec")]] thread_local const Callback* callbacks = nullptr;

bool is_in_callback_of(const Detector* detector) noexcept {
  for (const Callback* c = callbacks; c; c = c->outer)
    if (c->detector == detector) return true;
  return false;
}

void add(std::atomic<int64_t>& counter, int64_t n) noexcept {
  if (n != 0) counter.fetch_add(n, std::memory_order_relaxed);
}
}  // namespace

void Detector::log(ovt_log_level level, const char* text) const noexcept {
  const FloatMode usual;
  try {
    if (log_) log_(level, text, user_);
  } catch (...) {  // the caller's log function threw: nothing can report that
  }
}

Detector::~Detector() { stop(); }

void Detector::stop() {
  if (intake_.joinable()) {
    if (start_state_.load(std::memory_order_acquire) == kRunning) finish_pushed();
    stop_.store(true, std::memory_order_release);
    event_.signal();
    intake_.join();
  }
  if (assembler_) assembler_->flush();
  assembler_.reset();
  runner_.reset();  // waits for the frames in work
}

void Detector::destroy(Detector* detector) {
  if (getpid() != detector->process_) return;
  detector->stop();
  detector->closed_.store(true, std::memory_order_release);
  detector->drop_owner();
}

void Detector::drop_owner() {
  if (owners_.fetch_sub(1, std::memory_order_acq_rel) == 1) delete this;
}

// ---- producers ----------------------------------------------------------------------------------------------------

bool Detector::enter() {
  const bool calls_back = is_in_callback_of(this);
  const bool mine = !calls_back && (!inline_ || !inside_.exchange(true, std::memory_order_acquire));
  if (!mine) counters_.refused.fetch_add(1, std::memory_order_relaxed);
  if (!mine && !reported_wrong_thread_.exchange(true, std::memory_order_relaxed))
    log(OVT_LOG_ERROR, calls_back ? "on_frame called something other than ovt_read_...: refused"
                                  : "worker_count 1: a second thread called while one was inside");
  return mine;
}

ovt_status Detector::refuse_push(const char* function, const char* argument) noexcept {
  counters_.bad_arguments.fetch_add(1, std::memory_order_relaxed);
  if (!reported_bad_argument_.exchange(true, std::memory_order_relaxed)) {
    char text[160];
    std::snprintf(text, sizeof text, "%s: bad argument: %s", function, argument);
    log(OVT_LOG_ERROR, text);
  }
  return OVT_BAD_ARGUMENT;
}

ovt_status Detector::push_ego_pose(const ovt_ego_pose& in) {
  EgoPose pose = {in.stamp_ns,  in.x_m,     in.y_m,       in.z_m,         in.roll_rad,
                  in.pitch_rad, in.yaw_rad, in.speed_mps, in.yaw_rate_rps};
  if (push_waits_ && !inline_) wait_for_poses();
  using Found = PoseRepair::Found;
  const uint32_t found = pose_repair_.repair(pose);
  const auto has = [found](Found what) { return (found & uint32_t(what)) != 0; };
  add(counters_.ego_held, has(Found::kHeld));
  add(counters_.ego_rates_wrong, has(Found::kWrongRate));
  add(counters_.ego_noisy, has(Found::kNoise));
  if (has(Found::kLost) && !std::exchange(reported_held_, true))
    log(OVT_LOG_WARNING,
        "ovt_push_ego_pose: x_m and y_m stay the same for over 0.15 s at more than 1 m/s: such poses "
        "are not used");
  if (has(Found::kWrongRate) && !std::exchange(reported_wrong_rate_, true))
    log(OVT_LOG_WARNING,
        "ovt_push_ego_pose: yaw_rad contradicts yaw_rate_rps (sign, unit, or never set?): the rate of "
        "yaw_rad is used");
  const bool lost = has(Found::kLost);
  const ovt_status status = lost ? OVT_OK : ego_->push(bank_attitude_.complete(pose));
  (status == OVT_OK && !lost ? counters_.ego_poses : counters_.ego_dropped).fetch_add(1, std::memory_order_relaxed);
  if (const int32_t n = ego_->take_dropped()) {  // push had returned OVT_OK for them
    counters_.ego_poses.fetch_sub(n, std::memory_order_relaxed);
    counters_.ego_dropped.fetch_add(n, std::memory_order_relaxed);
  }
  return status;
}

// Replay: a pose may overwrite one that is used by a scan in its mailbox, or by a frame that this scan closes. Then the
// intake places all scans that were pushed first. It needs no other call for that, only finished frames, as in
// finish_pushed. In on_frame, whose frame would never finish, nothing waits.
void Detector::wait_for_poses() {
  const int64_t count = ego_->range().count;
  if (count - placed_poses_ < ego_->spare() || is_in_callback_of(this)) return;
  poses_before_.store(tickets_.load(std::memory_order_relaxed), std::memory_order_relaxed);
  const uint64_t ticket = poses_wanted_.fetch_add(1, std::memory_order_acq_rel) + 1;
  event_.signal();
  for (uint64_t done; (done = poses_done_.load(std::memory_order_acquire)) < ticket;) poses_done_.wait(done);
  placed_poses_ = count;
}

ovt_status Detector::push_detections(const ovt_external_detections& in) {
  const Turn turn(*this);
  if (!turn) return OVT_WRONG_THREAD;
  if (in.count > context_.candidate_capacity) {  // not table.capacity, which is rounded up
    counters_.external_dropped.fetch_add(1, std::memory_order_relaxed);
    probe_drop(-1, in.stamp_ns);
    return OVT_TOO_MANY;
  }
  if (last_external_.any && in.stamp_ns == last_external_.last_ns) {
    counters_.external_dropped.fetch_add(1, std::memory_order_relaxed);
    return OVT_DUPLICATE;
  }
  last_external_ = {true, in.stamp_ns};
  if (push_waits_ && !inline_) external_.wait_until_acquired();
  ExternalScan& scan = external_.writable();
  const auto copy = [&](const double* from, double* to) {
    for (int32_t i = 0; i < in.count; ++i) to[i] = from ? from[i] : std::nan("");
  };
  ExternalTable& rows = scan.table;
  rows.count = in.count;
  copy(in.x_m, rows.x_m);
  copy(in.y_m, rows.y_m);
  copy(in.heading_rad, rows.heading_rad);
  copy(in.var_x, rows.var_x);
  copy(in.var_y, rows.var_y);
  copy(in.cov_xy, rows.cov_xy);
  copy(in.length_m, rows.length_m);
  copy(in.width_m, rows.width_m);
  copy(in.height_m, rows.height_m);
  copy(in.score, rows.score);
  scan.stamp_ns = in.stamp_ns;
  scan.ticket = tickets_.fetch_add(1, std::memory_order_relaxed);
  scan.reference = in.reference;
  scan.ego = ego_->range();
  if (external_.post()) {
    counters_.external_dropped.fetch_add(1, std::memory_order_relaxed);
    probe_drop(-1, external_.writable().stamp_ns);
  }
  tell_intake();
  return OVT_OK;
}

void Detector::tell_intake() {
  if (inline_) {
    while (step_intake()) {
    }
  } else {
    event_.signal();
  }
}

ovt_status Detector::advance(int64_t now_ns) {
  const Turn turn(*this);
  if (!turn) return OVT_WRONG_THREAD;
  close_late_scans(now_ns);
  if (inline_) {
    assembler_->advance(now_ns);
    count_settled();
    return OVT_OK;
  }
  const uint64_t version = advance_version_.load(std::memory_order_relaxed) + 2;
  advance_version_.store(version - 1, std::memory_order_relaxed);
  advance_.store({now_ns, ego_->range().count, tickets_.load(std::memory_order_relaxed)});
  advance_version_.store(version, std::memory_order_release);
  event_.signal();
  if (push_waits_)  // replay: the intake must handle this time before any later push
    for (uint64_t done; (done = advance_done_.load(std::memory_order_acquire)) < version;) advance_done_.wait(done);
  return OVT_OK;
}

ovt_status Detector::flush() {
  const Turn turn(*this);
  if (!turn) return OVT_WRONG_THREAD;
  close_all_scans();
  if (inline_) {
    assembler_->flush();
    count_settled();
    return OVT_OK;
  }
  finish_pushed();
  return OVT_OK;
}

// Asks the intake to finish the frames of all that was pushed, and waits for them. This ends: frames in work need
// nobody but on_frame, and readers cannot hold every frame slot (a reader holds one, and the pool has more).
void Detector::finish_pushed() {
  flush_before_.store(tickets_.load(std::memory_order_relaxed), std::memory_order_relaxed);
  flush_poses_.store(ego_->range().count, std::memory_order_relaxed);
  const uint64_t ticket = flush_wanted_.fetch_add(1, std::memory_order_acq_rel) + 1;
  event_.signal();
  for (uint64_t done; (done = flush_done_.load(std::memory_order_acquire)) < ticket;) flush_done_.wait(done);
}

// ---- intake ---------------------------------------------------------------------------------------------------------

void Detector::run_intake() {
  StartState state = kRunning;
  try {
    runner_->warm_up();                  // before this thread has settings: threads that oneTBB starts inherit them
  } catch (const std::runtime_error&) {  // of oneTBB
    state = kNoThread;
  } catch (...) {
    state = kFailed;
  }
  thread_setup_->enter_intake();
  start_state_.store(state, std::memory_order_seq_cst);  // before notify_all looks for sleepers, on any CPU
  start_state_.notify_all();
  if (state != kRunning) return;
  for (;;) {
    const uint32_t seen = event_.look();
    if (stop_.load(std::memory_order_acquire)) return;
    while (step_intake()) {
    }
    watch_frames();
    if (spin_ns_ > 0) {
      const int64_t until = steady_now_ns() + spin_ns_;
      while (event_.look() == seen && steady_now_ns() < until) idle_briefly();
    }
    event_.wait(seen);
  }
}

// Logs and counts each frame that is in work for too long, once. It cannot end a thread that hangs.
void Detector::watch_frames() {
  if (watchdog_ns_ == 0) return;
  const int32_t stalled = pool_.count_stalled(steady_now_ns(), watchdog_ns_);
  if (stalled == 0) return;
  counters_.stalled.fetch_add(stalled, std::memory_order_relaxed);
  log(OVT_LOG_ERROR, "watchdog: a frame is in work for longer than watchdog_ns");
}

// Drains the mailboxes until a full pass finds nothing. Only then is the smallest pending stamp guaranteed to be the
// oldest one pushed. While producers push faster than a pass ends, each pass finds something: the work goes on after a
// few.
void Detector::gather() {
  const auto take = [&](int32_t sensor, auto& box, std::atomic<int64_t>& dropped) {
    if (box.pending() && push_waits_) return false;
    bool replaced = false;
    const int64_t held_ns = box.pending() ? box.pending()->stamp_ns : 0;
    if (!box.acquire(replaced)) return false;
    if (replaced) {
      dropped.fetch_add(1, std::memory_order_relaxed);
      probe_drop(sensor, held_ns);
    }
    return true;
  };
  constexpr int32_t kPasses = 16;
  bool found = true;
  for (int32_t k = 0; k < kPasses && found; ++k) {
    found = take(-1, external_, counters_.external_dropped);
    for (int32_t s = 0; s < context_.sensor_count; ++s) found |= take(s, mailboxes_[s], counters_.dropped);
  }
}

// Replay: what comes next reads the poses as when it was pushed.
void Detector::read_poses_of(int64_t count) noexcept {
  if (push_waits_ && !inline_) ego_->set_horizon(count);
}

bool Detector::place_pending_detections() {
  read_poses_of(external_.pending()->ego.count);
  const IntakeResult taken = assembler_->take_external(*external_.pending());
  count_settled();
  if (taken == IntakeResult::kNoSlot) return false;
  if (taken != IntakeResult::kHeld)
    (taken == IntakeResult::kUsed ? counters_.external : counters_.external_dropped)
        .fetch_add(1, std::memory_order_relaxed);
  external_.release();
  return true;
}

// Counts scans and detections that were held until other sensors decided.
void Detector::count_settled() {
  const Settled settled = assembler_->take_settled();
  add(counters_.used, settled.used);
  add(counters_.late, settled.late - settled.late_before_jump);
  add(counters_.dropped, settled.late_before_jump);
  add(counters_.external, settled.external_used);
  add(counters_.external_dropped, settled.external_dropped);
}

bool Detector::place_pending_scan(int32_t sensor) {
  read_poses_of(mailboxes_[sensor].pending()->ego.count);
  const IntakeResult taken = assembler_->take_scan(sensor, *mailboxes_[sensor].pending());
  count_settled();
  switch (taken) {
    case IntakeResult::kNoSlot: return false;
    case IntakeResult::kUsed: add(counters_.used, 1); break;
    case IntakeResult::kLate: add(counters_.late, 1); break;
    case IntakeResult::kDuplicate: add(counters_.dup, 1); break;
    case IntakeResult::kRepeat:
      add(counters_.dup, 1);
      if (!std::exchange(reported_repeat_, true))
        log(OVT_LOG_WARNING,
            "a sensor pushes the points of its scan before again, with new stamps, while the ego vehicle "
            "moves: such scans count as duplicates");
      break;
    case IntakeResult::kHeld: break;  // count_settled counts it later
  }
  mailboxes_[sensor].release();
  return true;
}

// Returns the source with the smallest stamp among the pending ones near the stamp that was pushed first. So scans of
// one frame, and of neighbouring frames, are used in the order of time. A stamp far from the first one says nothing
// about the order: a source with a wrong clock waits its turn. -1: nothing is pending.
int32_t Detector::find_next() {
  struct Waiting {
    int64_t stamp_ns;
    uint64_t ticket;
    int32_t source;
  } waiting[ClockWatch::kSources];
  int32_t count = 0, first = 0;
  for (int32_t s = 0; s < context_.sensor_count; ++s)
    if (const Scan* scan = mailboxes_[s].pending()) waiting[count++] = {scan->stamp_ns, scan->ticket, s};
  if (const ExternalScan* external = external_.pending())
    waiting[count++] = {external->stamp_ns, external->ticket, ClockWatch::kExternal};
  if (count == 0) return -1;
  for (int32_t i = 1; i < count; ++i)
    if (waiting[i].ticket < waiting[first].ticket) first = i;
  const int64_t first_ns = waiting[first].stamp_ns,
                near_ns = push_waits_ ? 0 : assembler_->near_ns();  // replay: in the order of pushes
  int32_t next = first;
  for (int32_t i = 0; i < count; ++i) {
    const int64_t before_ns = difference_ns(first_ns, waiting[i].stamp_ns);
    if (before_ns > 0 && before_ns <= near_ns && waiting[i].stamp_ns < waiting[next].stamp_ns) next = i;
  }
  return waiting[next].source;
}

// Whether something that was pushed before this ticket still waits.
bool Detector::is_pending_before(uint64_t ticket) noexcept {
  for (int32_t s = 0; s < context_.sensor_count; ++s)
    if (const Scan* scan = mailboxes_[s].pending(); scan && scan->ticket < ticket) return true;
  const ExternalScan* const external = external_.pending();
  return external && external->ticket < ticket;
}

bool Detector::step_intake() {
  // Read what is asked for first: then everything pushed before it is gathered and used before it. The flush before the
  // advance: who sees a flush sees the advance before it.
  const uint64_t flush_wanted = flush_wanted_.load(std::memory_order_acquire);
  const uint64_t flush_before = flush_before_.load(std::memory_order_relaxed);
  const uint64_t poses_wanted = poses_wanted_.load(std::memory_order_acquire);
  const uint64_t poses_before = poses_before_.load(std::memory_order_relaxed);
  constexpr int32_t kReads = 16;
  uint64_t version = 0;
  Advance advance{};
  bool is_whole = false;
  for (int32_t k = 0; k < kReads && !is_whole; ++k) {
    version = advance_version_.load(std::memory_order_acquire);
    advance = advance_.load();
    gather();
    // Again if there is a later one: what was gathered may have been pushed after it.
    is_whole = version % 2 == 0 && version == advance_version_.load(std::memory_order_acquire);
  }
  if (const auto hook = gather_hook_.load(std::memory_order_acquire)) hook(gather_user_);
  // What is pushed later does not delay them.
  if (poses_wanted != poses_done_.load(std::memory_order_relaxed) && !is_pending_before(poses_before)) {
    poses_done_.store(poses_wanted, std::memory_order_release);
    poses_done_.notify_all();
    return true;
  }
  const bool asks = is_whole && version != advance_done_.load(std::memory_order_relaxed);
  if (asks && !is_pending_before(advance.before)) {
    read_poses_of(advance.poses);
    const bool done = assembler_->advance(advance.now_ns, advance.poses);
    count_settled();
    if (!done) return false;
    advance_done_.store(version, std::memory_order_release);
    advance_done_.notify_all();
    return true;
  }
  if (flush_wanted != flush_done_.load(std::memory_order_relaxed) && !is_pending_before(flush_before)) {
    if (flushed_ != flush_wanted) {
      read_poses_of(flush_poses_.load(std::memory_order_relaxed));
      const bool done = assembler_->flush();
      count_settled();
      if (!done) return false;
      flushed_ = flush_wanted;
      flushed_frames_ = assembler_->closed_count();
    }
    if (counters_.frames.load(std::memory_order_acquire) >= flushed_frames_) {
      flush_done_.store(flush_wanted, std::memory_order_release);
      flush_done_.notify_all();
      return true;
    }
  }
  const int32_t next = find_next();
  if (next < 0) return false;
  return next == ClockWatch::kExternal ? place_pending_detections() : place_pending_scan(next);
}

// ---- finished frames -----------------------------------------------------------------------------------------------

// Adds what a frame lost and found to the counters. Returns whether the tracker's table overflowed.
bool Detector::count_results(const Frame& frame) {
  for (int32_t s = 0; s < context_.sensor_count; ++s) {
    const SensorPart& part = frame.sensors[s];
    if (!part.present) continue;
    for (int32_t r = 1; r < kReasonCount; ++r) add(counters_.points_bad[r], part.reason_count[r]);
    add(counters_.points, part.kept.points.count);
    add(counters_.points_clustered, part.cluster_points.count - part.reason_count[int32_t(Reason::kOwnBody)]);
    add(counters_.overflow_clusters, part.cluster_overflow);
  }
  add(counters_.overflow_clusters, frame.merged_overflow);
  add(counters_.overflow_candidates, frame.candidate_overflow);
  add(counters_.clusters, frame.merged.count);
  add(counters_.gated_points, frame.gated_points);
  add(counters_.gated_size, frame.gated_size);
  add(counters_.gated_map, frame.gated_map);
  add(counters_.gated_own, frame.gated_own);
  add(counters_.gated_range, frame.gated_range);
  add(counters_.detections, frame.detections.count);
  add(counters_.measurements_lost, frame.lost_rows);
  add(counters_.row_values_ignored, frame.values_ignored);
  const TrackerCounts tracked = track_stage_->tracker().counts();
  const auto set = [](std::atomic<int64_t>& counter, int64_t n) { counter.store(n, std::memory_order_relaxed); };
  set(counters_.measurements, tracked.measurements);
  set(counters_.measurements_used, tracked.hits + tracked.births);
  set(counters_.measurements_unborn, tracked.unborn);
  set(counters_.measurements_rejected, tracked.rejected);
  set(counters_.measurements_late, tracked.late);
  set(counters_.measurements_debris, tracked.debris);
  set(counters_.tracks_born, tracked.births);
  set(counters_.tracks_missed, tracked.missed);
  set(counters_.tracks_silent, tracked.silent);
  set(counters_.tracks_displaced, tracked.displaced);
  set(counters_.tracks_unsound, tracked.unsound);
  set(counters_.tracks_forgotten, tracked.forgotten);
  set(counters_.tracks_joined, tracked.joined);
  set(counters_.work_limited, tracked.limited + tracked.refused);
  if (frame.restart) add(counters_.clock_jumps, 1);
  if (frame.refiltered > 0) add(counters_.refiltered, 1);
  // A replay in the tracker may lower it.
  return tracked.overflow() > counters_.overflow_tracks.exchange(tracked.overflow(), std::memory_order_relaxed);
}

void Detector::call_on_frame(Frame& frame) {
  callback_reader_.frame = &frame;
  const Callback call = {this, callbacks};
  callbacks = &call;
  try {
    on_frame_(reinterpret_cast<ovt_reader*>(&callback_reader_), user_);
  } catch (...) {
    add(counters_.exceptions, 1);
    log(OVT_LOG_ERROR, "on_frame threw an exception");
  }
  callbacks = call.outer;
  callback_reader_.frame = nullptr;
}

void Detector::finish(Frame& frame) {
  const bool tracks_overflowed = count_results(frame);
  const uint32_t flags = flags_of(frame, context_.sensor_count, tracks_overflowed, deadline_ns_);
  frame.flags |= flags;
  if (flags & OVT_FLAG_DEADLINE_MISSED) {
    add(counters_.deadline_missed, 1);
    probe_deadline(frame.sequence, frame.latency_ns);
  }
  if (on_frame_) call_on_frame(frame);
  pool_.publish(&frame);
  counters_.frames.fetch_add(1, std::memory_order_release);
  event_.signal();
}

// ---- readers --------------------------------------------------------------------------------------------------------

ovt_status Detector::build_reader(Reader& reader) {
  reader.detector = this;
  const int32_t tracks = tracker_params_.track_capacity;
  const FrameTracker& tracker = track_stage_->tracker();
  const bool built = reader.arena.build(memory_.allocator(), [&](Carver& carver) {
    carve_table(carver, reader.tracks, tracks);
    if (tracker.writes_optional()) carve_table(carver, reader.optional, tracks);
    carve_table(carver, reader.paths, round_up(tracks, kRowAlign) * tracker.path_points());
  });
  reader.paths.points_per_track = tracker.path_points();
  return built ? OVT_OK : OVT_NO_MEMORY;
}

ovt_status Detector::create_reader(Reader** out) {
  if (reader_count_.fetch_add(1) >= reader_capacity_) {
    reader_count_.fetch_sub(1);
    return OVT_TOO_MANY;
  }
  std::unique_ptr<Reader> reader(new (std::nothrow) Reader);
  if (!reader || build_reader(*reader) != OVT_OK) {
    reader_count_.fetch_sub(1);
    return OVT_NO_MEMORY;
  }
  owners_.fetch_add(1, std::memory_order_relaxed);
  *out = reader.release();
  return OVT_OK;
}

void Detector::destroy_reader(Reader* reader) {
  if (getpid() != process_) return;
  if (reader->frame) pool_.release(reader->frame);
  delete reader;
  reader_count_.fetch_sub(1);
  drop_owner();
}

ovt_status Detector::next_frame(Reader& reader) {
  if (reader.is_callback_reader || closed_.load(std::memory_order_acquire)) return OVT_NO_FRAME;
  if (pool_.latest_sequence() <= reader.seen_sequence) return OVT_NO_FRAME;
  if (reader.frame) pool_.release(reader.frame);  // release first: a reader never holds two slots
  reader.frame = pool_.pin_latest();
  reader.seen_sequence = reader.frame->sequence;
  return OVT_OK;
}

ovt_status Detector::set_path_horizon(Reader& reader, double horizon_s) {
  if (!(horizon_s >= 0.0 && horizon_s <= tracker_params_.horizon_s)) return OVT_BAD_ARGUMENT;
  reader.paths.points_per_track = path_points(tracker_params_, horizon_s);
  return OVT_OK;
}

int64_t Detector::publish_tracks(Reader& reader, int64_t publish_ns) {
  publish_ns = limit_publish_ns(reader.frame->tracks_ns, publish_ns);
  const Frame& frame = *reader.frame;
  track_stage_->tracker().publish(frame.tracks, frame.track_states, publish_ns, reader.tracks, &reader.optional,
                                  &reader.paths);
  return publish_ns;
}

void Detector::read_stats(ovt_stats& out) const {
  const auto get = [](const std::atomic<int64_t>& counter) { return counter.load(std::memory_order_relaxed); };
#define OVT_COUNTER(name, ...) out.name = get(counters_.name);
#define OVT_COUNTERS(name, size, ...) \
  for (int32_t i = 0; i < size; ++i) out.name[i] = get(counters_.name[i]);
#define OVT_GAUGE(name, ...) out.name = pool_.count_##name();
#include "pipeline/stats.def"
}

}  // namespace overtake
