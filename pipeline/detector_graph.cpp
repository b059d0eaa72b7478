// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
#include "pipeline/detector_graph.h"

#include <oneapi/tbb/flow_graph.h>
#include <oneapi/tbb/global_control.h>
#include <oneapi/tbb/task_arena.h>

#include <memory>
#include <mutex>
#include <utility>

namespace overtake {
namespace flow = oneapi::tbb::flow;
namespace {

// TBB gives the whole process as many threads as the smallest global_control alive allows, and says so on stderr when
// an arena asks for more. So all graphs share one control, for the sum of their workers.
class WorkerShare {
 public:
  explicit WorkerShare(int32_t worker_count) : worker_count_(worker_count) { change(worker_count_); }
  ~WorkerShare() { change(-worker_count_); }
  WorkerShare(const WorkerShare&) = delete;
  WorkerShare& operator=(const WorkerShare&) = delete;

 private:
  using Control = oneapi::tbb::global_control;
  static void change(int32_t by) {
    static std::mutex mutex;  // create and destroy only, never the data path
    static int32_t total = 0;
    static std::unique_ptr<Control> control;
    const std::lock_guard<std::mutex> lock(mutex);
    total += by;
    std::unique_ptr<Control> next;
    if (total > 0) next = std::make_unique<Control>(Control::max_allowed_parallelism, std::size_t(total) + 1);
    control = std::move(next);
  }
  int32_t worker_count_;
};

struct SegmentJob {
  Frame* frame;
  int32_t sensor;
};

void note_start(Frame& frame) noexcept {
  int64_t none = 0;
  frame.started_ns.compare_exchange_strong(none, steady_now_ns(), std::memory_order_relaxed);
}

void note_end(Frame& frame) noexcept {
  const int64_t start = frame.started_ns.load(std::memory_order_relaxed);
  if (start) frame.spans[OVT_STAGE_FRAME] = {start, steady_now_ns() - start, this_worker()};
}

// Nothing thrown may leave a body: the frame goes on with what it has.
template <class Body>
void guard(const RunnerHooks& hooks, Body&& body) noexcept {
  try {
    body();
  } catch (...) {
    hooks.caught();
  }
}

}  // namespace

InlineRunner::InlineRunner(const StageContext& context, TrackStage& track, RunnerHooks hooks)
    : context_(context), track_(track), hooks_(std::move(hooks)) {}

void InlineRunner::start_segment(Frame& frame, int32_t sensor) {
  note_start(frame);
  guard(hooks_, [&] { segment_scan(context_, sensor, frame.sensors[sensor]); });
}

void InlineRunner::close(Frame& frame) {
  guard(hooks_, [&] { detect_frame(context_, frame); });
  guard(hooks_, [&] { track_.run(frame); });
  note_end(frame);
  guard(hooks_, [&] { hooks_.finish(frame); });
}

struct DetectorGraph::Nodes {
  Nodes(int32_t worker_count, const StageContext& stage_context, TrackStage& track_stage, RunnerHooks runner_hooks)
      : context(stage_context), hooks(std::move(runner_hooks)), share(worker_count), arena(worker_count, 0) {
    arena.execute([&] {
      graph = std::make_unique<flow::graph>();
      segment = std::make_unique<SegmentNode>(*graph, flow::unlimited, [this](SegmentJob job) {
        guard(hooks, [&] { segment_scan(context, job.sensor, job.frame->sensors[job.sensor]); });
        finish_part(*job.frame);
        return flow::continue_msg();
      });
      detect = std::make_unique<DetectNode>(*graph, flow::unlimited, [this](Frame* frame) {
        guard(hooks, [&] { detect_frame(context, *frame); });
        return frame;
      });
      in_order = std::make_unique<OrderNode>(*graph, [](Frame* frame) { return std::size_t(frame->sequence); });
      track = std::make_unique<TrackNode>(*graph, flow::serial, [this, &track_stage](Frame* frame) {
        guard(hooks, [&] { track_stage.run(*frame); });
        note_end(*frame);
        guard(hooks, [&] { hooks.finish(*frame); });
        return flow::continue_msg();
      });
      flow::make_edge(*detect, *in_order);
      flow::make_edge(*in_order, *track);
    });
  }

  // The frame's last segment, or its closing, sends it on.
  void finish_part(Frame& frame) {
    if (frame.pending.fetch_sub(1, std::memory_order_acq_rel) == 1) detect->try_put(&frame);
  }

  using SegmentNode = flow::function_node<SegmentJob, flow::continue_msg>;
  using DetectNode = flow::function_node<Frame*, Frame*>;
  using OrderNode = flow::sequencer_node<Frame*>;
  using TrackNode = flow::function_node<Frame*, flow::continue_msg>;
  const StageContext& context;
  RunnerHooks hooks;
  WorkerShare share;
  oneapi::tbb::task_arena arena;
  std::unique_ptr<flow::graph> graph;  // made inside the arena: its tasks run there
  std::unique_ptr<SegmentNode> segment;
  std::unique_ptr<DetectNode> detect;
  std::unique_ptr<OrderNode> in_order;
  std::unique_ptr<TrackNode> track;
};

DetectorGraph::DetectorGraph(int32_t worker_count, const StageContext& context, TrackStage& track, RunnerHooks hooks)
    : nodes_(std::make_unique<Nodes>(worker_count, context, track, std::move(hooks))) {}

DetectorGraph::~DetectorGraph() {
  nodes_->arena.execute([&] { nodes_->graph->wait_for_all(); });
}

void DetectorGraph::start_segment(Frame& frame, int32_t sensor) {
  note_start(frame);
  frame.pending.fetch_add(1, std::memory_order_acq_rel);
  nodes_->segment->try_put({&frame, sensor});
}

void DetectorGraph::close(Frame& frame) { nodes_->finish_part(frame); }

}  // namespace overtake
