// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// When and where each stage of a frame ran. Times are separate from results and never change them.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <iterator>

#include "pipeline/overtake.h"
#include "pipeline/probes.h"

namespace overtake {

int64_t steady_now_ns() noexcept;

// The calling thread's number among a detector's workers; -1: the pushing thread or the intake. A worker sets its
// number when it enters an arena.
int32_t this_worker() noexcept;
void set_this_worker(int32_t worker) noexcept;

struct StageSpan {
  int64_t start_ns = 0, duration_ns = -1;  // steady clock; -1: did not run
  int32_t worker = -1;
};

struct StageSpans {
  StageSpan of[OVT_STAGE_COUNT];
  StageSpan& operator[](int32_t stage) noexcept { return of[stage]; }
  const StageSpan& operator[](int32_t stage) const noexcept { return of[stage]; }
  void reset() noexcept { std::fill(std::begin(of), std::end(of), StageSpan{}); }
};

// Arguments of the probes.
struct StageTag {
  int64_t sequence, stamp_ns;
  int32_t sensor;
};

// Measures stage after stage: each begins where the one before it ended.
class StageClock {
 public:
  StageClock(StageSpans& spans, const StageTag& tag) noexcept
      : spans_(spans), tag_(tag), start_(steady_now_ns()), last_(start_), worker_(this_worker()) {}
  void begin(int32_t stage) noexcept { probe_stage_begin(tag_.sequence, tag_.sensor, stage, tag_.stamp_ns); }
  void end(int32_t stage) noexcept {
    const int64_t now = steady_now_ns();
    spans_[stage] = {last_, now - last_, worker_};
    last_ = now;
    probe_stage_end(tag_.sequence, tag_.sensor, stage, tag_.stamp_ns);
  }
  // Runs each of the steps, which have a `stage`. Consecutive steps of one stage share its time.
  template <class Steps, class Run>
  void run(const Steps& steps, Run&& run_step) noexcept {
    for (std::size_t i = 0; i < steps.size(); ++i) {
      const int32_t stage = steps[i].stage;
      if (i == 0 || steps[i - 1].stage != stage) begin(stage);
      run_step(steps[i]);
      if (i + 1 == steps.size() || steps[i + 1].stage != stage) end(stage);
    }
  }
  // From the first stage's start to the last one's end.
  void total(int32_t stage) noexcept { spans_[stage] = {start_, last_ - start_, worker_}; }

 private:
  StageSpans& spans_;
  StageTag tag_;
  int64_t start_, last_;
  int32_t worker_;
};

}  // namespace overtake
