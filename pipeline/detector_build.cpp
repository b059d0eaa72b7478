// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// Create: checks the whole def before it allocates anything, then allocates all memory and starts all threads.
#include <sys/mman.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <stdexcept>
#include <string>
#include <system_error>

#include "core/math.h"
#include "pipeline/abi.h"
#include "pipeline/detector.h"
#include "pipeline/early_segment.h"
#include "pipeline/method/methods.h"

namespace overtake {
namespace {

std::string field(const char* array, int32_t index, const char* name) {
  return std::string(array) + "[" + std::to_string(index) + "]." + name;
}

// Of a sensor's z axis, upwards in the vehicle frame: rows are ordered and ground is searched from below.
constexpr float kLeastUp = 0.1f;
constexpr double kLeastColumn_rad = 1e-6;

// The error message for the first wrong field of a def, but its sensors, parameters and map; or "".
std::string find_bad_field(const ovt_detector_def& def) {
  if (def.sensor_count < 0 || def.sensor_count > OVT_MAX_SENSORS) return "sensor_count must be 0 to 8";
  if (def.sensor_count > 0 && !def.sensors) return "sensors is null";
  if (def.worker_count < 0 || def.worker_count > 256) return "worker_count must be 0 to 256";
  if (def.push_policy != OVT_PUSH_REPLACE && def.push_policy != OVT_PUSH_WAIT) return "push_policy is unknown";
  if (def.cluster_capacity < 1 || def.cluster_capacity > 1'000'000) return "cluster_capacity must be 1 to 1,000,000";
  if (def.candidate_capacity < 1 || def.candidate_capacity > 4096) return "candidate_capacity must be 1 to 4,096";
  if (def.track_capacity < 1 || def.track_capacity > 4096) return "track_capacity must be 1 to 4,096";
  if (def.frames_in_flight < 1 || def.frames_in_flight > 64) return "frames_in_flight must be 1 to 64";
  if (def.reader_capacity < 0 || def.reader_capacity > 64) return "reader_capacity must be 0 to 64";
  if (def.ego_pose_capacity < 1 || def.ego_pose_capacity > 1'000'000) return "ego_pose_capacity must be 1 to 1,000,000";
  if ((def.alloc == nullptr) != (def.free == nullptr)) return "alloc and free go together";
  if (def.cpu_count < 0 || def.cpu_count > 1024 || (def.cpu_count > 0) != (def.cpus != nullptr))
    return "cpus and cpu_count go together: 1 to 1,024 CPUs, or none";
  for (int32_t i = 0; i < def.cpu_count; ++i)
    if (!is_usable_cpu(def.cpus[i]))
      return "cpus[" + std::to_string(i) + "]: this process may not use CPU " + std::to_string(def.cpus[i]);
  if (def.fifo_priority < 0 || def.fifo_priority > 99) return "fifo_priority must be 0 to 99";
  if (def.memory & ~(OVT_MEMORY_LOCK | OVT_MEMORY_HUGE | OVT_MEMORY_LOCK_PROCESS)) return "memory has an unknown bit";
  if (def.spin_us < 0 || def.spin_us > 1'000'000) return "spin_us must be 0 to 1,000,000";
  if (def.deadline_ns < 0) return "deadline_ns must be 0 or more";
  if (def.watchdog_ns < 0) return "watchdog_ns must be 0 or more";
  return "";
}

// The error message for the first wrong field of a sensor's def, or null.
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
  if (!def.wraps && !(def.azimuth_left_rad - def.azimuth_right_rad >= kLeastColumn_rad * def.cols))
    return "azimuth_right_rad must be right of azimuth_left_rad by at least 1e-6 rad for each column";
  if (!(def.range_min_m >= 0 && def.range_min_m < def.range_max_m && def.range_max_m <= 10000.0))
    return "range_min_m and range_max_m must satisfy 0 <= min < max <= 10000";
  if (def.layer_first < 0 || def.layer_last > 65535 || def.layer_first > def.layer_last)
    return "layer_first and layer_last must satisfy 0 <= first <= last <= 65535";
  if (def.point_capacity < 1 || def.point_capacity > 16'000'000) return "point_capacity must be 1 to 16,000,000";
  if (!std::isnan(def.compensated_to_s) && !(std::fabs(def.compensated_to_s) <= 1.0))
    return "compensated_to_s must be NaN or within +-1 s";
  return nullptr;
}

// Element i of the caller's array, whose elements have the size of the caller's struct.
const ovt_sensor_def& sensor_at(const ovt_detector_def& def, int32_t i) {
  const char* first = reinterpret_cast<const char*>(def.sensors);
  return *reinterpret_cast<const ovt_sensor_def*>(first + std::size_t(i) * def.sensors[0].struct_size);
}

// The caller's alloc and free, which must outlive this one. An exception of alloc counts as no memory.
Allocator catching(Allocator& callers) {
  Allocator out;
  out.allocate = [](size_t bytes, size_t alignment, void* user) -> void* {
    const Allocator& to = *static_cast<const Allocator*>(user);
    try {
      return to.allocate(bytes, alignment, to.user);
    } catch (...) {
      return nullptr;
    }
  };
  out.release = [](void* block, size_t bytes, void* user) {
    const Allocator& to = *static_cast<const Allocator*>(user);
    to.release(block, bytes, to.user);
  };
  out.user = &callers;
  return out;
}

std::string count_of(int32_t obtained, int32_t wanted) {
  return std::to_string(obtained) + " of " + std::to_string(wanted);
}

}  // namespace

