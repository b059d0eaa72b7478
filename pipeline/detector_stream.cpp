// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// Scans on their way to a mailbox: whole, or in pieces.
//
// A scan in pieces grows in the writable slot of its sensor's mailbox. Its owner is a state, not a lock: the producer
// takes it for the time of a call; a thread that brings a newer time takes it only while no call of the producer runs,
// to post the scan: a few microseconds, but with OVT_PUSH_WAIT until the mailbox has room, and with worker_count 1 the
// work that the scan makes possible. So a decision to close a scan is made in the call that brings
// the time, and does not depend on the number of workers.
#include "pipeline/detector.h"

namespace overtake {
namespace {

// A piece of an older stamp is late up to this age; an even older one means that the sensor's clock went back.
constexpr int64_t kReorder_ns = 1'000'000'000;

PointFields fields_of(const ovt_points& points) noexcept {
  const auto as_field = [](const ovt_column& c) {
    return PointField{c.data, std::ptrdiff_t(c.stride), FieldType(c.type)};
  };
  return {as_field(points.x),     as_field(points.y),    as_field(points.z), as_field(points.intensity),
          as_field(points.layer), as_field(points.time), points.time_unit_ns};
}

// The producer owns its sensor's stream during a call. False if another thread pushes scans of this sensor.
class Hold {
 public:
  explicit Hold(ScanStream& stream) noexcept : stream_(stream) {
    for (int32_t seen = stream.owner.load(std::memory_order_acquire);;) {
      if (seen == ScanStream::kProducer) return;
      if (seen == ScanStream::kCloser) {
        stream.owner.wait(seen, std::memory_order_acquire);
        seen = stream.owner.load(std::memory_order_acquire);
      } else if (stream.owner.compare_exchange_weak(seen, ScanStream::kProducer, std::memory_order_acq_rel,
                                                    std::memory_order_acquire)) {
        mine_ = true;
        return;
      }
    }
  }
  ~Hold() {
    if (mine_)
      stream_.owner.store(stream_.is_open ? ScanStream::kFreeOpen : ScanStream::kFree, std::memory_order_release);
  }
  Hold(const Hold&) = delete;
  Hold& operator=(const Hold&) = delete;
  explicit operator bool() const noexcept { return mine_; }

