// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// The paper's block diagram as a oneTBB flow graph. Messages are slot pointers, at most 16 bytes: no message costs a
// heap call.
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

namespace overtake {

// What both runners call back: counting and publishing belong to the detector.
struct RunnerHooks {
  std::function<void(Frame&)> finish;          // after the tracker, frame after frame
  std::function<void()> caught;                // an exception was caught; the frame goes on
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

class DetectorGraph final : public FrameRunner {
 public:
  DetectorGraph(int32_t worker_count, const StageContext& context, TrackStage& track, RunnerHooks hooks);
  ~DetectorGraph() override;                   // waits for the frames under way
  void start_segment(Frame& frame, int32_t sensor) override;
  void close(Frame& frame) override;

 private:
  struct Nodes;
  std::unique_ptr<Nodes> nodes_;
};

}  // namespace overtake
