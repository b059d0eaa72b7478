// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
#include "pipeline/clock_watch.h"

namespace overtake {
namespace {

constexpr int32_t kAgreeing = 3;

}  // namespace

Believe ClockWatch::judge(int32_t source, int64_t stamp_ns) noexcept {
  Source& s = sources_[source];
  ++judged_;
  const int64_t ahead = any_ ? difference_ns(stamp_ns, newest_ns_) : 0;
  if (ahead <= max_gap_ns_ && ahead >= -kLateNs) {
    newest_ns_ = any_ ? std::max(newest_ns_, stamp_ns) : stamp_ns;
    any_ = true;
    s = {};
    s.good_at = judged_;
    return Believe::kGood;
  }
  const int64_t step = difference_ns(stamp_ns, s.suspect_ns);
  if (s.suspects == 0 || step <= 0 || step > max_gap_ns_) {
    s.suspects = s.behind = 0;
    s.suspect_at = judged_;
  }
  ++s.suspects;
  s.suspect_ns = stamp_ns;
  if (s.suspects < kAgreeing || !outvotes(source)) {
    if (ahead < 0) ++s.behind;
    return ahead < 0 ? Believe::kBehind : Believe::kAhead;
  }
  behind_before_jump_ = 0;
  for (int32_t i = 0; i < kSources; ++i) {
    if (i != kExternal) behind_before_jump_ += std::min(sources_[i].behind, kAgreeing - 1);
    sources_[i] = {};
  }
  s.good_at = judged_;
  newest_ns_ = stamp_ns;
  return Believe::kJump;
}

// Sensors that agree on a jump against sensors that were good since it began. Pushed detections have no vote, but while
// no sensor is good they may say that the clock jumped.
bool ClockWatch::outvotes(int32_t source) const noexcept {
  int32_t jumped = 0, good = 0;
  for (int32_t i = 0; i < kMaxSensors; ++i) {
    if (sources_[i].suspects >= kAgreeing) ++jumped;
    if (sources_[i].good_at > sources_[source].suspect_at) ++good;
  }
  return source == kExternal ? good == 0 : jumped > good;
}

}  // namespace overtake
