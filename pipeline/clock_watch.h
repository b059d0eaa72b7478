// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// Classifies stamps as good or wrong. Sources are the sensors and the pushed detections. Runs on one thread (the
// intake) and uses stamps only, never the process clock.
//
//   stamp                                                   verdict
//   more than 0.5 s older than the newest good stamp        suspect
//   ahead of the newest stamp of the other good sensors     suspect: this sensor's clock is wrong, or all sensors
//   by more than the frame tolerance and a period           paused. Held until the other sensors deliver newer stamps.
//                                                           Good if the sensor has delivered one stamp each interval
//                                                           since then: the others lose scans
//   ahead by no more than usual (the last 8 to 16 good      good: the others' scans take longer on their way
//   stamps) and the frame tolerance, and by at most 0.5 s
//   less twice the sum of tolerance and period
//   no other sensor is good: more than 1 s ahead, or of a   suspect
//   slower source more than two intervals and the tolerance
//   else                                                    good
//
// Sensor A is good evidence for source B while A is no suspect, and B has delivered at most one stamp more since A's
// last good stamp than usual: than in the last two of A's intervals in which B delivered any. It is evidence for up to
// 24 stamps of B if these intervals are not known yet (B is new, or the clock has just jumped): B may be fast, and a
// few stamps of it do not show that A stopped. So it is, too, if the others went on while B's stamps were suspect. This
// counts B's stamps instead of using their values, which may be wrong. A time from ovt_advance 3.5 periods after A's
// newest stamp ends A's evidence, too. Outcome of a held stamp:
//
//   the other sensors come to it (frame tolerance)            good
//   they come near it, after a gap of their own; or its       good: it was early
//   sensor kept pace with the stamps that they delivered
//   more sensors report such a stamp than deliver good ones   good: a common gap, nothing is lost
//   no other sensor is good any more                          good
//   the others advance without it, or its own sensor          rejected
//   returns to an earlier stamp
//
// Three suspects in a row of one source, each up to 1 s newer than the last, mean that the clock jumped, if more
// sensors report the new time than deliver good stamps. The steps of one sensor, or without sensors of the detections,
// may be longer, up to 10 s, if each is half to twice the one before; from then on the source is known to be slow. In
// the first two rounds of three or more sensors, while only one has a good stamp, the majority decides at once: the
// very first stamp may be the wrong one. Two sensors report the same time if their stamps are at most the frame
// tolerance and an interval of the one that reported it first apart.
//
// Two sensors form no majority. If one steps ahead, it is the suspect; if one steps back, neither is. If two drift
// apart without a step, both are good up to the lateness that out-of-sequence frames allow; beyond it the one ahead is
// the suspect. Before its second stamp a sensor's interval is not known: a step of up to four periods is none.
//
// Pushed detections are compared with the sensors and never move the sensors' clock. While no sensor is good, they are
// the clock.
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

inline int64_t distance_ns(int64_t a, int64_t b) noexcept { return a > b ? difference_ns(a, b) : difference_ns(b, a); }

// stamp + duration, saturated.
inline int64_t later_ns(int64_t stamp_ns, int64_t duration_ns) noexcept {
  int64_t out;
  if (!__builtin_add_overflow(stamp_ns, duration_ns, &out)) return out;
  return duration_ns > 0 ? INT64_MAX : INT64_MIN;
}

inline constexpr int64_t kLateNs = 500'000'000;      // a stamp this much older is used, out of sequence
inline constexpr int64_t kMaxGapNs = 1'000'000'000;  // a longer gap is a clock jump, after three consistent stamps