std::unique_ptr<Detector> Detector::create(const ovt_detector_def& def, ovt_status& status, std::string& error) {
  std::unique_ptr<Detector> detector(new Detector);
  status = detector->build(def, error);
  if (status != OVT_OK) return nullptr;
  return detector;
}

ovt_status Detector::build(const ovt_detector_def& def, std::string& error) {
  if (error = find_bad_field(def); !error.empty()) return OVT_BAD_ARGUMENT;
  ovt_params params = ovt_default_params();
  if (def.params && !take(*def.params, params)) {
    error = "params.struct_size is unknown";
    return OVT_BAD_VERSION;
  }
  context_.method = find_method(params.method ? params.method : kPaper.name);
  if (!context_.method) {
    error = "params.method \"" + std::string(params.method) + "\" is unknown (there is: " + join_method_names() + ")";
    return OVT_UNKNOWN_NAME;
  }
  if (const std::string wrong = find_bad_param(params); !wrong.empty()) {
    error = "parameter " + wrong;
    return OVT_OUT_OF_RANGE;
  }
  user_ = def.user;
  on_frame_ = def.on_frame;
  log_ = def.log;
  push_waits_ = def.push_policy == OVT_PUSH_WAIT;
  deadline_ns_ = def.deadline_ns;
  watchdog_ns_ = def.watchdog_ns;
  scan_limit_ = params.frame_scan_limit;
  period_ns_ = int64_t(params.frame_period_s * 1e9 + 0.5);
  longest_step_ns_ = std::max(kMaxGapNs, 3 * period_ns_);
  spin_ns_ = int64_t(def.spin_us) * 1000;
  reader_capacity_ = def.reader_capacity;
  // A default is at least 2: worker_count 1 has different threading rules.
  worker_count_ =
      def.worker_count > 0 ? def.worker_count : std::max(def.cpu_count > 0 ? def.cpu_count : count_usable_cpus(), 2);
  inline_ = worker_count_ == 1;
  callers_ = {def.alloc, def.free, def.user};
  memory_.set_up(def.alloc ? catching(callers_) : Allocator{}, def.memory);

  ovt_status status = build_context(def, params, error);
  if (status == OVT_OK) status = build_tables(def, params, error);
  if (status == OVT_OK) status = build_runner(def, params, error);
  if (status != OVT_OK) return status;
  process_locked_ = (def.memory & OVT_MEMORY_LOCK_PROCESS) && mlockall(MCL_CURRENT | MCL_FUTURE) == 0;
  (void)steady_now_ns();  // the first read of the kernel's clock page faults; no memory lock prevents it
  log_granted(def);
  return OVT_OK;
}

