// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// Which stamps to believe. Sources are the sensors and the pushed detections; one thread (the intake).
//
//   more than 0.5 s older than the newest good stamp        suspect
//   ahead of the newest stamp of the other good sensors     suspect: such a sensor's clock is wrong, or all sensors
//   by more than the frame tolerance and a period           paused. Held until the others have spoken
//   no other sensor is good: more than 1 s ahead            suspect
//   else                                                    good
//
// A sensor is good for another one while it is not named as a suspect and the other has not been heard more than once
// more than usual since then: judgements are counted, since the stamps of the other may be wrong. A time that the
// caller names, 3.5 periods after a sensor's newest stamp, says the same of it. What a held stamp becomes:
//
//   the others have come near it                             good: it was only early
//   more sensors say the same than deliver good stamps       good: a common gap. Nothing of it is lost
//   nobody else is good any more                             good
//   the others go on without it, or its sensor takes it back rejected
//
// A source's third suspect in a row, growing by up to 1 s each, is a clock that jumped when more sensors say so than
// still deliver good stamps. In the first two rounds of three sensors or more, when only one was heard, the majority
// decides at once: the first stamp of all may be the wrong one.
//
// Two sensors are no majority. One that steps ahead is the suspect, one that steps back speaks against nobody. Two that
// disagree without a step (a drift) are both good up to the lateness that is taken in out of sequence; farther apart
// the one ahead is the suspect.
//
// Pushed detections are judged against the sensors and never move their clock; while no sensor is good they are the
// clock. Stamps only; the process clock never enters.
#pragma once

#include <algorithm>
#include <cstdint>
#include <utility>

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

// kHold: keep it until take_accepted() or take_rejected() names its sensor (pushed detections: until judge_held()
// says).
enum class Believe { kGood, kHold, kLate, kJump };

class ClockWatch {
 public:
  static constexpr int32_t kExternal = kMaxSensors;  // the source of pushed detections
  static constexpr int32_t kSources = kMaxSensors + 1;

  ClockWatch(int32_t sensor_count, int64_t period_ns, int64_t tolerance_ns) noexcept
      : sensor_count_(sensor_count),
        period_ns_(period_ns),
        tolerance_ns_(tolerance_ns),
        near_ns_(tolerance_ns + period_ns),
        max_gap_ns_(std::max(kMaxGapNs, 3 * period_ns)) {}

  // Judges the next stamp of a source. After kJump its stamp is the newest, and everything before is forgotten. A stamp
  // that the source still had on hold is accepted or rejected before the new one is held.
  Believe judge(int32_t source, int64_t stamp_ns) noexcept;
  // Pushed detections on hold since the sensors' newest stamp was base_ns.
  Believe judge_held(int64_t stamp_ns, int64_t base_ns) const noexcept;
  // Sensors whose held stamp was judged since the last call, by bit.
  uint32_t take_accepted() noexcept { return std::exchange(accepted_, 0u); }
  uint32_t take_rejected() noexcept { return std::exchange(rejected_, 0u); }
  // The caller says what time it is: sensors silent for long are not good any more.
  void name_time(int64_t now_ns) noexcept;
  // Nobody is going to speak for them.
  void reject_held() noexcept;
  // A stamp was refused: its source is named until its third good stamp in a row.
  void note_suspect(int32_t source) noexcept { sources_[source].named = kAgreeing; }
  uint32_t suspect_mask() const noexcept;  // bit s: source s
  // With kJump: suspects of sensors that were judged kLate and belong to the clock that is now believed.
  int32_t late_before_jump() const noexcept { return late_before_jump_; }
  // Newest good stamp; only after a kGood or kJump.
  int64_t newest_ns() const noexcept { return newest_ns_; }
  bool any() const noexcept { return any_; }
  // A good stamp may be this much ahead of the newest of the others.
  int64_t near_ns() const noexcept { return near_ns_; }

 private:
  static constexpr int32_t kAgreeing = 3;
  static constexpr int32_t kMaxRatio = 16;  // of two sources' rates
  struct Source {
    bool any = false;         // a stamp of it was good
    bool silent = false;      // by the time that the caller named
    bool back = false;        // it stepped back, and is still behind the others: no witness against them
    int64_t good_ns = 0;      // newest good stamp
    int64_t interval_ns = 0;  // of its last good stamps, the shorter of two
    int64_t before_ns = 0;    // the last of them
    int32_t suspects = 0;     // in a row, and growing
    int32_t late = 0;         // of these, answered kLate
    int64_t suspect_ns = 0;   // the last
    bool continued = false;   // ... which went on as the stamps before it
    int64_t base_ns = 0;      // newest stamp of the others when it was put on hold
    int32_t named = 0;        // good stamps until it is no suspect any more
  };
  // How often one source was heard since another one's last good stamp, and between the two good stamps before.
  struct Heard {
    int32_t since = 0, usual = 0, before = 0;
    int32_t rhythm() const noexcept { return std::max({1, usual, before}); }
  };
  struct Others {
    int32_t good = 0;   // sensors that deliver good stamps now
    int32_t fresh = 0;  // of these, those that are not overdue
    int64_t newest_ns = INT64_MIN;
  };
  Others look_at_others(int32_t source) const noexcept;
  bool outvotes(int32_t source) const noexcept;
  bool majority_says(int32_t source, int64_t stamp_ns, const Others& others) const noexcept;
  bool agrees(const Source& other, int64_t stamp_ns) const noexcept;
  bool continues(int32_t source, int64_t stamp_ns) const noexcept;
  bool starts() const noexcept;
  bool is_good(int32_t source, int64_t stamp_ns, const Others& others) const noexcept;
  Believe take_good(int32_t source, int64_t stamp_ns) noexcept;
  Believe jump(int32_t source, int64_t stamp_ns) noexcept;
  void note_good(int32_t source, int64_t stamp_ns) noexcept;
  void accept(int32_t source) noexcept;
  void reject(int32_t source) noexcept;
  void look_at_held() noexcept;

  int32_t sensor_count_;
  int64_t period_ns_, tolerance_ns_, near_ns_, max_gap_ns_;
  Source sources_[kSources];
  Heard heard_[kSources][kMaxSensors];  // [who][since whose good stamp]
  int32_t judged_ = 0;                  // sensors' stamps since the clock began, up to where it matters
  bool any_ = false, any_sensor_ = false;
  int64_t newest_ns_ = 0;
  uint32_t held_ = 0, accepted_ = 0, rejected_ = 0;
  int32_t late_before_jump_ = 0;
};

}  // namespace overtake