// kHold: the caller keeps the scan until take_accepted() or take_rejected() returns its sensor (pushed detections:
// until classify_held() gives another verdict).
enum class StampVerdict { kGood, kHold, kLate, kJump };

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

  // Classifies the next stamp of a source. After kJump its stamp is the newest, and all earlier state is forgotten. If
  // the source still has a held stamp, that one is accepted or rejected before the new one is held.
  StampVerdict classify(int32_t source, int64_t stamp_ns) noexcept;
  // Classifies held detections; base_ns is the sensors' newest stamp at the time they were held.
  StampVerdict classify_held(int64_t stamp_ns, int64_t base_ns) const noexcept;
  // Sensors whose held stamp was accepted (or rejected) since the last call, one bit each.
  uint32_t take_accepted() noexcept { return std::exchange(accepted_, 0u); }
  uint32_t take_rejected() noexcept { return std::exchange(rejected_, 0u); }
  // The caller reports the current time: sensors that are silent for long are no longer good.
  void name_time(int64_t now_ns) noexcept;
  // Rejects all held stamps, because no newer ones will come.
  void reject_held() noexcept;
  // Call when a stamp was refused: the source stays in suspect_mask until its third good stamp in a row.
  void note_suspect(int32_t source) noexcept { sources_[source].named = kAgreeing; }
  uint32_t suspect_mask() const noexcept;  // bit s: source s
  // After kJump: suspect stamps of sensors that were classified kLate but belong to the new clock.
  int32_t late_before_jump() const noexcept { return late_before_jump_; }
  // Newest good stamp; valid only after a kGood or kJump.
  int64_t newest_ns() const noexcept { return newest_ns_; }
  bool any() const noexcept { return any_; }
  // A good stamp may be ahead of the newest stamp of the other sensors by this much.
  int64_t near_ns() const noexcept { return near_ns_; }

 private:
  static constexpr int32_t kAgreeing = 3;
  static constexpr int64_t kMostPeriods = 4;  // longest interval of a sensor that counts as regular, in periods
  static constexpr int32_t kMaxRatio = 16;    // largest ratio of two sources' rates
  static constexpr int64_t kSlowestNs = 10'000'000'000;  // interval of a source: the longest frame.period
  // Stamps without a good one of a sensor after which the sensor is no evidence, if they cannot be compared with a
  // usual number, or if the others contradicted the source's suspect stamps by going on without it: a short gap of all
  // others does not make a wrong clock right.
  static constexpr int32_t kLongPatience = 24;
  static_assert(kMaxRatio < kLongPatience && kLongPatience < 2 * kMaxRatio);
  // How far a sensor's last 8 to 16 good stamps were ahead of the newest one of the others when they came: the most of
  // it. Where the others' scans take longer on their way, it is always ahead of them.
  struct Leads {
    static constexpr int32_t kMany = 8;
    int64_t most_ns = INT64_MIN, before_ns = INT64_MIN;  // of the last ones, and of kMany before them
    int32_t count = 0;
    void add(int64_t lead_ns) noexcept {
      if (count == kMany) before_ns = std::exchange(most_ns, INT64_MIN), count = 0;
      most_ns = std::max(most_ns, lead_ns);
      ++count;
    }
    int64_t usual_ns() const noexcept { return std::max(most_ns, before_ns); }
  };
  struct Source {
    bool any = false;            // had a good stamp
    bool silent = false;         // according to the time from ovt_advance
    bool back = false;           // stepped back and is still behind the others: no evidence against them
    int64_t good_ns = 0;         // newest good stamp
    int64_t interval_ns = 0;     // the shorter of its last two intervals between good stamps
    int64_t before_ns = 0;       // the last interval
    int32_t suspects = 0;        // increasing suspect stamps in a row
    int32_t late = 0;            // suspects classified kLate, up to kAgreeing
    int64_t suspect_ns = 0;      // the last suspect stamp
    int64_t step_ns = 0;         // from the stamp before it, of the first one from the newest good stamp
    int64_t before_step_ns = 0;  // the step before that
    bool continued = false;      // the last suspect continues the earlier stamps
    bool keeps_pace = false;  // the last suspect is no further from its last good stamp than the others came since then
    int64_t base_ns = 0;      // newest stamp of the others when this one was held
    int32_t named = 0;        // good stamps until the source is no longer a suspect
    // Since its last good stamp: it had a suspect one, when the newest good stamp of the others was others_ns, and they
    // went on from there.
    bool is_opposed = false, contradicted = false;
    int64_t others_ns = 0;
    Leads leads;
  };
  // Number of stamps of one source since a sensor's last good stamp, and in the sensor's last two intervals that had
  // any: an interval without one tells nothing of the rate at which the source will come back. 0: not known yet.
  struct Heard {
    int32_t since = 0, usual = 0, before = 0;
    int32_t rhythm() const noexcept { return std::max({1, usual, before}); }
    int32_t patience() const noexcept { return before == 0 ? kLongPatience : rhythm() + 1; }
  };
  struct Others {
    int32_t good = 0;   // sensors that currently deliver good stamps
    int32_t fresh = 0;  // good sensors that are not overdue
    int64_t newest_ns = INT64_MIN;
    int32_t since = 1;  // stamps of the source, this one too, after that
  };
  Others look_at_others(int32_t source) const noexcept;
  bool has_quorum(int32_t source) const noexcept;
  bool majority_says(int32_t source, int64_t stamp_ns, const Others& others) const noexcept;
  bool agrees(const Source& other, int64_t stamp_ns) const noexcept;
  bool continues(int32_t source, int64_t stamp_ns) const noexcept;
  bool keeps_pace(int32_t source, int64_t stamp_ns) const noexcept;
  int64_t interval_of(const Source& source) const noexcept;
  bool is_consistent(int64_t step_ns, int64_t before_ns) const noexcept;
  int64_t longest_gap_ns(const Source& source) const noexcept;
  bool starts() const noexcept;
  bool is_good(int32_t source, int64_t stamp_ns, const Others& others) const noexcept;
  StampVerdict take_good(int32_t source, int64_t stamp_ns) noexcept;
  StampVerdict jump(int32_t source, int64_t stamp_ns) noexcept;
  void note_good(int32_t source, int64_t stamp_ns) noexcept;
  void accept(int32_t source) noexcept;
  void reject(int32_t source) noexcept;
  void look_at_held(bool after_gap) noexcept;

  int32_t sensor_count_;
  int64_t period_ns_, tolerance_ns_, near_ns_, max_gap_ns_;
  Source sources_[kSources];
  Heard heard_[kSources][kMaxSensors];  // [source][since whose good stamp]
  int32_t classified_ = 0;              // stamps of sensors since the clock started, saturated
  bool any_ = false, any_sensor_ = false;
  int64_t newest_ns_ = 0;
  uint32_t held_ = 0, accepted_ = 0, rejected_ = 0;
  int32_t late_before_jump_ = 0;
};

}  // namespace overtake