// Sensors, parameters, map, kernels: everything constant.
ovt_status Detector::build_context(const ovt_detector_def& def, const ovt_params& params, std::string& error) {
  const auto bad = [&](const std::string& sentence) {
    error = sentence;
    return OVT_BAD_ARGUMENT;
  };
  context_.kernels = find_kernels(def.isa);
  if (!context_.kernels) {
    error = std::string("isa \"") + def.isa + "\" is unknown or this CPU lacks it";
    return OVT_UNKNOWN_NAME;
  }
  context_.sensor_count = def.sensor_count;
  for (int32_t s = 0; s < def.sensor_count; ++s) {
    ovt_sensor_def in = ovt_default_sensor_def();
    const ovt_sensor_def& given = sensor_at(def, s);
    if (given.struct_size != def.sensors[0].struct_size || !take(given, in)) {
      error = field("sensors", s, "struct_size is unknown");
      return OVT_BAD_VERSION;
    }
    if (const char* wrong = find_bad_sensor_field(in)) return bad(field("sensors", s, wrong));
    SensorModel& model = context_.sensors[s];
    model = make_sensor_model(in.rows, in.cols, in.azimuth_left_rad, in.azimuth_right_rad, in.wraps != 0,
                              in.range_min_m, in.range_max_m);
    model.layer_first = in.layer_first;
    model.layer_last = in.layer_last;
    model.is_compensated = !std::isnan(in.compensated_to_s);
    if (model.is_compensated) model.compensated_to_ns = int64_t(std::llround(in.compensated_to_s * 1e9));
    model.T_vehicle_sensor = make_transform(in.x_m, in.y_m, in.z_m, in.roll_rad, in.pitch_rad, in.yaw_rad);
    if (!(model.T_vehicle_sensor.r[8] > kLeastUp))
      return bad(
          field("sensors", s, "roll_rad and pitch_rad turn its z axis down: push turned points of an inverted sensor"));
    model.mounting_yaw_rad = float(wrap_angle(in.yaw_rad));
    context_.segment[s] = make_segment_params(params, model);
    point_capacity_[s] = in.point_capacity;
  }
  context_.detect = make_detect_params(params);
  context_.candidate_capacity = def.candidate_capacity;
  return def.map ? build_map(*def.map, error) : OVT_OK;
}

ovt_status Detector::build_map(const ovt_map_def& given, std::string& error) {
  const auto bad = [&](const std::string& sentence) {
    error = sentence;
    return OVT_BAD_ARGUMENT;
  };
  ovt_map_def m = ovt_default_map_def();
  if (!take(given, m)) {
    error = "map.struct_size is unknown";
    return OVT_BAD_VERSION;
  }
  const char* wrong = nullptr;
  MapPoint point;
  bool good = false;
  if ((m.x_m || m.y_m || m.width_left_m || m.width_right_m) && (m.left_x_m || m.right_x_m))
    return bad("map: it has a centre line (x_m to width_right_m) and bounds (left_x_m, right_x_m)");
  if (m.left_x_m || m.right_x_m) {
    if (!m.left_x_m || !m.left_y_m || !m.right_x_m || !m.right_y_m) return bad("map: a column of a bound is null");
    good = map_.build_from_bounds(m.left_x_m, m.left_y_m, m.left_count, m.right_x_m, m.right_y_m, m.right_count,
                                  m.closed != 0, &wrong, &point);
  } else {
    if (!m.x_m || !m.y_m || !m.width_left_m || !m.width_right_m) return bad("map: a column is null");
    good = map_.build(m.x_m, m.y_m, m.width_left_m, m.width_right_m, m.banking_rad, m.count, m.closed != 0, &wrong,
                      &point);
  }
  if (!good) return bad("map: " + describe_fault(wrong, point));
  context_.map = &map_;
  return OVT_OK;
}

