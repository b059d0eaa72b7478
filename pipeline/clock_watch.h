// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// Which stamps to believe. Sources are the sensors and the pushed detections; one thread (the intake).
//
//   up to 0.5 s older than the newest, up to 1 s newer    good
//   else                                                   suspect: not used
//   a source's third suspect in a row, growing by up to    the clock jumped, when more sensors say so than still
//   1 s each                                               deliver good stamps: one sensor's bad clock moves nobody
//
// Stamps only; the process clock never enters.
#pragma once

#include <algorithm>
#include <cstdint>

#include "core/sensor_model.h"

namespace overtake {

// a - b, saturated.
inline int64_t difference_ns(int64_t a, int64_t b) noexcept {
  int64_t out;
  if (!__builtin_sub_overflow(a, b, &out)) return out;
  return a > b ? INT64_MAX : INT64_MIN;
}

inline constexpr int64_t kLateNs = 500'000'000;      // a stamp this much older is still taken, out of sequence
inline constexpr int64_t kMaxGapNs = 1'000'000'000;  // a longer gap is a clock that jumped, until three agree

enum class Believe { kGood, kBehind, kAhead, kJump };

class ClockWatch {
 public:
  static constexpr int32_t kExternal = kMaxSensors;  // the source of pushed detections
  static constexpr int32_t kSources = kMaxSensors + 1;

  explicit ClockWatch(int64_t period_ns) noexcept : max_gap_ns_(std::max(kMaxGapNs, 3 * period_ns)) {}

  // Judges the next stamp of a source. After kJump its stamp is the newest, and everything before is forgotten.
  Believe judge(int32_t source, int64_t stamp_ns) noexcept;
  // With kJump: suspects of sensors that were judged kBehind and belong to the clock that is now believed.
  int32_t behind_before_jump() const noexcept { return behind_before_jump_; }
  // Newest good stamp; only after a kGood or kJump.
  int64_t newest_ns() const noexcept { return newest_ns_; }
  bool any() const noexcept { return any_; }

 private:
  struct Source {
    int64_t good_at = -1;     // judgements so far, when its last good stamp came
    int32_t suspects = 0;     // in a row, and growing
    int32_t behind = 0;       // of these
    int64_t suspect_ns = 0;   // the last
    int64_t suspect_at = -1;  // judgements so far, when the first came
  };
  bool outvotes(int32_t source) const noexcept;

  int64_t max_gap_ns_;
  Source sources_[kSources];
  int64_t judged_ = 0;
  bool any_ = false;
  int64_t newest_ns_ = 0;
  int32_t behind_before_jump_ = 0;
};

}  // namespace overtake