 private:
  ScanStream& stream_;
  bool mine_ = false;
};

}  // namespace

// The first time, of each sensor, goes to the log.
ovt_status Detector::refuse_producer(ScanStream& stream) noexcept {
  counters_.refused.fetch_add(1, std::memory_order_relaxed);
  if (!stream.reported_producers.exchange(true, std::memory_order_relaxed))
    log(OVT_LOG_ERROR, "two threads push scans of one sensor at the same time: refused");
  return OVT_WRONG_THREAD;
}

ovt_status Detector::push_scan(const ovt_points& points) {
  const Turn turn(*this);
  if (!turn) return OVT_WRONG_THREAD;
  const int32_t s = points.sensor;
  ScanStream& stream = streams_[s];
  const Hold hold(stream);
  if (!hold) return refuse_producer(stream);
  counters_.pushed.fetch_add(1, std::memory_order_relaxed);
  if (points.count > point_capacity_[s]) {
    counters_.dropped.fetch_add(1, std::memory_order_relaxed);
    probe_drop(s, points.stamp_ns);
    return OVT_TOO_MANY;
  }
  const bool is_open_stamp = stream.is_open && points.stamp_ns == stream.stamp_ns.load(std::memory_order_relaxed);
  if (is_open_stamp || (stream.last.any && points.stamp_ns == stream.last.last_ns)) {
    counters_.dup.fetch_add(1, std::memory_order_relaxed);
    return OVT_DUPLICATE;
  }
  if (stream.is_open) close_scan(stream, s, false, -1);
  note_closed(stream, points.stamp_ns);
  stream.note_recent(points.stamp_ns);

  Mailbox<Scan>& box = mailboxes_[s];
  if (push_waits_ && !inline_) box.wait_until_acquired();
  Scan& scan = box.writable();
  const int64_t start = steady_now_ns();
  probe_stage_begin(-1, s, OVT_STAGE_LOAD, points.stamp_ns);
  context_.kernels->load_points(fields_of(points), points.count, scan.table);
  scan.load = {start, steady_now_ns() - start, this_worker()};
  probe_stage_end(-1, s, OVT_STAGE_LOAD, points.stamp_ns);
  scan.pushed_ns = scan.load.start_ns + scan.load.duration_ns;
  scan.is_incomplete = false;
  if (scan.early) scan.early->steps = 0;
  note_stamp(s, points.stamp_ns);
  post_scan(s, points.stamp_ns);
  return OVT_OK;
}

ovt_status Detector::push_points(const ovt_points& piece) {
  const Turn turn(*this);
  if (!turn) return OVT_WRONG_THREAD;
  ScanStream& stream = streams_[piece.sensor];
  const Hold hold(stream);
  if (!hold) return refuse_producer(stream);
  const auto count_as = [](std::atomic<int64_t>& counter, ovt_status status) {
    counter.fetch_add(1, std::memory_order_relaxed);
    return status;
  };
  counters_.pieces.fetch_add(1, std::memory_order_relaxed);
  if (!begin_scan(stream, piece.sensor, piece.stamp_ns)) return count_as(counters_.pieces_late, OVT_LATE);
  if (stream.is_refused) return count_as(counters_.pieces_dropped, OVT_TOO_MANY);

  const int64_t start = steady_now_ns();
  probe_stage_begin(-1, piece.sensor, OVT_STAGE_LOAD, piece.stamp_ns);
  const int32_t first = piece.first < 0 ? stream.builder.end() : piece.first;
  const ScanBuilder::Added added = stream.builder.add(*context_.kernels, fields_of(piece), first, piece.count,
                                                      mailboxes_[piece.sensor].writable().table);
  stream.load_ns += steady_now_ns() - start;
  probe_stage_end(-1, piece.sensor, OVT_STAGE_LOAD, piece.stamp_ns);
  if (Scan& scan = mailboxes_[piece.sensor].writable(); added == ScanBuilder::Added::kUsed && scan.early)
    stream.early.add(context_, scan.table, stream.builder.whole(), *scan.early);
  if (added == ScanBuilder::Added::kDuplicate) return count_as(counters_.pieces_dup, OVT_DUPLICATE);
  if (added == ScanBuilder::Added::kUsed) return count_as(counters_.pieces_used, OVT_OK);
  stream.is_refused = true;  // the whole scan, as by push_scan
  counters_.pushed.fetch_add(1, std::memory_order_relaxed);
  counters_.dropped.fetch_add(1, std::memory_order_relaxed);
  probe_drop(piece.sensor, piece.stamp_ns);
  return count_as(counters_.pieces_dropped, OVT_TOO_MANY);
}

ovt_status Detector::end_scan(int32_t sensor, int64_t stamp_ns, int32_t point_count) {
  const Turn turn(*this);
  if (!turn) return OVT_WRONG_THREAD;
  ScanStream& stream = streams_[sensor];
  const Hold hold(stream);
  if (!hold) return refuse_producer(stream);
  const bool is_open = stream.is_open && stamp_ns == stream.stamp_ns.load(std::memory_order_relaxed);
  if (is_open && !stream.is_refused && point_count >= 0 && point_count < stream.builder.end()) return OVT_BAD_ARGUMENT;
  if (!begin_scan(stream, sensor, stamp_ns)) return OVT_LATE;
  const bool is_refused = stream.is_refused;
  note_stamp(sensor, stamp_ns);
  close_scan(stream, sensor, true, point_count);
  return is_refused ? OVT_TOO_MANY : OVT_OK;
}

// Opens the scan of this stamp, unless it is open already. False if that scan is over.
bool Detector::begin_scan(ScanStream& stream, int32_t sensor, int64_t stamp_ns) {
  const int64_t open_ns = stream.stamp_ns.load(std::memory_order_relaxed);
  if (stream.is_open && stamp_ns == open_ns) return true;
  if (stream.is_recent(stamp_ns)) return false;
  if (stream.is_open) {
    const bool is_late = stamp_ns < open_ns && difference_ns(open_ns, stamp_ns) <= kReorder_ns;
    if (is_late && !stepped_ahead(stream, stamp_ns)) return false;
    if (is_late)
      give_up_scan(stream, sensor);
    else
      close_scan(stream, sensor, false, -1);
  }
  stream.is_open = true;
  stream.is_refused = false;
  stream.builder.begin();
  stream.load_start_ns = steady_now_ns();
  stream.load_ns = 0;
  Scan& scan = mailboxes_[sensor].writable();
  scan.table.count = 0;
  if (!scan.early && stream.early.is_built()) scan.early = stream.early_pool.take();
  if (scan.early) stream.early.begin(*scan.early);
  stream.stamp_ns.store(stamp_ns, std::memory_order_relaxed);
  SensorRhythm rhythm = stream.rhythm;
  rhythm.note_stamp(stamp_ns, longest_step_ns_);
  const int64_t interval_ns = std::max(rhythm.shortest_ns(), period_ns_);
  stream.limit_ns.store(int64_t(scan_limit_ * double(interval_ns) + 0.5), std::memory_order_relaxed);
  for (std::atomic<int64_t>& passed_ns : stream.passed_ns) passed_ns.store(0, std::memory_order_relaxed);
  return true;
}

// Whether the open scan has a wrong stamp: a single piece can carry one, and all pieces up to that time would be late.
// It is over three intervals newer than the last scan, and a scan comes that is nearer to the last one. Where two
// clocks deliver by turns, the first scan of the later clock that ends is the last one: the earlier clock's are late.
bool Detector::stepped_ahead(const ScanStream& stream, int64_t stamp_ns) const noexcept {
  if (!stream.last.any || stamp_ns <= stream.last.last_ns) return false;
  const int64_t ahead_ns = difference_ns(stream.stamp_ns.load(std::memory_order_relaxed), stream.last.last_ns);
  return ahead_ns > 3 * std::max(stream.rhythm.shortest_ns(), period_ns_) &&
         difference_ns(stamp_ns, stream.last.last_ns) <= ahead_ns / 2;
}

// Posts the open scan, whose stamp is wrong, as if it had not come: the scan that has this stamp may still come.
void Detector::give_up_scan(ScanStream& stream, int32_t sensor) {
  const LastStamp last = stream.last;
  const SensorRhythm rhythm = stream.rhythm;
  int64_t& recent_ns = stream.recent_ns[stream.recent_count % ScanStream::kRecent];
  const int64_t oldest_ns = recent_ns;
  close_scan(stream, sensor, false, -1);
  stream.last = last;
  stream.rhythm = rhythm;
  recent_ns = oldest_ns;
  --stream.recent_count;
}

// A step back by kReorder_ns is another time of the sensor's clock.
void Detector::note_closed(ScanStream& stream, int64_t stamp_ns) noexcept {
  if (stream.last.any && difference_ns(stream.last.last_ns, stamp_ns) >= kReorder_ns) stream.rhythm.forget_last();
  stream.last = {true, stamp_ns};
  stream.rhythm.note_stamp(stamp_ns, longest_step_ns_);
}

// Posts the open scan. `ended`: by its producer.
void Detector::close_scan(ScanStream& stream, int32_t sensor, bool ended, int32_t point_count) {
  const int64_t stamp_ns = stream.stamp_ns.load(std::memory_order_relaxed);
  stream.is_open = false;
  stream.note_recent(stamp_ns);
  Scan& scan = mailboxes_[sensor].writable();
  if (stream.is_refused) {
    if (scan.early) stream.early.drop(*scan.early);
    return;
  }
  note_closed(stream, stamp_ns);
  counters_.pushed.fetch_add(1, std::memory_order_relaxed);
  scan.pushed_ns = steady_now_ns();
  const ScanBuilder& builder = stream.builder;
  const int32_t missing = std::max(point_count, builder.end()) - builder.count();
  if (scan.early) {
    // A thread that closes another sensor's scan leaves the work to the workers; so does a scan with gaps.
    if (!ended || builder.has_gaps())
      stream.early.drop(*scan.early);
    else if (!stream.early.finish(context_, scan.table, *scan.early))
      counters_.row_orders_wrong.fetch_add(1, std::memory_order_relaxed);
  }
  if (builder.has_gaps()) stream.builder.close_gaps(scan.table);
  scan.is_incomplete = missing > 0 || !ended;
  if (scan.is_incomplete) {
    counters_.scans_incomplete.fetch_add(1, std::memory_order_relaxed);
    counters_.points_missing.fetch_add(missing, std::memory_order_relaxed);
    if (!ended) counters_.scans_unended.fetch_add(1, std::memory_order_relaxed);
  }
  scan.load = {stream.load_start_ns, stream.load_ns, this_worker()};
  if (push_waits_ && !inline_) mailboxes_[sensor].wait_until_acquired();
  post_scan(sensor, stamp_ns);
}

void Detector::post_scan(int32_t sensor, int64_t stamp_ns) {
  Mailbox<Scan>& box = mailboxes_[sensor];
  Scan& scan = box.writable();
  scan.stamp_ns = stamp_ns;
  scan.ticket = tickets_.fetch_add(1, std::memory_order_relaxed);
  scan.ego = ego_->range();
  if (box.post()) {
    counters_.dropped.fetch_add(1, std::memory_order_relaxed);
    probe_drop(sensor, box.writable().stamp_ns);  // writable() is the replaced scan after the exchange
  }
  tell_intake();
}

// Closes the open scans that are over. Leaves a stream alone whose producer is in a call: that scan goes on.
template <class IsOver>
void Detector::close_open_scans(IsOver&& is_over) {
  for (int32_t s = 0; s < context_.sensor_count; ++s) {
    ScanStream& stream = streams_[s];
    int32_t open = ScanStream::kFreeOpen;
    if (stream.owner.load(std::memory_order_relaxed) != open || !is_over(stream)) continue;
    if (!stream.owner.compare_exchange_strong(open, ScanStream::kCloser, std::memory_order_acq_rel)) continue;
    if (is_over(stream)) close_scan(stream, s, false, -1);
    // seq_cst: the store must come before notify_all looks for sleepers, on any CPU.
    stream.owner.store(stream.is_open ? ScanStream::kFreeOpen : ScanStream::kFree, std::memory_order_seq_cst);
    stream.owner.notify_all();
  }
}

// The stamps of this sensor's scans have come to stamp_ns. A step counts up to half of an open scan's limit: of a
// longer one (of a slow sensor, one that comes back, a wrong stamp) most may have passed before that scan began.
void Detector::note_stamp(int32_t sensor, int64_t stamp_ns) {
  ScanStream& stream = streams_[sensor];
  const LastStamp last = stream.last_noted;
  const int64_t step_ns = last.any ? difference_ns(stamp_ns, last.last_ns) : 0;
  if (step_ns < 0 && step_ns >= -longest_step_ns_) return;  // a late scan
  stream.last_noted = {true, stamp_ns};
  if (step_ns <= 0 || step_ns > longest_step_ns_) return;  // a gap, or a jump of its clock
  for (int32_t s = 0; s < context_.sensor_count; ++s) {
    const int64_t limit_ns = streams_[s].limit_ns.load(std::memory_order_relaxed);
    streams_[s].passed_ns[sensor].fetch_add(std::min(step_ns, (limit_ns + 1) / 2), std::memory_order_relaxed);
  }
  close_open_scans([&](const ScanStream& other) {
    const int64_t limit_ns = other.limit_ns.load(std::memory_order_relaxed);
    return limit_ns > 0 && other.passed_ns[sensor].load(std::memory_order_relaxed) >= limit_ns;
  });
}

void Detector::close_late_scans(int64_t now_ns) {
  close_open_scans([&](const ScanStream& stream) {
    const int64_t limit_ns = stream.limit_ns.load(std::memory_order_relaxed);
    return limit_ns > 0 && difference_ns(now_ns, stream.stamp_ns.load(std::memory_order_relaxed)) >= limit_ns;
  });
}

void Detector::close_all_scans() {
  close_open_scans([](const ScanStream&) { return true; });
}

}  // namespace overtake