// Allocates all memory: frames, mailboxes, ego poses, tracker, the reader of on_frame.
ovt_status Detector::build_tables(const ovt_detector_def& def, const ovt_params& params, std::string& error) {
  const auto no_memory = [&](const char* what) {
    error = std::string("no memory for ") + what;
    return OVT_NO_MEMORY;
  };
  const Allocator allocator = memory_.allocator();
  tracker_params_ = make_tracker_params(params, def.track_capacity, def.candidate_capacity);
  tracker_params_.kernels = context_.kernels;
  track_stage_ = std::make_unique<TrackStage>(context_, tracker_params_, allocator);
  FrameSizes sizes;
  sizes.sensors = context_.sensors;
  sizes.point_capacity = point_capacity_;
  sizes.sensor_count = context_.sensor_count;
  sizes.cluster_capacity = def.cluster_capacity;
  sizes.candidate_capacity = def.candidate_capacity;
  sizes.track_capacity = def.track_capacity;
  sizes.track_state_bytes = track_stage_->tracker().state_bytes();
  sizes.external_capacity = def.candidate_capacity;
  sizes.merge_columns = params.merge_columns;
  sizes.method = context_.method;
  sizes.keep_images = def.keep_images != 0;
  const EarlyPlan early = def.stream ? plan_early(*context_.method) : EarlyPlan{};
  // In work; one more for a late scan while a frame waits for its sensors; the latest; and one for each reader.
  max_frames_ = (inline_ ? 1 : def.frames_in_flight) + 1;
  if (!pool_.build(max_frames_ + 1 + def.reader_capacity, max_frames_, sizes, allocator)) return no_memory("frames");
  const int32_t threads = inline_ ? 1 : worker_count_ + 1;  // the arena has a place for the intake
  scratch_.reset(new (std::nothrow) SegmentScratch[std::size_t(threads)]);
  if (!scratch_) return no_memory("the workers");
  const int32_t parts = std::min(params.segment_parts, worker_count_);
  for (int32_t i = 0; i < threads; ++i)
    if (!build_scratch(scratch_[std::size_t(i)], sizes, allocator, parts)) return no_memory("the workers");
  context_.scratch = scratch_.get();
  if (parts > 1) spare_ = std::make_unique<SpareWorkers>(threads, parts);
  context_.spare = spare_.get();
  for (int32_t s = 0; s < context_.sensor_count; ++s)
    if (!mailboxes_[s].build(scan_rows(point_capacity_[s]), allocator) ||
        !streams_[s].builder.build(point_capacity_[s], allocator) ||
        !streams_[s].early.build(*context_.method, early, context_.sensors[s], context_.segment[s], allocator))
      return no_memory("mailboxes");
  // One in each slot of the mailbox, and one in each frame in work. If none is free, because a scan is held, the work
  // of a scan begins with its end.
  const int32_t early_count = 3 + (inline_ ? 0 : max_frames_);
  for (int32_t s = 0; s < context_.sensor_count && early.steps > 0; ++s)
    if (!streams_[s].early_pool.build(early.columns, context_.sensors[s], point_capacity_[s], early_count, allocator))
      return no_memory("scans in pieces");
  if (!external_.build(def.candidate_capacity, allocator)) return no_memory("pushed detections");
  ego_ = std::make_unique<EgoBuffer>(def.ego_pose_capacity, allocator);
  if (build_reader(callback_reader_) != OVT_OK) return no_memory("the callback's reader");
  callback_reader_.is_callback_reader = true;
  return OVT_OK;
}

// Creates the runner and, unless worker_count is 1, its threads.
ovt_status Detector::build_runner(const ovt_detector_def& def, const ovt_params& params, std::string& error) {
  const auto no_thread = [&] {
    error = "the system refused a thread";
    return OVT_NO_THREADS;
  };
  ThreadSettings settings;
  settings.cpus.assign(def.cpus, def.cpus + def.cpu_count);
  settings.fifo_priority = def.fifo_priority;
  thread_setup_ = std::make_unique<ThreadSetup>(std::move(settings), worker_count_);
  RunnerHooks hooks;
  hooks.finish = [this](Frame& frame) { finish(frame); };
  hooks.caught = [this] {
    counters_.exceptions.fetch_add(1, std::memory_order_relaxed);
    log(OVT_LOG_ERROR, "an exception was caught in a stage; the frame continues without that stage's result");
  };
  if (inline_) {
    runner_ = std::make_unique<InlineRunner>(context_, *track_stage_, std::move(hooks));
  } else {
    GraphParams graph;
    graph.worker_count = worker_count_;
    graph.max_frames = max_frames_;
    graph.spin_ns = spin_ns_;
    try {
      runner_ = std::make_unique<DetectorGraph>(graph, *thread_setup_, context_, *track_stage_, std::move(hooks));
    } catch (const std::runtime_error&) {  // of oneTBB
      return no_thread();
    }
  }
  AssemblerParams assembly;
  assembly.sensor_count = context_.sensor_count;
  const auto to_ns = [](double seconds) { return int64_t(seconds * 1e9 + 0.5); };
  assembly.period_ns = to_ns(params.frame_period_s);
  assembly.tolerance_ns = to_ns(params.frame_tolerance_s);
  assembly.wait_ns = to_ns(1.5 * params.frame_period_s);
  assembly.predict_after_ns = to_ns(params.tracker_predict_after * params.frame_period_s);
  const bool reads_road = reads_column(*context_.method, Column::road);
  if (reads_road && !profile_.build(context_.map, memory_.allocator())) {
    error = "no memory for the height profile";
    return OVT_NO_MEMORY;
  }
  assembly.drops_repeats = reads_road;
  if (reads_road) pose_repair_.build();
  if (reads_road) bank_attitude_.build(context_.map);
  assembler_ = std::make_unique<FrameAssembler>(assembly, pool_, *ego_, *runner_, reads_road ? &profile_ : nullptr);
  if (!assembler_->build(point_capacity_, def.candidate_capacity, memory_.allocator())) {
    error = "no memory for held scans";
    return OVT_NO_MEMORY;
  }
  if (inline_) return OVT_OK;

  pool_.set_event(&event_);
  try {
    intake_ = std::thread([this] { runner_->host([this] { run_intake(); }); });
  } catch (const std::system_error&) {
    return no_thread();
  }
  start_state_.wait(kStarting, std::memory_order_acquire);
  const StartState state = start_state_.load(std::memory_order_acquire);
  if (state == kNoThread) return no_thread();
  if (state != kRunning) {
    error = "the graph could not be started";
    return OVT_NO_MEMORY;
  }
  if (runner_->workers() > 0) return OVT_OK;
  error = "oneTBB has no free thread: the process allows none (tbb::global_control) or other arenas use all";
  return OVT_NO_THREADS;
}

