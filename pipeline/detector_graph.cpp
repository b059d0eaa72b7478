// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
#include "pipeline/detector_graph.h"

#include <oneapi/tbb/flow_graph.h>
#include <oneapi/tbb/global_control.h>
#include <oneapi/tbb/task_arena.h>
#include <oneapi/tbb/task_group.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <memory>
#include <mutex>
#include <optional>
#include <thread>
#include <utility>

#include "core/check.h"
#include "core/float_mode.h"

namespace overtake {
namespace flow = oneapi::tbb::flow;
namespace {

// TBB gives the whole process as many threads as the smallest existing global_control allows, and prints a warning when
// an arena asks for more. So all graphs share one control: for the sum of their workers, besides what the process had
// before the first one, which its own arenas still get.
class WorkerShare {
 public:
  explicit WorkerShare(int32_t worker_count) : worker_count_(worker_count) { change(worker_count_); }
  ~WorkerShare() { change(-worker_count_); }
  WorkerShare(const WorkerShare&) = delete;
  WorkerShare& operator=(const WorkerShare&) = delete;
  // Number of workers that all controls of the process allow.
  static int32_t count_allowed() { return int32_t(Control::active_value(Control::max_allowed_parallelism)) - 1; }
  static int32_t count_all() {  // of all graphs
    const std::lock_guard<std::mutex> lock(mutex);
    return total;
  }

