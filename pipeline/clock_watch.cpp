// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
#include "pipeline/clock_watch.h"

namespace overtake {

StampVerdict ClockWatch::classify(int32_t source, int64_t stamp_ns) noexcept {
  Source& s = sources_[source];
  const bool is_sensor = source != kExternal;
  for (Heard& heard : heard_[source]) heard.since = std::min(heard.since + 1, 2 * kMaxRatio);
  if (is_sensor) classified_ = std::min(classified_ + 1, 2 * kMaxSensors + 1);

  // No sensor has delivered a stamp yet: the time of pushed detections does not bind the first sensor.
  const int64_t ahead = any_ ? difference_ns(stamp_ns, newest_ns_) : 0;
  if (is_sensor && !any_sensor_ && (ahead > max_gap_ns_ || ahead < -kLateNs)) return jump(source, stamp_ns);

  const Others others = look_at_others(source);
  if (is_good(source, stamp_ns, others)) {
    if (others.good > 0) s.leads.add(difference_ns(stamp_ns, others.newest_ns));
    return take_good(source, stamp_ns);
  }

  const bool continued = is_sensor && !s.continued && continues(source, stamp_ns);
  s.keeps_pace = is_sensor && keeps_pace(source, stamp_ns);
  if (is_sensor && (held_ >> source & 1u)) reject(source);
  const bool is_first = s.suspects == 0;
  const int64_t step_ns = is_first && !s.any ? 0 : difference_ns(stamp_ns, is_first ? s.good_ns : s.suspect_ns);
  if (is_first || !is_consistent(step_ns, s.step_ns)) s.suspects = s.late = 0;
  s.before_step_ns = std::exchange(s.step_ns, step_ns);
  s.suspects = std::min(s.suspects + 1, kAgreeing);
  s.suspect_ns = stamp_ns;
  if (others.good > 0) {
    if (!s.is_opposed) s.others_ns = others.newest_ns;
    s.is_opposed = true;
    if (difference_ns(others.newest_ns, s.others_ns) > near_ns_) s.contradicted = true;
  }
  s.continued = continued;
  const bool gap = ahead >= 0 && ahead <= max_gap_ns_;
  if (is_sensor && (gap || starts()) && majority_says(source, stamp_ns, others)) {
    if (!gap) return jump(source, stamp_ns);
    // None of the majority was wrong.
    for (int32_t i = 0; i < kMaxSensors; ++i)
      if (i == source || agrees(sources_[i], stamp_ns)) sources_[i].named = 0;
    return take_good(source, stamp_ns);
  }
  if (s.suspects == kAgreeing && has_quorum(source)) return jump(source, stamp_ns);
  if (gap || (is_sensor && starts())) {
    if (is_sensor) held_ |= 1u << source;
    s.base_ns = others.newest_ns;
    return StampVerdict::kHold;
  }
  s.late = std::min(s.late + 1, kAgreeing);
  note_suspect(source);
  return StampVerdict::kLate;
}

StampVerdict ClockWatch::classify_held(int64_t stamp_ns, int64_t base_ns) const noexcept {
  const Others others = look_at_others(kExternal);
  if (is_good(kExternal, stamp_ns, others)) return StampVerdict::kGood;
  if (others.good > 0 && difference_ns(others.newest_ns, base_ns) <= near_ns_) return StampVerdict::kHold;
  return StampVerdict::kLate;
}

ClockWatch::Others ClockWatch::look_at_others(int32_t source) const noexcept {
  Others others;
  const bool contradicted = sources_[source].contradicted;
  for (int32_t i = 0; i < kMaxSensors; ++i) {
    const Source& other = sources_[i];
    const Heard& heard = heard_[source][i];
    if (i == source || !other.any || other.silent || other.back || other.suspects > 0 || other.named > 0 ||
        heard.since > (contradicted ? kLongPatience : heard.patience()))
      continue;
    ++others.good;
    if (heard.since <= heard.rhythm()) ++others.fresh;
    if (other.good_ns > others.newest_ns) others.newest_ns = other.good_ns, others.since = heard.since;
  }
  return others;
}

bool ClockWatch::is_good(int32_t source, int64_t stamp_ns, const Others& others) const noexcept {
  if (!any_) return true;
  const int64_t ahead = difference_ns(stamp_ns, newest_ns_);
  if (ahead < -kLateNs) return false;
  if (others.good == 0) return ahead <= longest_gap_ns(sources_[source]);
  const int64_t lead = difference_ns(stamp_ns, others.newest_ns);
  if (lead <= near_ns_) return true;
  if (source == kExternal) return false;
  const int64_t most_ns = kLateNs - 2 * near_ns_;  // beyond it the others would become late
  // No step: the others are always so far behind, because their scans take longer on their way.
  if (lead <= std::min(later_ns(sources_[source].leads.usual_ns(), tolerance_ns_), most_ns)) return true;
  if (!continues(source, stamp_ns)) return false;
  // No step: since the others' newest stamp, this sensor has delivered one each interval. The others lose scans.
  if (lead <= near_ns_ + (others.since - 1) * interval_of(sources_[source])) return true;
  // No step: the others are overdue, or one of two drifts.
  return others.fresh <= 1 && lead <= most_ns;
}

// Whether a sensor's stamp continues the earlier ones: its last good stamp, or the first held one after that.
bool ClockWatch::continues(int32_t source, int64_t stamp_ns) const noexcept {
  const Source& s = sources_[source];
  const int64_t last_ns = (held_ >> source & 1u) && s.continued ? s.suspect_ns : s.good_ns;
  const int64_t interval_ns = s.interval_ns > 0 ? interval_of(s) : kMostPeriods * period_ns_;  // of its second stamp
  return s.any && difference_ns(stamp_ns, last_ns) <= tolerance_ns_ + interval_ns;
}

// Whether a sensor's stamp is no further from its last good one than the others came meanwhile, by the number of their
// stamps. True when nothing is known: before its first good stamp, and after a silence.
bool ClockWatch::keeps_pace(int32_t source, int64_t stamp_ns) const noexcept {
  const Source& s = sources_[source];
  if (!s.any) return true;
  int64_t time_ns = interval_of(s);
  for (int32_t i = 0; i < kMaxSensors; ++i) {
    if (i == source || !sources_[i].any) continue;
    const int32_t since = heard_[i][source].since;
    if (since > kMaxRatio && s.suspects == 0) return true;
    time_ns = std::max(time_ns, since * interval_of(sources_[i]));
  }
  return difference_ns(stamp_ns, s.good_ns) <= tolerance_ns_ + time_ns;
}

// Whether a suspect stamp goes on from the one before it: by a short step, or, of a slow source, by about the same one.
// (Of several sensors, frame.period tells how slow they are.)
bool ClockWatch::is_consistent(int64_t step_ns, int64_t before_ns) const noexcept {
  if (step_ns <= 0) return false;
  if (step_ns <= max_gap_ns_) return true;
  if (sensor_count_ > 1 || before_ns <= 0) return false;
  return std::max(step_ns, before_ns) <= kSlowestNs && step_ns <= 2 * before_ns && before_ns <= 2 * step_ns;
}

// While no other source is good: of a slow source one stamp may be lost, as of any other.
int64_t ClockWatch::longest_gap_ns(const Source& source) const noexcept {
  if (source.interval_ns <= max_gap_ns_) return max_gap_ns_;
  return std::max(max_gap_ns_, std::min(2 * source.interval_ns + tolerance_ns_, kSlowestNs));
}

int64_t ClockWatch::interval_of(const Source& source) const noexcept {
  return std::clamp(source.interval_ns, period_ns_, kMostPeriods * period_ns_);
}

// During the first two rounds, while only one of several sensors has a good stamp.
bool ClockWatch::starts() const noexcept {
  if (sensor_count_ < 3 || classified_ > 2 * sensor_count_) return false;
  return std::count_if(sources_, sources_ + kMaxSensors, [](const Source& s) { return s.any; }) == 1;
}

// Whether another source's last suspect stamp is of the same time. The last step of its suspect stamps tells its
// interval where it has no good ones.
bool ClockWatch::agrees(const Source& other, int64_t stamp_ns) const noexcept {
  if (other.suspects == 0) return false;
  const int64_t interval_ns = std::max(interval_of(other), other.suspects > 1 ? other.step_ns : 0);
  return distance_ns(other.suspect_ns, stamp_ns) <= tolerance_ns_ + interval_ns;
}

bool ClockWatch::majority_says(int32_t source, int64_t stamp_ns, const Others& others) const noexcept {
  int32_t agreeing = 1;
  for (int32_t i = 0; i < kMaxSensors; ++i) agreeing += i != source && agrees(sources_[i], stamp_ns);
  return agreeing > others.good;
}

// Whether the sensors that agree on a jump outnumber the good sensors. Pushed detections have no vote, but while no
// sensor is good they may report a jump.
bool ClockWatch::has_quorum(int32_t source) const noexcept {
  const Others others = look_at_others(source);
  if (source == kExternal) return others.good == 0;
  int32_t jumped = 1;
  for (int32_t i = 0; i < kMaxSensors; ++i)
    jumped += i != source && sources_[i].suspects >= kAgreeing && agrees(sources_[i], sources_[source].suspect_ns);
  return jumped > others.good;
}

StampVerdict ClockWatch::take_good(int32_t source, int64_t stamp_ns) noexcept {
  const bool after_gap = !continues(source, stamp_ns);
  note_good(source, stamp_ns);
  if (source == kExternal) return StampVerdict::kGood;
  if (held_ >> source & 1u) {  // its own held stamp is accepted if older than the new one, else rejected
    if (sources_[source].suspect_ns < stamp_ns) {
      accept(source);
    } else {
      reject(source);
    }
  }
  look_at_held(after_gap);
  return StampVerdict::kGood;
}

void ClockWatch::note_good(int32_t source, int64_t stamp_ns) noexcept {
  Source& s = sources_[source];
  // The source is behind the others and did not get there step by step.
  const int64_t step_ns = s.any ? difference_ns(stamp_ns, s.good_ns) : 0;
  if (s.any && (step_ns < period_ns_ / 2 || step_ns > tolerance_ns_ + std::max(period_ns_, s.interval_ns)))
    s.back = true;
  if (step_ns > 0) s.interval_ns = std::min(step_ns, std::exchange(s.before_ns, step_ns));
  s.good_ns = s.any ? std::max(s.good_ns, stamp_ns) : stamp_ns;
  s.any = true;
  s.silent = s.continued = s.is_opposed = s.contradicted = false;
  s.suspects = s.late = 0;
  if (s.named > 0) --s.named;
  // Detections move the time only if no sensor is good.
  if (source != kExternal || look_at_others(kExternal).good == 0)
    newest_ns_ = any_ ? std::max(newest_ns_, stamp_ns) : stamp_ns;
  any_ = true;
  if (difference_ns(newest_ns_, stamp_ns) <= near_ns_) s.back = false;
  if (source == kExternal) return;
  any_sensor_ = true;
  for (auto& who : heard_) {
    Heard& heard = who[source];
    if (heard.since > 0 && heard.since <= kMaxRatio) {  // more: the sensor was silent, which is no regular interval
      heard.before = heard.usual;
      heard.usual = heard.since;
    }
    heard.since = 0;
  }
}

void ClockWatch::accept(int32_t source) noexcept {
  held_ &= ~(1u << source);
  accepted_ |= 1u << source;
  Source& s = sources_[source];
  if (s.suspects == 0) return;
  s.leads.add(difference_ns(s.suspect_ns, s.base_ns));
  note_good(source, s.suspect_ns);
}

void ClockWatch::reject(int32_t source) noexcept {
  held_ &= ~(1u << source);
  rejected_ |= 1u << source;
  Source& s = sources_[source];
  if (s.suspects > 0) s.late = std::min(s.late + 1, kAgreeing);
  note_suspect(source);
}

void ClockWatch::reject_held() noexcept {
  for (int32_t i = 0; i < kMaxSensors; ++i)
    if (held_ >> i & 1u) reject(i);
}

// After a good stamp: accepts held stamps near to it, and rejects held stamps that it contradicts. A clock that stepped
// ahead by two periods comes near with each stamp of the others, too.
void ClockWatch::look_at_held(bool after_gap) noexcept {
  for (int32_t i = 0; i < kMaxSensors; ++i) {
    if (!(held_ >> i & 1u)) continue;
    const Others others = look_at_others(i);
    if (others.good == 0) continue;
    const int64_t stamp_ns = sources_[i].suspect_ns;
    const int64_t most_ns = after_gap || sources_[i].keeps_pace ? near_ns_ : tolerance_ns_;
    if (difference_ns(stamp_ns, others.newest_ns) <= most_ns && difference_ns(stamp_ns, newest_ns_) >= -kLateNs) {
      accept(i);
      i = -1;  // accepting this one may bring others near
    } else if (difference_ns(others.newest_ns, sources_[i].base_ns) > near_ns_) {
      reject(i);
    }
  }
}

StampVerdict ClockWatch::jump(int32_t source, int64_t stamp_ns) noexcept {
  late_before_jump_ = 0;
  int64_t agreed_ns[kMaxSensors];
  uint32_t agreed = 0;
  for (int32_t i = 0; i < kMaxSensors; ++i) {
    const Source& s = sources_[i];
    if (i == source || agrees(s, stamp_ns)) late_before_jump_ += std::min(s.late, kAgreeing - 1);
    if (!(held_ >> i & 1u)) continue;
    if (i != source && agrees(s, stamp_ns)) {
      agreed |= 1u << i;
      agreed_ns[i] = s.suspect_ns;
    } else {
      rejected_ |= 1u << i;
    }
  }
  const Source& jumped = sources_[source];
  const bool is_slow = jumped.suspects >= kAgreeing && std::min(jumped.step_ns, jumped.before_step_ns) > max_gap_ns_;
  const int64_t interval_ns = is_slow ? std::min(jumped.step_ns, jumped.before_step_ns) : 0;
  for (Source& s : sources_) s = {};
  sources_[source].interval_ns = sources_[source].before_ns = interval_ns;
  for (auto& who : heard_)
    for (Heard& heard : who) heard = {};
  held_ = 0;
  accepted_ |= agreed;
  classified_ = 0;
  any_ = any_sensor_ = false;
  note_good(source, stamp_ns);
  for (int32_t i = 0; i < kMaxSensors; ++i)
    if (agreed >> i & 1u) note_good(i, agreed_ns[i]);
  return StampVerdict::kJump;
}

// The limit is not 1.5 periods, as for frames: the time of a live caller's clock is ahead of the stamps by a scan's
// duration and its transport. A time far ahead only closes the open frame.
void ClockWatch::name_time(int64_t now_ns) noexcept {
  for (Source& s : sources_) {
    const int64_t silence_ns = difference_ns(now_ns, s.good_ns);
    if (s.any && silence_ns > 3 * period_ns_ + period_ns_ / 2 && silence_ns <= max_gap_ns_) s.silent = true;
  }
}

uint32_t ClockWatch::suspect_mask() const noexcept {
  uint32_t mask = 0;
  for (int32_t i = 0; i < kSources; ++i) mask |= uint32_t(sources_[i].named > 0) << i;
  return mask;
}

}  // namespace overtake