ovt_runtime_info Detector::runtime_info() const {
  ovt_runtime_info info{};
  info.isa = context_.kernels->isa;
  info.worker_count = runner_->workers();
  info.pinned = thread_setup_->pinned();
  info.fifo = thread_setup_->fifo();
  info.memory_bytes = memory_.bytes();
  info.locked_bytes = memory_.locked_bytes();
  info.huge_bytes = memory_.huge_bytes();
  info.process_locked = process_locked_ ? 1 : 0;
  return info;
}

void Detector::log_granted(const ovt_detector_def& def) const {
  const ovt_runtime_info info = runtime_info();
  log(OVT_LOG_INFO,
      ("isa " + std::string(info.isa) + ", " + std::to_string(info.worker_count) + (inline_ ? " worker" : " workers"))
          .c_str());
  if (info.worker_count < worker_count_)
    log(OVT_LOG_WARNING, ("workers: " + count_of(info.worker_count, worker_count_) +
                          " (the process allows oneTBB no more, or other arenas use them: tbb::global_control)")
                             .c_str());
  if (!context_.map) log(OVT_LOG_WARNING, "no map: no map gate, psi_REF is the ego heading");
  const int32_t threads = info.worker_count + 1;
  const auto tell = [&](bool whole, const std::string& text) {
    log(whole ? OVT_LOG_INFO : OVT_LOG_WARNING, text.c_str());
  };
  if (inline_ && (def.cpu_count > 0 || def.fifo_priority > 0))
    log(OVT_LOG_WARNING, "worker_count 1 starts no threads: cpus and fifo_priority have no effect");
  if (!inline_ && def.cpu_count > 0)
    tell(info.pinned == threads, "pinned to their CPUs: " + count_of(info.pinned, threads) + " threads");
  if (!inline_ && def.fifo_priority > 0)
    tell(info.fifo == threads,
         "SCHED_FIFO: " + count_of(info.fifo, threads) + " threads (needs CAP_SYS_NICE or a limit on rtprio)");
  const auto megabytes = [](int64_t bytes) { return std::to_string(bytes >> 20) + " MiB"; };
  if (def.memory & OVT_MEMORY_LOCK)
    tell(info.locked_bytes == info.memory_bytes,
         "locked: " + megabytes(info.locked_bytes) + " of " + megabytes(info.memory_bytes) + " (limit on memlock)");
  if (memory_.huge_refused_bytes() > 0)
    tell(false, "huge pages: refused for " + megabytes(memory_.huge_refused_bytes()));
  if (def.memory & OVT_MEMORY_LOCK_PROCESS)
    tell(process_locked_, process_locked_ ? "mlockall: the whole process" : "mlockall: refused (limit on memlock)");
}

}  // namespace overtake