 private:
  using Control = oneapi::tbb::global_control;
  inline static std::mutex mutex;  // only create and destroy use it, never the data path
  inline static int32_t total = 0;
  static void change(int32_t by) {
    // Never destroyed: a detector of a global object is destroyed after the static objects of this function would be.
    static std::unique_ptr<Control>& control = *new std::unique_ptr<Control>;
    static std::size_t others = 1;
    static int32_t granted = 0;
    const std::lock_guard<std::mutex> lock(mutex);
    const int32_t next_total = total + by;
    if (!control) others = Control::active_value(Control::max_allowed_parallelism);
    if (next_total == 0) {
      control.reset();
      granted = 0;
    } else if (next_total > granted) {  // a smaller total keeps the control: a new one needs memory, which may be out
      control = std::make_unique<Control>(Control::max_allowed_parallelism, others + std::size_t(next_total));
      granted = next_total;
    }
    total = next_total;
  }
  int32_t worker_count_;
};

// kStartPatience_ns: how long create waits for workers that do not come. The system may have none, or another arena of
// the process may use them; an overloaded machine may take seconds to start a thread. kSharePatience_ns: how long it
// may keep workers of other detectors from their frames.
constexpr int64_t kStartPatience_ns = 10'000'000'000, kSharePatience_ns = 200'000'000;
constexpr std::chrono::milliseconds kLeave(5);  // for workers without a task to leave an arena, mostly after 0.1 ms

// One warm-up at a time: two would wait for each other's workers.
std::mutex warm_up_mutex;

// A message of the graph: a frame, or (null) a message of the warm-up.
// Job::sensor of warm-up messages: kHold: barrier until all workers are here; kPass: does nothing. Job::sensor of a
// frame's message: kAwaited counts in `waiting`.
constexpr int32_t kHold = -2, kPass = -3, kAwaited = -5;
struct Job {
  Frame* frame;
  int32_t sensor;
  int64_t order;  // position among the messages of a frame's tail: the sequencer's key
};

// True for the first scan of a frame.
bool note_start(Frame& frame) noexcept {
  int64_t none = 0;
  return frame.started_ns.compare_exchange_strong(none, steady_now_ns(), std::memory_order_relaxed);
}

void note_end(Frame& frame) noexcept {
  const int64_t start = frame.started_ns.load(std::memory_order_relaxed);
  const int64_t now = steady_now_ns();
  if (start) frame.spans[OVT_STAGE_FRAME] = {start, now - start, this_worker()};
  if (frame.pushed_ns) frame.latency_ns = now - frame.pushed_ns;
}

// Catches every exception of a graph body, so that the frame continues. False if the body threw.
template <class Body>
bool guard(const RunnerHooks& hooks, Body&& body) noexcept {
  try {
    body();
    return true;
  } catch (...) {
    hooks.caught();
    return false;
  }
}

void run_segment(const StageContext& context, const RunnerHooks& hooks, Frame& frame, int32_t sensor,
                 int32_t thread) noexcept {
  const bool whole = guard(hooks, [&] {
    context.hook(HookPoint::kSegment, frame, sensor);
    segment_scan(context, sensor, frame.sensors[sensor], thread);
    context.hook(HookPoint::kSegmented, frame, sensor);
  });
  if (whole) return;
  frame.sensors[sensor].present = false;  // half a segmentation is not used
  frame.sensors[sensor].failed = true;
}

void run_detect(const StageContext& context, const RunnerHooks& hooks, Frame& frame) noexcept {
  for (int32_t s = 0; s < context.sensor_count; ++s)
    if (frame.sensors[s].failed) {  // as if its scan had not come
      frame.sensor_mask &= ~(1u << s);
      frame.incomplete_mask &= ~(1u << s);
      frame.flags |= OVT_FLAG_SENSOR_MISSING | OVT_FLAG_EXCEPTION;
    }
  const bool whole = guard(hooks, [&] {
    context.hook(HookPoint::kDetect, frame);
    detect_frame(context, frame);
  });
  if (whole) return;
  frame.detections.count = frame.views.count = frame.faint_count = 0;
  for (int32_t s = 0; s < context.sensor_count; ++s)
    if (SensorPart& part = frame.sensors[s]; part.present) std::fill_n(part.cluster_of_label, part.label_count + 1, -1);
  frame.failed = true;
  frame.flags |= OVT_FLAG_EXCEPTION;
}

void run_track(const StageContext& context, const RunnerHooks& hooks, TrackStage& track, Frame& frame) noexcept {
  if (!guard(hooks, [&] { context.hook(HookPoint::kTrack, frame); })) {  // else tracks would be missing without a flag
    frame.failed = true;
    frame.flags |= OVT_FLAG_EXCEPTION;
  }
  track.run(frame);
  note_end(frame);
  guard(hooks, [&] { context.hook(HookPoint::kFinish, frame); });
  guard(hooks, [&] { hooks.finish(frame); });
}

}  // namespace

InlineRunner::InlineRunner(const StageContext& context, TrackStage& track, RunnerHooks hooks)
    : context_(context), track_(track), hooks_(std::move(hooks)) {}

void InlineRunner::start_segment(Frame& frame, int32_t sensor) {
  note_start(frame);
  context_.hook(HookPoint::kTake, frame, sensor);
  run_segment(context_, hooks_, frame, sensor, 0);
}

void InlineRunner::close(Frame& frame) {
  run_detect(context_, hooks_, frame);
  run_track(context_, hooks_, track_, frame);
}

struct DetectorGraph::Nodes {
  Nodes(const GraphParams& graph_params, ThreadSetup& thread_setup, const StageContext& stage_context,
        TrackStage& track_stage, RunnerHooks runner_hooks)
      : params(graph_params),
        context(stage_context),
        stage(track_stage),
        hooks(std::move(runner_hooks)),
        setup(thread_setup),
        share(params.worker_count),
        expected(std::min(params.worker_count, WorkerShare::count_allowed())),
        arena(expected + 1, 1) {  // one place for the intake
    try {
      arena.execute([this] { build(); });
    } catch (...) {  // the system refused a thread for a task that an edge has spawned: the task uses the nodes
      if (graph) arena.execute([this] { finish_tasks(); });
      throw;
    }
  }

