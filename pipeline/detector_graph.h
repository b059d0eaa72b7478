// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// The paper's block diagram as a oneTBB flow graph. Messages have at most 24 bytes, so no message allocates memory.
//
//   scan 1 --> [segment] --+
//   scan 2 --> [segment] --+--> [detect: merge, gate, pose] --> [in order] --> [track] --> publish
//   scan n --> [segment] --+         when the frame is closed and its last segmentation is done
//
// Only the intake thread and the graph's workers call TBB.
#pragma once

#include <functional>
#include <memory>

#include "pipeline/frame_assembler.h"
#include "pipeline/stages.h"
#include "pipeline/threads.h"
#include "pipeline/track/track_stage.h"

namespace overtake {

// Functions of the detector that both runners call: it counts and publishes.
struct RunnerHooks {
  std::function<void(Frame&)> finish;  // after the tracker, frame by frame
  std::function<void()> caught;        // an exception was caught; the frame continues
};

// worker_count 1: runs everything in the calling thread.
class InlineRunner final : public FrameRunner {
 public:
  InlineRunner(const StageContext& context, TrackStage& track, RunnerHooks hooks);
  void start_segment(Frame& frame, int32_t sensor) override;
  void close(Frame& frame) override;

 private:
  const StageContext& context_;
  TrackStage& track_;
  RunnerHooks hooks_;
};

struct GraphParams {
  int32_t worker_count = 2;
  int32_t max_frames = 4;  // in work at once: warm_up allocates memory for this many
  int64_t spin_ns = 0;     // workers look for work this long before they sleep
};

class DetectorGraph final : public FrameRunner {
 public:
  DetectorGraph(const GraphParams& params, ThreadSetup& setup, const StageContext& context, TrackStage& track,
                RunnerHooks hooks);
  ~DetectorGraph() override;  // waits for the frames in work
  // Runs `loop` inside the arena, so that its tasks come from the thread's own pool, which allocates nothing. Messages
  // from outside would use TBB's queue, which allocates a block every 64 messages.
  void host(const std::function<void()>& loop) override;
  // Brings every worker into the arena and sends as many messages along every edge as may ever wait there, so that
  // later neither a thread nor a message is created.
  void warm_up() override;
  void start_segment(Frame& frame, int32_t sensor) override;
  void close(Frame& frame) override;
  int32_t workers() const noexcept override;

 private:
  struct Nodes;
  std::unique_ptr<Nodes> nodes_;
};

}  // namespace overtake
