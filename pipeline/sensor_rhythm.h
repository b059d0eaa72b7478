// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// A sensor's interval, learned from its stamps alone: the shortest of its last 8 steps. So a lost scan lengthens
// nothing, and a sensor that delivers at its usual rate again is known at once.
#pragma once

#include <algorithm>
#include <cstdint>

namespace overtake {

class SensorRhythm {
 public:
  // `longest_ns`: a longer step is a silence and teaches nothing. So this is the limit of the interval, too.
  void note_stamp(int64_t stamp_ns, int64_t longest_ns) noexcept {
    int64_t step_ns = 0;
    const bool overflows = __builtin_sub_overflow(stamp_ns, last_ns_, &step_ns);
    if (knows_last_ && !overflows && step_ns <= 0) return;  // out of sequence
    if (knows_last_ && !overflows && step_ns <= longest_ns) step_ns_[count_++ % kSteps] = step_ns;
    knows_last_ = true;
    last_ns_ = stamp_ns;
  }
  // After a jump of the clock: the next stamp tells no step.
  void forget_last() noexcept { knows_last_ = false; }
  bool knows_last() const noexcept { return knows_last_; }
  // 0: not known yet.
  int64_t interval_ns() const noexcept { return count_ < kSteps ? 0 : shortest_ns(); }
  // The same of fewer steps, from the first one on. Lost scans may lengthen it.
  int64_t shortest_ns() const noexcept {
    return count_ == 0 ? 0 : *std::min_element(step_ns_, step_ns_ + std::min(count_, kSteps));
  }

 private:
  static constexpr uint64_t kSteps = 8;
  int64_t step_ns_[kSteps] = {};
  uint64_t count_ = 0;
  bool knows_last_ = false;
  int64_t last_ns_ = 0;
};

}  // namespace overtake