  void build() {
    graph = std::make_unique<flow::graph>();
    segment = std::make_unique<SegmentNode>(*graph, flow::unlimited, [this](const Job& job) {
      const Visit visit(setup);
      waiting.fetch_sub(1, std::memory_order_relaxed);
      if (!job.frame) {
        if (job.sensor == kHold) warm_worker();
        return flow::continue_msg();
      }
      OVT_CHECK(visit.place >= 0 && visit.place <= params.worker_count);
      segmenting.fetch_add(1, std::memory_order_relaxed);
      run_segment(context, hooks, *job.frame, job.sensor, visit.place);
      segmenting.fetch_sub(1, std::memory_order_relaxed);
      keep_awake();  // first: a thread runs the last message of a body first
      if (!finish_part(*job.frame, false)) help_others();
      return flow::continue_msg();
    });
    detect = std::make_unique<DetectNode>(*graph, flow::unlimited, [this](const Job& job) {
      const Visit visit(setup);
      if (job.sensor == kAwaited) waiting.fetch_sub(1, std::memory_order_relaxed);
      if (job.frame) run_detect(context, hooks, *job.frame);
      return job;
    });
    in_order = std::make_unique<OrderNode>(*graph, [](const Job& job) { return std::size_t(job.order); });
    track = std::make_unique<TrackNode>(*graph, flow::serial, [this](const Job& job) {
      if (!job.frame) {
        warmed.fetch_add(1, std::memory_order_release);
        return flow::continue_msg();
      }
      const Visit visit(setup);
      // on_frame may use oneTBB. Where it waits for its own tasks, it must not run one of this graph: the next scan's
      // segmentation, say, would hold up this frame.
      oneapi::tbb::this_task_arena::isolate([&] { run_track(context, hooks, stage, *job.frame); });
      keep_awake();
      return flow::continue_msg();
    });
    spin = std::make_unique<SpinNode>(*graph, flow::unlimited, [this](const flow::continue_msg&) {
      const int64_t until = steady_now_ns() + params.spin_ns;
      idle_while([&] { return steady_now_ns() < until; });
      spinning.fetch_sub(1, std::memory_order_relaxed);
      return flow::continue_msg();
    });
    flow::make_edge(*detect, *in_order);
    flow::make_edge(*in_order, *track);
  }

  void finish_tasks() noexcept {
    try {
      graph->wait_for_all();
    } catch (...) {  // of a task, or again of a refused thread: there is nobody to tell
    }
  }

  // The frame's last segmentation, or its closing, sends the frame to `detect`. The intake runs no stage itself: a
  // worker must come for its messages. False: other scans of the frame are in work, or may come.
  bool finish_part(Frame& frame, bool by_intake) {
    if (frame.pending.fetch_sub(1, std::memory_order_acq_rel) != 1) return false;
    if (by_intake) waiting.fetch_add(1, std::memory_order_relaxed);
    detect->try_put({&frame, by_intake ? kAwaited : -1, warm_messages() + frame.sequence});
    return true;
  }

  // A worker without a message, as long as `more` says, looks for messages and for parts of other workers' steps. Not
  // while a frame waits for scans: the thread that brings one would take the CPU in the middle of a part, and the
  // part's owner would wait for both.
  template <class More>
  void idle_while(More&& more) {
    const auto is_idle = [&] { return waiting.load(std::memory_order_relaxed) == 0 && more(); };
    if (!context.spare) {
      while (is_idle()) idle_briefly();
      return;
    }
    std::optional<SpareWorkers::Visit> visit;
    while (is_idle()) {
      if (open_frames.load(std::memory_order_relaxed) > 0)
        visit.reset();
      else if (!visit)
        visit.emplace(*context.spare);
      if (!visit || !visit->take_part()) idle_briefly();
    }
  }
  // Behind its own scan, until the others have segmented theirs.
  void help_others() {
    if (context.spare) idle_while([&] { return segmenting.load(std::memory_order_relaxed) > 0; });
  }

  // Workers without work spin for a while before TBB puts them to sleep.
  void keep_awake() {
    if (params.spin_ns <= 0 || waiting.load(std::memory_order_relaxed) > 0) return;
    while (spinning.fetch_add(1, std::memory_order_relaxed) < expected) spin->try_put(flow::continue_msg());
    spinning.fetch_sub(1, std::memory_order_relaxed);
  }

