// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
#include "pipeline/detector.h"

#include <pthread.h>
#include <sched.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <new>
#include <system_error>

#include "core/math.h"

namespace overtake {
namespace {

int32_t usable_cpus() {
  cpu_set_t set;
  if (sched_getaffinity(0, sizeof set, &set) == 0) return std::max(1, CPU_COUNT(&set));
  return 1;
}

std::string field(const char* array, int32_t index, const char* name) {
  return std::string(array) + "[" + std::to_string(index) + "]." + name;
}

// The first thing wrong with a sensor's def, or null.
const char* find_bad_sensor_field(const ovt_sensor_def& def) {
  for (double v : {def.x_m, def.y_m, def.z_m})
    if (!(std::fabs(v) <= 1000.0)) return "x_m, y_m, z_m must be within 1000 m";
  for (double v : {def.roll_rad, def.pitch_rad, def.yaw_rad})
    if (!(std::fabs(v) <= 7.0)) return "roll_rad, pitch_rad, yaw_rad must be within +-7 rad";
  if (def.rows < 1 || def.rows > 1024) return "rows must be 1 to 1024";
  if (def.cols < 1 || def.cols > 16384) return "cols must be 1 to 16384";
  if (!(std::fabs(def.azimuth_left_rad) <= 7.0)) return "azimuth_left_rad must be within +-7 rad";
  if (!def.wraps && !(def.azimuth_right_rad < def.azimuth_left_rad &&
                      def.azimuth_left_rad - def.azimuth_right_rad <= 6.2831853071795873))
    return "azimuth_right_rad must be right of azimuth_left_rad by at most a full turn";
  if (!(def.range_min_m >= 0 && def.range_min_m < def.range_max_m && def.range_max_m <= 10000.0))
    return "range_min_m and range_max_m must satisfy 0 <= min < max <= 10000";
  if (def.layer_first < 0 || def.layer_last > 65535 || def.layer_first > def.layer_last)
    return "layer_first and layer_last must satisfy 0 <= first <= last <= 65535";
  if (def.point_capacity < 1 || def.point_capacity > 16'000'000) return "point_capacity must be 1 to 16,000,000";
  return nullptr;
}

}  // namespace

std::unique_ptr<Detector> Detector::create(const ovt_detector_def& def, ovt_status& status, std::string& error) {
  std::unique_ptr<Detector> detector(new Detector);
  status = detector->build(def, error);
  if (status != OVT_OK) return nullptr;
  return detector;
}

ovt_status Detector::build(const ovt_detector_def& def, std::string& error) {
  const auto bad = [&](const std::string& sentence) {
    error = sentence;
    return OVT_BAD_ARGUMENT;
  };
  if (def.sensor_count < 0 || def.sensor_count > OVT_MAX_SENSORS) return bad("sensor_count must be 0 to 8");
  if (def.sensor_count > 0 && !def.sensors) return bad("sensors is null");
  if (def.worker_count < 0 || def.worker_count > 256) return bad("worker_count must be 0 to 256");
  if (def.push_policy != OVT_PUSH_REPLACE && def.push_policy != OVT_PUSH_WAIT) return bad("push_policy is unknown");
  if (def.cluster_capacity < 1 || def.cluster_capacity > 1'000'000)
    return bad("cluster_capacity must be 1 to 1,000,000");
  if (def.candidate_capacity < 1 || def.candidate_capacity > 4096)
    return bad("candidate_capacity must be 1 to 4,096");
  if (def.track_capacity < 1 || def.track_capacity > 4096) return bad("track_capacity must be 1 to 4,096");
  if (def.frames_in_flight < 1 || def.frames_in_flight > 64) return bad("frames_in_flight must be 1 to 64");
  if (def.reader_capacity < 0 || def.reader_capacity > 64) return bad("reader_capacity must be 0 to 64");
  if (def.ego_pose_capacity < 1 || def.ego_pose_capacity > 1'000'000)
    return bad("ego_pose_capacity must be 1 to 1,000,000");
  if ((def.alloc == nullptr) != (def.free == nullptr)) return bad("alloc and free go together");

  ovt_params params = ovt_default_params();
  if (def.params) {
    if (def.params->struct_size != sizeof params) {
      error = "params.struct_size is unknown";
      return OVT_BAD_VERSION;
    }
    params = *def.params;
  }
  if (const char* name = find_bad_param(params)) {
    error = std::string("parameter ") + name + " is outside its limits";
    return OVT_OUT_OF_RANGE;
  }
  context_.kernels = find_kernels(def.isa);
  if (!context_.kernels) {
    error = std::string("isa \"") + def.isa + "\" is unknown or this CPU lacks it";
    return OVT_UNKNOWN_NAME;
  }

  context_.sensor_count = def.sensor_count;
  for (int32_t s = 0; s < def.sensor_count; ++s) {
    const ovt_sensor_def& in = def.sensors[s];
    if (in.struct_size != sizeof in) {
      error = field("sensors", s, "struct_size is unknown");
      return OVT_BAD_VERSION;
    }
    if (const char* wrong = find_bad_sensor_field(in)) return bad(field("sensors", s, wrong));
    SensorModel& model = context_.sensors[s];
    model = make_sensor_model(in.rows, in.cols, in.azimuth_left_rad, in.azimuth_right_rad, in.wraps != 0,
                              in.range_min_m, in.range_max_m);
    model.layer_first = in.layer_first;
    model.layer_last = in.layer_last;
    model.T_vehicle_sensor = make_transform(in.x_m, in.y_m, in.z_m, in.roll_rad, in.pitch_rad, in.yaw_rad);
    model.mounting_yaw_rad = float(wrap_angle(in.yaw_rad));
    context_.segment[s] = make_segment_params(params, model);
    point_capacity_[s] = in.point_capacity;
  }
  context_.detect = make_detect_params(params);

  if (def.map) {
    const ovt_map_def& m = *def.map;
    if (m.struct_size != sizeof m) {
      error = "map.struct_size is unknown";
      return OVT_BAD_VERSION;
    }
    const char* wrong = nullptr;
    bool good = false;
    if (m.left_x_m || m.right_x_m) {
      if (!m.left_x_m || !m.left_y_m || !m.right_x_m || !m.right_y_m) return bad("map: a column of a bound is null");
      good = map_.build_from_bounds(m.left_x_m, m.left_y_m, m.left_count, m.right_x_m, m.right_y_m, m.right_count,
                                    m.closed != 0, &wrong);
    } else {
      if (!m.x_m || !m.y_m || !m.width_left_m || !m.width_right_m) return bad("map: a column is null");
      good = map_.build(m.x_m, m.y_m, m.width_left_m, m.width_right_m, m.banking_rad, m.count, m.closed != 0, &wrong);
    }
    if (!good) return bad(std::string("map: ") + wrong);
    context_.map = &map_;
  }

  user_ = def.user;
  on_frame_ = def.on_frame;
  log_ = def.log;
  push_waits_ = def.push_policy == OVT_PUSH_WAIT;
  allocator_ = default_allocator();
  if (def.alloc) allocator_ = {def.alloc, def.free, def.user};

  const auto no_memory = [&](const char* what) {
    error = std::string("no memory for ") + what;
    return OVT_NO_MEMORY;
  };
  tracker_params_ = make_tracker_params(params, def.track_capacity, def.candidate_capacity);
  FrameSizes sizes;
  sizes.sensors = context_.sensors;
  sizes.point_capacity = point_capacity_;
  sizes.sensor_count = context_.sensor_count;
  sizes.cluster_capacity = def.cluster_capacity;
  sizes.candidate_capacity = def.candidate_capacity;
  sizes.track_capacity = def.track_capacity;
  sizes.external_capacity = def.candidate_capacity;
  sizes.merge_columns = params.merge_columns;
  const int32_t workers = def.worker_count == 0 ? usable_cpus() : def.worker_count;
  inline_ = workers == 1;
  reader_capacity_ = def.reader_capacity;
  const int32_t slots = (inline_ ? 1 : def.frames_in_flight) + 1 + def.reader_capacity;  // + the latest
  if (!pool_.build(slots, sizes, allocator_)) return no_memory("frames");
  for (int32_t s = 0; s < context_.sensor_count; ++s)
    if (!mailboxes_[s].build(point_capacity_[s], allocator_)) return no_memory("mailboxes");
  if (!external_arena_.build(allocator_,
                             [&](Carver& carver) { carve_table(carver, external_.rows, def.candidate_capacity); }))
    return no_memory("pushed detections");

  ego_ = std::make_unique<EgoBuffer>(def.ego_pose_capacity);
  track_stage_ = std::make_unique<TrackStage>(context_, tracker_params_);
  if (const ovt_status status = build_reader(lent_); status != OVT_OK) return no_memory("the callback's reader");
  lent_.lent = true;

  RunnerHooks hooks;
  hooks.finish = [this](Frame& frame) { finish(frame); };
  hooks.caught = [this] {
    counters_.exceptions.fetch_add(1, std::memory_order_relaxed);
    log(OVT_LOG_ERROR, "an exception was caught in a stage; its frame goes on with what it has");
  };
  if (inline_) {
    runner_ = std::make_unique<InlineRunner>(context_, *track_stage_, std::move(hooks));
  } else {
    runner_ = std::make_unique<DetectorGraph>(workers, context_, *track_stage_, std::move(hooks));
  }
  AssemblerParams assembly;
  assembly.sensor_count = context_.sensor_count;
  const auto to_ns = [](double seconds) { return int64_t(seconds * 1e9 + 0.5); };
  assembly.period_ns = to_ns(params.frame_period_s);
  assembly.tolerance_ns = to_ns(params.frame_tolerance_s);
  assembly.wait_ns = to_ns(1.5 * params.frame_period_s);
  assembly.predict_after_ns = to_ns(params.tracker_predict_after * params.frame_period_s);
  assembler_ = std::make_unique<FrameAssembler>(assembly, pool_, *ego_, *runner_);
  if (!inline_) {
    pool_.set_event(&event_);
    try {
      intake_ = std::thread([this] { run_intake(); });
    } catch (const std::system_error&) {
      error = "the system refused a thread";
      return OVT_NO_THREADS;
    }
    pthread_setname_np(intake_.native_handle(), "ovt-intake");
  }
  runtime_.isa = context_.kernels->isa;
  runtime_.worker_count = workers;
  const std::string workers_text = std::to_string(workers) + (workers == 1 ? " worker" : " workers");
  log(OVT_LOG_INFO, ("isa " + std::string(context_.kernels->isa) + ", " + workers_text).c_str());
  if (!context_.map) log(OVT_LOG_WARNING, "no map: no map gate, psi_REF is the ego heading");
  return OVT_OK;
}

void Detector::log(ovt_log_level level, const char* text) const noexcept {
  try {
    if (log_) log_(level, text, user_);
  } catch (...) {  // the caller's own, and there is nobody to tell
  }
}

Detector::~Detector() { stop(); }

void Detector::stop() {
  if (intake_.joinable()) {
    stop_.store(true, std::memory_order_release);
    event_.signal();
    intake_.join();
  }
  if (assembler_) assembler_->flush();
  assembler_.reset();
  runner_.reset();  // waits for the frames under way
}

void Detector::destroy(Detector* detector) {
  detector->stop();
  detector->closed_.store(true, std::memory_order_release);
  detector->drop_owner();
}

void Detector::drop_owner() {
  if (owners_.fetch_sub(1, std::memory_order_acq_rel) == 1) delete this;
}

// ---- producers ----------------------------------------------------------------------------------------------------

ovt_status Detector::push_scan(const ovt_points& points) {
  if (points.count > point_capacity_[points.sensor]) return OVT_TOO_MANY;
  counters_.pushed.fetch_add(1, std::memory_order_relaxed);
  const int32_t s = points.sensor;
  Stamp& last = last_stamp_[s];
  if (last.any && points.stamp_ns == last.last_ns) {
    counters_.dup.fetch_add(1, std::memory_order_relaxed);
    return OVT_DUPLICATE;
  }
  if (last.any && points.stamp_ns < last.last_ns) {
    counters_.late.fetch_add(1, std::memory_order_relaxed);
    return OVT_LATE;
  }
  last = {true, points.stamp_ns};

  Mailbox& box = mailboxes_[s];
  if (push_waits_ && !inline_) box.wait_until_taken();
  Scan& scan = box.writable();
  const int64_t start = steady_now_ns();
  const auto as_field = [](const ovt_column& c) {
    return PointField{c.data, std::ptrdiff_t(c.stride), FieldType(c.type)};
  };
  const PointFields fields = {as_field(points.x),         as_field(points.y),     as_field(points.z),
                              as_field(points.intensity), as_field(points.layer), as_field(points.time),
                              points.time_unit_ns};
  context_.kernels->load_points(fields, points.count, scan.table);
  scan.load = {start, steady_now_ns() - start, this_worker()};
  scan.stamp_ns = points.stamp_ns;
  scan.ego_count = ego_->count();
  if (box.post()) counters_.dropped.fetch_add(1, std::memory_order_relaxed);
  if (inline_) {
    while (step_intake()) {
    }
  } else {
    event_.signal();
  }
  return OVT_OK;
}

ovt_status Detector::push_ego_pose(const ovt_ego_pose& in) {
  const ovt_status status = ego_->push(
      {in.stamp_ns, in.x_m, in.y_m, in.z_m, in.roll_rad, in.pitch_rad, in.yaw_rad, in.speed_mps, in.yaw_rate_rps});
  (status == OVT_OK ? counters_.ego_poses : counters_.ego_dropped).fetch_add(1, std::memory_order_relaxed);
  return status;
}

ovt_status Detector::push_detections(const ovt_external_detections& in) {
  if (in.count > external_.rows.capacity) return OVT_TOO_MANY;
  if (last_external_.any && in.stamp_ns <= last_external_.last_ns) {
    counters_.external_dropped.fetch_add(1, std::memory_order_relaxed);
    return in.stamp_ns == last_external_.last_ns ? OVT_DUPLICATE : OVT_LATE;
  }
  last_external_ = {true, in.stamp_ns};
  while (external_.waiting.load(std::memory_order_acquire)) external_.waiting.wait(true, std::memory_order_acquire);
  const auto copy = [&](const double* from, double* to) {
    for (int32_t i = 0; i < in.count; ++i) to[i] = from ? from[i] : std::nan("");
  };
  ExternalTable& rows = external_.rows;
  rows.count = in.count;
  copy(in.x_m, rows.x_m);
  copy(in.y_m, rows.y_m);
  copy(in.heading_rad, rows.heading_rad);
  copy(in.var_x, rows.var_x);
  copy(in.var_y, rows.var_y);
  copy(in.cov_xy, rows.cov_xy);
  external_.stamp_ns = in.stamp_ns;
  external_.reference = in.reference;
  external_.ego_count = ego_->count();
  external_.waiting.store(true, std::memory_order_release);
  if (inline_) {
    while (step_intake()) {
    }
  } else {
    event_.signal();
  }
  return OVT_OK;
}

ovt_status Detector::advance(int64_t now_ns) {
  if (inline_) {
    assembler_->advance(now_ns);
    return OVT_OK;
  }
  advance_ns_.store(now_ns, std::memory_order_relaxed);
  const uint64_t ticket = advance_wanted_.fetch_add(1, std::memory_order_acq_rel) + 1;
  event_.signal();
  if (push_waits_)  // replay: nothing pushed later may overtake it
    for (uint64_t done; (done = advance_done_.load(std::memory_order_acquire)) < ticket;) advance_done_.wait(done);
  return OVT_OK;
}

ovt_status Detector::flush() {
  if (inline_) {
    assembler_->flush();
    return OVT_OK;
  }
  const uint64_t ticket = flush_wanted_.fetch_add(1, std::memory_order_acq_rel) + 1;
  event_.signal();
  for (uint64_t done; (done = flush_done_.load(std::memory_order_acquire)) < ticket;) flush_done_.wait(done);
  return OVT_OK;
}

// ---- intake ---------------------------------------------------------------------------------------------------------

void Detector::run_intake() {
  for (;;) {
    const uint32_t seen = event_.look();
    if (stop_.load(std::memory_order_acquire)) return;
    while (step_intake()) {
    }
    event_.wait(seen);
  }
}

// Takes what waits in hand until a pass over all boxes finds nothing new: then everything that was pushed before
// anything in hand is in hand as well, and the smallest stamp is really the next.
void Detector::gather() {
  for (bool found = true; found;) {
    found = false;
    if (!external_.in_hand && external_.waiting.load(std::memory_order_acquire)) found = external_.in_hand = true;
    for (int32_t s = 0; s < context_.sensor_count; ++s) {
      Mailbox& box = mailboxes_[s];
      if (box.in_hand() && push_waits_) continue;
      bool replaced = false;
      if (box.take(replaced)) {
        found = true;
        if (replaced) counters_.dropped.fetch_add(1, std::memory_order_relaxed);
      }
    }
  }
}

bool Detector::step_intake() {
  // Tickets first: whatever was pushed before a ticket was drawn is then gathered, and done before the ticket is.
  const uint64_t advance_wanted = advance_wanted_.load(std::memory_order_acquire);
  const uint64_t flush_wanted = flush_wanted_.load(std::memory_order_acquire);
  gather();
  int32_t next = -1;
  int64_t stamp = INT64_MAX;
  for (int32_t s = 0; s < context_.sensor_count; ++s)
    if (const Scan* scan = mailboxes_[s].in_hand(); scan && (next < 0 || scan->stamp_ns < stamp)) {
      next = s;
      stamp = scan->stamp_ns;
    }
  if (external_.in_hand && (next < 0 || external_.stamp_ns < stamp)) {
    const Taken taken =
        assembler_->take_external(external_.stamp_ns, external_.reference, external_.ego_count, external_.rows);
    if (taken == Taken::kNoSlot) return false;
    (taken == Taken::kUsed ? counters_.external : counters_.external_dropped).fetch_add(1, std::memory_order_relaxed);
    external_.in_hand = false;
    external_.waiting.store(false, std::memory_order_release);
    external_.waiting.notify_all();
    return true;
  }
  if (next >= 0) {
    Mailbox& box = mailboxes_[next];
    const Taken taken = assembler_->take_scan(next, *box.in_hand());
    if (taken == Taken::kNoSlot) return false;
    (taken == Taken::kUsed ? counters_.used : counters_.late).fetch_add(1, std::memory_order_relaxed);
    box.drop_hand();
    return true;
  }
  if (inline_) return false;

  if (advance_wanted != advance_done_.load(std::memory_order_relaxed)) {
    if (!assembler_->advance(advance_ns_.load(std::memory_order_relaxed))) return false;
    advance_done_.store(advance_wanted, std::memory_order_release);
    advance_done_.notify_all();
    return true;
  }
  if (flush_wanted != flush_done_.load(std::memory_order_relaxed)) {
    assembler_->flush();
    if (assembler_->admitted() != counters_.frames.load(std::memory_order_acquire)) return false;
    flush_done_.store(flush_wanted, std::memory_order_release);
    flush_done_.notify_all();
    return true;
  }
  return false;
}

// ---- finished frames -----------------------------------------------------------------------------------------------

void Detector::finish(Frame& frame) {
  const auto add = [](std::atomic<int64_t>& counter, int64_t n) { counter.fetch_add(n, std::memory_order_relaxed); };
  int64_t points = 0, valid = 0;
  for (int32_t s = 0; s < context_.sensor_count; ++s) {
    SensorPart& part = frame.sensors[s];
    if (!part.present) continue;
    int64_t bad = 0;
    for (int32_t r = 1; r < kReasonCount; ++r) {
      add(counters_.points_bad[r], part.reason_count[r]);
      if (r < int32_t(Reason::kDust)) bad += part.reason_count[r];
    }
    points += part.points.count;
    valid += part.points.count - bad;
    if (2 * bad > part.points.count) frame.flags |= OVT_FLAG_CLOUD_DEGRADED;
    add(counters_.overflow_clusters, part.cluster_overflow);
    if (part.cluster_overflow) frame.flags |= OVT_FLAG_OVERFLOW;
  }
  add(counters_.points, points);
  if (frame.kind == FrameKind::kScans && valid == 0) frame.flags |= OVT_FLAG_NO_DATA;
  add(counters_.overflow_clusters, frame.merged_overflow);
  add(counters_.overflow_candidates, frame.candidate_overflow);
  if (frame.merged_overflow || frame.candidate_overflow) frame.flags |= OVT_FLAG_OVERFLOW;
  const int64_t track_overflow = track_stage_->tracker().counts().overflow;
  if (counters_.overflow_tracks.exchange(track_overflow, std::memory_order_relaxed) != track_overflow)
    frame.flags |= OVT_FLAG_OVERFLOW;

  if (on_frame_) {
    lent_.frame = &frame;
    try {
      on_frame_(reinterpret_cast<ovt_reader*>(&lent_), user_);
    } catch (...) {
      add(counters_.exceptions, 1);
      log(OVT_LOG_ERROR, "on_frame threw an exception");
    }
    lent_.frame = nullptr;
  }
  pool_.publish(&frame);
  counters_.frames.fetch_add(1, std::memory_order_release);
  event_.signal();
}

// ---- readers --------------------------------------------------------------------------------------------------------

ovt_status Detector::build_reader(Reader& reader) {
  reader.detector = this;
  const int32_t tracks = tracker_params_.track_capacity;
  const int32_t path_points = track_stage_->tracker().path_points();
  const bool built = reader.arena.build(allocator_, [&](Carver& carver) {
    carve_table(carver, reader.tracks, tracks);
    carve_table(carver, reader.paths, round_up(tracks, kRowAlign) * path_points);
  });
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
  if (reader->frame) pool_.release(reader->frame);
  delete reader;
  reader_count_.fetch_sub(1);
  drop_owner();
}

ovt_status Detector::next_frame(Reader& reader) {
  if (reader.lent || closed_.load(std::memory_order_acquire)) return OVT_NO_FRAME;
  if (pool_.latest_sequence() <= reader.seen_sequence) return OVT_NO_FRAME;
  if (reader.frame) pool_.release(reader.frame);  // first: a reader never holds two slots
  reader.frame = pool_.pin_latest();
  reader.seen_sequence = reader.frame->sequence;
  return OVT_OK;
}

void Detector::publish_tracks(Reader& reader, int64_t publish_ns) {
  overtake::publish_tracks(tracker_params_, reader.frame->tracks, publish_ns, reader.tracks, &reader.paths);
}

void Detector::read_stats(ovt_stats& out) const {
  const auto get = [](const std::atomic<int64_t>& counter) { return counter.load(std::memory_order_relaxed); };
  out.pushed = get(counters_.pushed);
  out.used = get(counters_.used);
  out.dropped = get(counters_.dropped);
  out.late = get(counters_.late);
  out.dup = get(counters_.dup);
  out.frames = get(counters_.frames);
  out.points = get(counters_.points);
  std::fill(std::begin(out.points_bad), std::end(out.points_bad), int64_t(0));
  for (int32_t r = 0; r < kReasonCount; ++r) out.points_bad[r] = get(counters_.points_bad[r]);
  out.overflow_clusters = get(counters_.overflow_clusters);
  out.overflow_candidates = get(counters_.overflow_candidates);
  out.overflow_tracks = get(counters_.overflow_tracks);
  out.exceptions = get(counters_.exceptions);
  out.deadline_missed = 0;
  out.clock_jumps = 0;
  out.ego_poses = get(counters_.ego_poses);
  out.ego_dropped = get(counters_.ego_dropped);
  out.external = get(counters_.external);
  out.external_dropped = get(counters_.external_dropped);
}

}  // namespace overtake
