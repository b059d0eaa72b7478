// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// The paper's block diagram as a oneTBB flow graph. Messages are at most 24 bytes: no message costs a heap call.
//
//   scan 1 --> [segment] --+
//   scan 2 --> [segment] --+--> [detect: merge, gate, pose] --> [in order] --> [track] --> publish
//   scan n --> [segment] --+         when the frame is closed and its last segment is done
//
// Only the intake thread and the graph's own workers ever call TBB.
#pragma once

#include <functional>
#include <memory>

#include "pipeline/frame_assembler.h"
#include "pipeline/stages.h"
#include "pipeline/threads.h"
#include "pipeline/track/track_stage.h"

namespace overtake {

// What both runners call back: counting and publishing belong to the detector.
struct RunnerHooks {
  std::function<void(Frame&)> finish;  // after the tracker, frame after frame
  std::function<void()> caught;        // an exception was caught; the frame goes on
};

// worker_count 1: everything in the calling thread.
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
  int32_t max_frames = 4;  // in work at once: so much is taken from the heap in warm_up
  int64_t spin_ns = 0;     // workers look for work this long before they sleep
};

class DetectorGraph final : public FrameRunner {
 public:
  DetectorGraph(const GraphParams& params, ThreadRoster& roster, const StageContext& context, TrackStage& track,
                RunnerHooks hooks);
  ~DetectorGraph() override;  // waits for the frames under way
  // The loop is a guest of the arena for as long as it runs: what it sends goes into a pool of its own, which takes no
  // memory; from outside, TBB's queue takes a block every 64 messages.
  void host(const std::function<void()>& loop) override;
  // Brings every worker into the arena and sends as many messages down every edge as may ever wait there, so that
  // neither a thread nor a message is made later.
  void warm_up() override;
  void start_segment(Frame& frame, int32_t sensor) override;
  void close(Frame& frame) override;
  int32_t workers() const noexcept override;

 private:
  struct Nodes;
  std::unique_ptr<Nodes> nodes_;
};

}  // namespace overtake