  // As many messages per worker as it may create before earlier ones are finished.
  int64_t messages_per_worker() const { return params.max_frames + params.worker_count; }
  int64_t warm_messages() const { return messages_per_worker() * params.worker_count; }

  // A worker's part of the warm-up: waits until all workers and the intake's messages are here. So each worker creates
  // its own messages, in an order that makes the sequencer's queue as long as it can become.
  void warm_worker() {
    const auto all = [&](const std::atomic<int32_t>& count) {
      while (count.load() < expected && steady_now_ns() < warm_until) std::this_thread::yield();
    };
    const int64_t number = arrived.fetch_add(1);
    const int32_t now_here = here.fetch_add(1) + 1;
    for (int32_t most = most_here.load(); most < now_here && !most_here.compare_exchange_weak(most, now_here);) {
    }
    all(arrived);
    while (!posted.load() && steady_now_ns() < warm_until) std::this_thread::yield();
    for (int64_t k = 0; k < messages_per_worker(); ++k)
      detect->try_put({nullptr, -1, warm_messages() - 1 - (number * messages_per_worker() + k)});
    left.fetch_add(1);
    all(left);
    here.fetch_sub(1);
  }

  // TBB starts a thread only for a task that no idle thread takes. Workers of other detectors may be idle now and come
  // to the warm-up, and be at work when the first frames come. So the workers of all detectors meet once, in an arena
  // of their own, before any gets this detector's settings: a new thread inherits those of the worker that starts it.
  // Each creates as many messages as it may need for this detector. A lone detector needs no meeting.
  // While two arenas ask for workers at once, TBB starts more threads than the detectors have workers, and one that
  // came to no warm-up may run a frame later. So each asks only after the workers have left the one before it. TBB
  // tells nobody when: on a busy machine it may still come to a thread more, except for a process's first detector.
  void meet_all_workers() {
    static std::atomic<bool> is_first{true};
    if (!is_first.exchange(false)) std::this_thread::sleep_for(kLeave);
    const int32_t all = std::min(WorkerShare::count_all(), WorkerShare::count_allowed());
    if (all <= expected) return;
    const int64_t until = steady_now_ns() + kSharePatience_ns;
    std::atomic<int32_t> met{0};
    const auto wait = [&] {
      while (met.load() < all && steady_now_ns() < until) std::this_thread::yield();
    };
    oneapi::tbb::task_arena place(all + 1, 1);  // one place for this thread
    place.execute([&] {
      oneapi::tbb::task_group workers;
      for (int32_t i = 0; i < all; ++i)
        workers.run([&] {
          ThreadSetup::list_this_thread();
          met.fetch_add(1);
          wait();
          oneapi::tbb::task_group messages;
          for (int64_t k = 0; k < messages_per_worker(); ++k) messages.run([] {});
          messages.wait();
        });
      wait();
      workers.wait();
    });
    std::this_thread::sleep_for(kLeave);
  }

  // A thread that runs one of the graph's tasks. A worker gets its number and settings with its first task, in the
  // warm-up, before its first frame. (A task_scheduler_observer does not work: a worker that still leaves the arena
  // keeps the observer's proxy longer than the observer exists, and leak checkers report it.)
  struct Visit {
    explicit Visit(ThreadSetup& setup) : place(oneapi::tbb::this_task_arena::current_thread_index()) {
      const int32_t worker = place - 1;  // place 0 is the intake's; a thread that destroys the detector has it, too
      set_this_worker(worker);
      setup.enter_worker(worker);
    }
    ~Visit() { set_this_worker(-1); }
    Visit(const Visit&) = delete;
    Visit& operator=(const Visit&) = delete;
    const FloatMode usual;  // a worker may serve other arenas of the process, too
    const int32_t place;    // in the arena
  };

