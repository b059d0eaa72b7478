// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// When and where each stage of a frame ran. Times never reach a result: they are read beside it.
#pragma once

#include <algorithm>
#include <cstdint>
#include <iterator>

#include "pipeline/overtake.h"

namespace overtake {

int64_t steady_now_ns() noexcept;

// The calling thread's number among a detector's workers; -1: the pushing thread or the intake. A worker that enters an
// arena sets its own.
int32_t this_worker() noexcept;
void set_this_worker(int32_t worker) noexcept;

struct StageSpan {
  int64_t start_ns = 0, duration_ns = -1;      // steady clock; -1: did not run
  int32_t worker = -1;
};

struct StageSpans {
  StageSpan of[OVT_STAGE_COUNT];
  StageSpan& operator[](int32_t stage) noexcept { return of[stage]; }
  const StageSpan& operator[](int32_t stage) const noexcept { return of[stage]; }
  void reset() noexcept { std::fill(std::begin(of), std::end(of), StageSpan{}); }
};

// Stage after stage: each begins where the one before it ended.
class StageClock {
 public:
  explicit StageClock(StageSpans& spans) noexcept
      : spans_(spans), start_(steady_now_ns()), last_(start_), worker_(this_worker()) {}
  void lap(ovt_stage stage) noexcept {
    const int64_t now = steady_now_ns();
    spans_[stage] = {last_, now - last_, worker_};
    last_ = now;
  }
  // From the first stage's start to the last one's end.
  void total(ovt_stage stage) noexcept { spans_[stage] = {start_, last_ - start_, worker_}; }

 private:
  StageSpans& spans_;
  int64_t start_, last_;
  int32_t worker_;
};

}  // namespace overtake
