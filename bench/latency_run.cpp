// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// One period of the open loop, from one arrival to the next. Noise is measured at half time, the floor before it. Poses
// come 10 ms before the next arrival, or a fifth of the period before it if that is less. Pieces of the next scans come
// meanwhile:
//
//   |scans  ->  tracks  |floor |noise, caches emptied                |poses      |scans
//   due k                      due k + period / 2                                due k + 1
#include "bench/latency_run.h"

#include <algorithm>
#include <atomic>
#include <memory>
#include <thread>

#include "bench/floor.h"
#include "bench/measuring_thread.h"
#include "tools/client/pieces.h"
#include "tools/client/session.h"
#include "tools/io/error.h"

namespace overtake::bench {
namespace {

constexpr int64_t kStartAfterNs = 50'000'000;  // from the end of the set-up to the first period
constexpr double kScanShare = 0.9;             // of a period: the points of a scan in pieces
constexpr double kFloorAt = -0.6;              // periods from the arrival

struct DetectorHandle {
  ovt_detector* detector = nullptr;
  ~DetectorHandle() { ovt_destroy_detector(detector); }
};

class LatencyRunner {
 public:
  LatencyRunner(const LatencyInput& input, const LatencyRunDef& def)
      : input_(input), def_(def), frame_count_(def.warmup + def.frames) {
    run_.sensor_count = input.sensor_count();
    run_.frames.resize(std::size_t(frame_count_));
    run_.spans.resize(std::size_t(frame_count_) * (std::size_t(run_.sensor_count) + 1) * OVT_STAGE_COUNT,
                      ovt_span{0, -1, -1});
    for (int32_t k = 0; k < frame_count_; ++k)
      for (int32_t s = 0; s < run_.sensor_count; ++s)
        if (input.scan(k, s)) run_.frames[std::size_t(k)].expected_mask |= 1u << s;
    run_.rate_hz = def.rate_hz > 0 ? def.rate_hz : 1e9 / double(input.period_ns());
    period_ns_ = int64_t(1e9 / run_.rate_hz + 0.5);
    if (int64_t(def.stagger_us) * 1000 * (run_.sensor_count - 1) >= period_ns_)
      throw io::Error("--stagger-us", 0, "the last sensor's scan would come after the next frame's first");
  }

  LatencyRun run() {
    const std::vector<int32_t> usable = usable_cpus();
    for (int32_t cpu : def_.cpus)
      if (std::find(usable.begin(), usable.end(), cpu) == usable.end())
        throw io::Error("--cpus", 0, "CPU " + std::to_string(cpu) + " is not usable here");
    create_detector();
    NoiseDef noise_def;
    noise_def.cpus = def_.cpus.empty() ? usable : def_.cpus;
    noise_def.fifo_priority = def_.fifo_priority > 0 ? std::min(def_.fifo_priority + 1, 99) : 0;  // above our drivers
    noise_def.window_ns = def_.noise_window_ns;
    noise_def.tick_count = frame_count_;
    if (def_.cold) noise_def.evict_bytes = run_.evicted_bytes = largest_cache_bytes() * 5 / 4;
    noise_ = std::make_unique<NoiseFloor>(noise_def);
    run_.measuring_threads += int32_t(noise_def.cpus.size());

    def_.closed_loop ? run_closed() : run_open();
    run_.noise = noise_->take();
    run_.measuring_fifo += noise_->fifo_count();
    run_.stats = ovt_default_stats();
    cli::check(ovt_read_stats(handle_.detector, &run_.stats), "counters");
    if (failed_.load() != OVT_OK) cli::check(ovt_status(failed_.load()), "a push in the run");
    return std::move(run_);
  }

 private:
  void create_detector() {
    ovt_detector_def detector_def = ovt_default_detector_def();
    input_.fill(detector_def);
    detector_def.worker_count = def_.workers;
    detector_def.isa = def_.isa.empty() ? nullptr : def_.isa.c_str();
    ovt_params params = ovt_default_params();
    if (!def_.preset.empty())
      cli::check(ovt_params_init(&params, sizeof params, def_.preset.c_str()), "preset " + def_.preset);
    if (def_.parts > 0) params.segment_parts = def_.parts;
    detector_def.params = &params;
    detector_def.stream = def_.pieces > 0;
    detector_def.push_policy = OVT_PUSH_REPLACE;
    detector_def.cpus = def_.cpus.empty() ? nullptr : def_.cpus.data();
    detector_def.cpu_count = int32_t(def_.cpus.size());
    detector_def.fifo_priority = def_.fifo_priority;
    detector_def.spin_us = def_.spin_us;
    detector_def.memory = def_.memory;
    detector_def.keep_images = def_.keep_images;
    detector_def.deadline_ns = def_.deadline_ns;
    detector_def.on_frame = &LatencyRunner::on_frame;
    detector_def.user = this;
    char error[256] = "";
    const ovt_status status = ovt_create_detector_verbose(&detector_def, &handle_.detector, error, sizeof error);
    if (status != OVT_OK) throw io::Error("", 0, *error ? error : ovt_status_text(status));
    cli::check(ovt_read_runtime_info(handle_.detector, &run_.runtime), "what create obtained");
    run_.isa = run_.runtime.isa;
    run_.runtime.isa = nullptr;  // the string belongs to the detector, which is destroyed before the report
  }