  using SegmentNode = flow::function_node<Job, flow::continue_msg>;
  using DetectNode = flow::function_node<Job, Job>;
  using OrderNode = flow::sequencer_node<Job>;
  using TrackNode = flow::function_node<Job, flow::continue_msg>;
  using SpinNode = flow::function_node<flow::continue_msg, flow::continue_msg>;
  const GraphParams params;
  const StageContext& context;
  TrackStage& stage;
  RunnerHooks hooks;
  std::atomic<int32_t> waiting{0};  // messages of the intake that no worker has started
  std::atomic<int32_t> spinning{0};
  std::atomic<int32_t> segmenting{0};   // workers
  std::atomic<int32_t> open_frames{0};  // with a scan, and not closed
  ThreadSetup& setup;
  std::atomic<int32_t> arrived{0}, left{0};    // warm-up messages that workers started; that they finished
  std::atomic<int32_t> here{0}, most_here{0};  // workers in the warm-up; the maximum, which is the worker count
  std::atomic<bool> posted{false};             // the intake has sent its warm-up messages
  std::atomic<int64_t> warmed{0};              // warm-up messages that passed the whole graph
  std::atomic<int64_t> warm_until{0};
  WorkerShare share;
  const int32_t expected;  // workers requested, no more than the process allows: TBB would print a warning

  oneapi::tbb::task_arena arena;
  std::unique_ptr<flow::graph> graph;  // created inside the arena: its tasks run there
  std::unique_ptr<SegmentNode> segment;
  std::unique_ptr<DetectNode> detect;
  std::unique_ptr<OrderNode> in_order;
  std::unique_ptr<TrackNode> track;
  std::unique_ptr<SpinNode> spin;
};

DetectorGraph::DetectorGraph(const GraphParams& params, ThreadSetup& setup, const StageContext& context,
                             TrackStage& track, RunnerHooks hooks)
    : nodes_(std::make_unique<Nodes>(params, setup, context, track, std::move(hooks))) {}

DetectorGraph::~DetectorGraph() {
  Nodes& n = *nodes_;
  n.arena.execute([&] { n.finish_tasks(); });
  n.setup.release_workers();
}

void DetectorGraph::host(const std::function<void()>& loop) { nodes_->arena.execute(loop); }

// One message per worker, each held until all workers have come; then as many messages as may ever wait.
void DetectorGraph::warm_up() {
  const std::lock_guard<std::mutex> lock(warm_up_mutex);
  Nodes& n = *nodes_;
  n.meet_all_workers();
  n.warm_until = steady_now_ns() + (n.expected > 0 ? kStartPatience_ns : 0);
  const int32_t workers = n.params.worker_count, more = n.params.max_frames * (n.context.sensor_count + 1);
  n.waiting.fetch_add(workers + more);
  try {
    for (int32_t i = 0; i < workers; ++i) n.segment->try_put({nullptr, kHold, 0});
    for (int32_t i = 0; i < more; ++i) n.segment->try_put({nullptr, kPass, 0});
  } catch (...) {  // no memory, or no thread: nobody waits for the others
    n.warm_until = 0;
    throw;
  }
  n.posted.store(true);
  // If a worker does not come, the others take its messages, after waiting for it. Without any worker nothing arrives.
  while (n.warmed.load(std::memory_order_acquire) < n.warm_messages() &&
         (n.arrived.load() > 0 || steady_now_ns() < n.warm_until))
    std::this_thread::yield();
}

void DetectorGraph::start_segment(Frame& frame, int32_t sensor) {
  if (note_start(frame)) nodes_->open_frames.fetch_add(1, std::memory_order_relaxed);
  nodes_->context.hook(HookPoint::kTake, frame, sensor);
  frame.pending.fetch_add(1, std::memory_order_acq_rel);
  nodes_->waiting.fetch_add(1, std::memory_order_relaxed);
  nodes_->segment->try_put({&frame, sensor, 0});
}

void DetectorGraph::close(Frame& frame) {
  if (frame.started_ns.load(std::memory_order_relaxed) != 0)
    nodes_->open_frames.fetch_sub(1, std::memory_order_relaxed);
  nodes_->finish_part(frame, true);
}

int32_t DetectorGraph::workers() const noexcept { return nodes_->most_here.load(); }

}  // namespace overtake