  // The library calls this for frames in order, one call at a time.
  static void on_frame(ovt_reader* reader, void* self) {
    const int64_t published_ns = now_ns();
    auto& runner = *static_cast<LatencyRunner*>(self);
    ovt_frame_info info;
    if (ovt_read_info(reader, &info) != OVT_OK || info.sensor_mask == 0) return;
    const int64_t k = runner.input_.frame_of_stamp(info.first_stamp_ns);
    if (k < 0 || k >= runner.frame_count_) return;
    FrameSample& sample = runner.run_.frames[std::size_t(k)];
    const bool first = sample.parts++ == 0;  // a scan that came too late for its frame becomes a separate one
    sample.published_ns = published_ns;
    sample.sequence = info.sequence;
    sample.sensor_mask |= info.sensor_mask;
    sample.flags = info.flags;
    const int32_t sensors = runner.run_.sensor_count;
    ovt_span* span = &runner.run_.spans[std::size_t(k) * (std::size_t(sensors) + 1) * OVT_STAGE_COUNT];
    for (int32_t s = 0; s <= sensors; ++s)
      for (int32_t stage = 0; stage < OVT_STAGE_COUNT; ++stage, ++span)
        if (ovt_span read;
            ovt_read_span(reader, s < sensors ? s : -1, ovt_stage(stage), &read) == OVT_OK && read.duration_ns >= 0)
          *span = read;
    if (!first) return;
    runner.published_.fetch_add(1, std::memory_order_release);
    runner.published_.notify_all();
  }

  void push_poses(int64_t k, std::vector<ovt_ego_pose>& poses) {
    input_.poses(k, poses);
    for (const ovt_ego_pose& pose : poses) note(ovt_push_ego_pose(handle_.detector, &pose));
  }
  void push_scan(int64_t k, int32_t sensor) {
    const ReplayScan* scan = input_.scan(k, sensor);
    if (!scan) return;
    ovt_points points = scan->points;
    points.stamp_ns = input_.frame_stamp_ns(k) + scan->offset_ns;
    note(ovt_push_scan(handle_.detector, &points));
  }
  // Piece `piece` of a scan in pieces.
  void push_piece(int64_t k, int32_t sensor, int32_t piece) {
    const ReplayScan* scan = input_.scan(k, sensor);
    if (!scan) return;
    ovt_points points = scan->points;
    points.stamp_ns = input_.frame_stamp_ns(k) + scan->offset_ns;
    const auto cut = [&](int32_t i) { return int32_t(int64_t(points.count) * i / def_.pieces); };
    const ovt_points part = cli::piece_of(points, cut(piece), cut(piece + 1));
    note(ovt_push_points(handle_.detector, &part));
    if (piece + 1 == def_.pieces) note(ovt_end_scan(handle_.detector, sensor, points.stamp_ns, points.count));
  }
  // Twice: a scan's work begins in warm caches, too.
  void measure_floor() {
    segment_floor(floor_loops_, *floor_scan_);
    const int64_t start_ns = now_ns();
    segment_floor(floor_loops_, *floor_scan_);
    run_.floor_ns.push_back(now_ns() - start_ns);
  }
  void note(ovt_status status) {
    if (status != OVT_OK && status != OVT_DUPLICATE && status != OVT_LATE) failed_.store(status);
  }

  // Settings of a driver's thread: the workers' CPUs, one priority step above them.
  void become_driver(const char* name) {
    name_thread(name);
    if (!def_.cpus.empty()) run_on(def_.cpus);
    if (def_.fifo_priority > 0 && run_fifo(std::min(def_.fifo_priority + 1, 99))) fifo_drivers_.fetch_add(1);
  }

  int64_t due_ns(int64_t k, int32_t sensor) const {
    return start_ns_ + k * period_ns_ + int64_t(sensor) * def_.stagger_us * 1000;
  }

  // What a thread does for each frame, at a time from the arrival of sensor 0's scan.
  struct Event {
    int64_t at_ns;
    enum { poses, floor, scan, piece } what;
    int32_t sensor, piece_index;
  };
  std::vector<Event> list_others() const {
    return {{int64_t(kFloorAt * double(period_ns_)), Event::floor, 0, 0},
            {-std::min<int64_t>(10'000'000, period_ns_ / 5), Event::poses, 0, 0}};
  }
  void list_scan(int32_t sensor, std::vector<Event>& events) const {
    const int64_t due_ns = int64_t(sensor) * def_.stagger_us * 1000;
    if (def_.pieces == 0) events.push_back({due_ns, Event::scan, sensor, 0});
    for (int32_t i = 0; i < def_.pieces; ++i) {
      const double before = kScanShare * double(def_.pieces - 1 - i) / double(def_.pieces);
      events.push_back({due_ns - int64_t(before * double(period_ns_)), Event::piece, sensor, i});
    }
  }
  void drive(const char* name, std::vector<Event> events) {
    become_driver(name);
    std::stable_sort(events.begin(), events.end(), [](const Event& a, const Event& b) { return a.at_ns < b.at_ns; });
    std::vector<ovt_ego_pose> poses;
    for (int32_t k = 0; k < frame_count_; ++k)
      for (const Event& event : events) {
        sleep_until(due_ns(k, 0) + event.at_ns);
        if (event.what == Event::poses) push_poses(k, poses);
        if (event.what == Event::floor) measure_floor();
        if (event.what == Event::scan) push_scan(k, event.sensor);
        if (event.what == Event::piece) push_piece(k, event.sensor, event.piece_index);
      }
  }

  void choose_floor() {
    floor_scan_ = std::make_unique<FloorScan>(racecar_clouds()[0]);
    floor_loops_ = find_loops(def_.isa);
    run_.floor_ns.reserve(std::size_t(frame_count_));
  }

  void run_open() {
    choose_floor();
    start_ns_ = now_ns() + kStartAfterNs + period_ns_;
    for (int32_t k = 0; k < frame_count_; ++k) {
      FrameSample& sample = run_.frames[std::size_t(k)];
      for (int32_t s = 0; s < run_.sensor_count; ++s)
        if (sample.expected_mask >> s & 1) sample.due_ns = std::max(sample.due_ns, due_ns(k, s));
    }
    noise_->start_schedule(start_ns_ + period_ns_ / 2, period_ns_);
    std::vector<std::thread> drivers;
    if (run_.runtime.worker_count == 1) {  // then all pushes belong to one thread
      std::vector<Event> events = list_others();
      for (int32_t s = 0; s < run_.sensor_count; ++s) list_scan(s, events);
      drivers.emplace_back([events, this] { drive("bench-drivers", events); });
    } else {
      drivers.emplace_back([this] { drive("bench-poses", list_others()); });
      for (int32_t s = 0; s < run_.sensor_count; ++s)
        drivers.emplace_back([this, s] {
          std::vector<Event> events;
          list_scan(s, events);
          drive(("bench-driver" + std::to_string(s)).c_str(), events);
        });
    }
    run_.measuring_threads += int32_t(drivers.size());
    for (std::thread& driver : drivers) driver.join();
    cli::check(ovt_flush(handle_.detector), "finishing the last frames");
    run_.wall_ns = now_ns() - (start_ns_ + def_.warmup * period_ns_);
    run_.measuring_fifo += fifo_drivers_.load();
  }

  void run_closed() {
    run_.measuring_threads += 1;
    std::thread driver([this] {
      become_driver("bench-drivers");
      std::vector<ovt_ego_pose> poses;
      const uint32_t all = (1u << run_.sensor_count) - 1;
      for (int32_t k = 0; k < frame_count_ && failed_.load() == OVT_OK; ++k) {
        noise_->tick();
        push_poses(k, poses);
        FrameSample& sample = run_.frames[std::size_t(k)];
        sample.due_ns = now_ns();
        for (int32_t s = 0; s < run_.sensor_count; ++s) push_scan(k, s);
        if (sample.expected_mask != all) note(ovt_flush(handle_.detector));
        for (int64_t seen; failed_.load() == OVT_OK && (seen = published_.load(std::memory_order_acquire)) <= k;)
          published_.wait(seen, std::memory_order_acquire);
        if (k >= def_.warmup) run_.wall_ns += sample.published_ns - sample.due_ns;
      }
    });
    driver.join();
    run_.measuring_fifo += fifo_drivers_.load();
  }

  const LatencyInput& input_;
  const LatencyRunDef& def_;
  const int32_t frame_count_;
  int64_t period_ns_ = 0, start_ns_ = 0;
  LatencyRun run_;
  std::atomic<int64_t> published_{0};
  std::atomic<int32_t> failed_{OVT_OK}, fifo_drivers_{0};
  std::unique_ptr<NoiseFloor> noise_;
  std::unique_ptr<FloorScan> floor_scan_;
  Loops floor_loops_ = {};
  DetectorHandle handle_;  // last member, destroyed first: after that nothing calls on_frame
};

}  // namespace

LatencyRun run_latency(const LatencyInput& input, const LatencyRunDef& def) { return LatencyRunner(input, def).run(); }

}  // namespace overtake::bench
