// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
#include "pipeline/ego_buffer.h"

#include <algorithm>
#include <new>

#include "core/math.h"
#include "pipeline/clock_watch.h"

namespace overtake {
namespace {

constexpr int64_t kEgoJitterNs = 10'000'000;
constexpr int64_t kEgoSlowestNs = 150'000'000;  // while the interval is unknown: allows 10 Hz and a little less

// b - a in seconds, a <= b: exact to the nanosecond for current stamps, and without overflow for any stamp.
double seconds_from(int64_t a, int64_t b) noexcept { return double(uint64_t(b) - uint64_t(a)) * 1e-9; }

void fill_rotation(EgoState& state) noexcept {
  double sr, cr, sp, cp, sy, cy;
  sin_cos_f64(state.pose.roll_rad, sr, cr);
  sin_cos_f64(state.pose.pitch_rad, sp, cp);
  sin_cos_f64(state.pose.yaw_rad, sy, cy);
  // clang-format off
  const double r[9] = {cy * cp, cy * sp * sr - sy * cr, cy * sp * cr + sy * sr,
                       sy * cp, sy * sp * sr + cy * cr, sy * sp * cr - cy * sr,
                       -sp,     cp * sr,                cp * cr};
  // clang-format on
  std::copy(std::begin(r), std::end(r), std::begin(state.r));
}

EgoPose extrapolate(const EgoPose& from, int64_t stamp_ns) noexcept {
  EgoPose to = from;
  const double dt = double(difference_ns(stamp_ns, from.stamp_ns)) * 1e-9;
  const double half_turn = 0.5 * from.yaw_rate_rps * dt;
  double s, c;
  sin_cos_f64(from.yaw_rad + half_turn, s, c);
  const double way = from.speed_mps * dt * sinc(half_turn);
  to.x_m += way * c;
  to.y_m += way * s;
  to.yaw_rad = wrap_angle(from.yaw_rad + 2.0 * half_turn);
  to.stamp_ns = stamp_ns;
  return to;
}

EgoPose interpolate(const EgoPose& a, const EgoPose& b, int64_t stamp_ns) noexcept {
  const double u = seconds_from(a.stamp_ns, stamp_ns) / seconds_from(a.stamp_ns, b.stamp_ns);
  const auto mix = [u](double p, double q) { return p + u * (q - p); };
  const auto mix_angle = [u](double p, double q) { return wrap_angle(p + u * wrap_angle(q - p)); };
  EgoPose out;
  out.stamp_ns = stamp_ns;
  out.x_m = mix(a.x_m, b.x_m);
  out.y_m = mix(a.y_m, b.y_m);
  out.z_m = mix(a.z_m, b.z_m);
  out.roll_rad = mix_angle(a.roll_rad, b.roll_rad);
  out.pitch_rad = mix_angle(a.pitch_rad, b.pitch_rad);
  out.yaw_rad = mix_angle(a.yaw_rad, b.yaw_rad);
  out.speed_mps = mix(a.speed_mps, b.speed_mps);
  out.yaw_rate_rps = mix(a.yaw_rate_rps, b.yaw_rate_rps);
  out.has_attitude = a.has_attitude && b.has_attitude;
  return out;
}

}  // namespace

double EgoState::heading_to_map(double heading_rad) const noexcept {
  double s, c;
  sin_cos_f64(heading_rad, s, c);
  return atan2_f64(r[3] * c + r[4] * s, r[0] * c + r[1] * s);
}

// The inverse. On a banked track, a heading in the vehicle's plane differs from the heading in the map's plane.
double EgoState::heading_to_vehicle(double heading_rad) const noexcept {
  double s, c;
  sin_cos_f64(heading_rad, s, c);
  return atan2_f64(r[0] * s - r[3] * c, r[4] * c - r[1] * s);
}

EgoState state_of(const EgoPose& pose) noexcept {
  EgoState state;
  state.pose = pose;
  fill_rotation(state);
  return state;
}

bool EgoWindow::at(int64_t stamp_ns, EgoState& out, int64_t oldest_ns) const noexcept {
  if (count == 0) return false;
  const EgoPose& newest = poses[count - 1];
  out.age_ns = difference_ns(stamp_ns, newest.stamp_ns);
  if (out.age_ns > oldest_ns) return false;
  if (out.age_ns >= 0) {
    out.pose = extrapolate(newest, stamp_ns);
  } else if (stamp_ns < poses[0].stamp_ns) {
    out.age_ns = difference_ns(poses[0].stamp_ns, stamp_ns);
    if (out.age_ns > oldest_ns) return false;
    out.pose = extrapolate(poses[0], stamp_ns);
  } else {
    const EgoPose* after =
        std::upper_bound(poses, poses + count, stamp_ns, [](int64_t t, const EgoPose& p) { return t < p.stamp_ns; });
    out.age_ns = std::min(difference_ns(stamp_ns, after[-1].stamp_ns), difference_ns(after[0].stamp_ns, stamp_ns));
    if (out.age_ns > oldest_ns) return false;
    out.pose = interpolate(after[-1], after[0], stamp_ns);
  }
  fill_rotation(out);
  return true;
}

EgoBuffer::EgoBuffer(int32_t capacity, const Allocator& allocator)
    : capacity_(std::max(capacity, 2 * EgoWindow::kCapacity)) {
  arena_.build_or_throw(allocator,
                        [&](Carver& carver) { ring_ = carver.take<SharedWords<Entry>>(std::size_t(capacity_)); });
}

// Largest step between stamps that counts as regular: two intervals, because one pose may be lost.
int64_t EgoBuffer::rhythm_ns() const noexcept {
  return interval_ns_ > 0 ? 2 * interval_ns_ + kEgoJitterNs : kEgoSlowestNs;
}

void EgoBuffer::append(const EgoPose& pose, bool begins_run) noexcept {
  const int64_t n = count_.load(std::memory_order_relaxed);
  const int64_t step_ns = n > 0 ? difference_ns(pose.stamp_ns, last_stamp_ns_) : 0;
  if (n == 0 || begins_run) {
    run_ = n;
    run_from_ns_ = n > 0 && step_ns > 0 ? last_stamp_ns_ : INT64_MIN;
    run_stamp_ns_ = pose.stamp_ns;
  } else {
    interval_ns_ = std::min(std::max(step_ns, interval_ns_ - interval_ns_ / 8), kMaxGapNs);
  }
  last_stamp_ns_ = pose.stamp_ns;
  ring_[n % capacity_].store({pose, run_});  // the reader of these words sees a count of n or more
  count_.store(n + 1, std::memory_order_release);
}

void EgoBuffer::drop_waiting() noexcept {
  if (!std::exchange(waits_, false)) return;
  ++dropped_;
  refused_.fetch_add(1, std::memory_order_release);
}

ovt_status EgoBuffer::push(const EgoPose& pose) noexcept {
  const int64_t n = count_.load(std::memory_order_relaxed);
  if (n > 0 && pose.stamp_ns <= last_stamp_ns_) {
    if (pose.stamp_ns == last_stamp_ns_) return OVT_DUPLICATE;
    const bool undoes_step = pose.stamp_ns > run_from_ns_ && pose.stamp_ns < run_stamp_ns_;
    if (!undoes_step && difference_ns(last_stamp_ns_, pose.stamp_ns) <= kLateNs) return OVT_LATE;
    older_ = older_ > 0 && pose.stamp_ns > older_ns_ ? older_ + 1 : 1;
    older_ns_ = pose.stamp_ns;
    if (older_ < 3) {
      refused_.fetch_add(1, std::memory_order_release);
      return OVT_LATE;
    }
    drop_waiting();
    older_ = 0;
    first_.store(n, std::memory_order_relaxed);  // who sees the new count sees this, too
    append(pose, true);
    return OVT_OK;
  }
  older_ = 0;
  const int64_t step_ns = n > 0 ? difference_ns(pose.stamp_ns, last_stamp_ns_) : 0;
  if (step_ns <= rhythm_ns()) {
    drop_waiting();
    append(pose, false);
    return OVT_OK;
  }
  if (waits_) {
    // A slow or interrupted source: the next pose is as far from the waiting one as that was from the last.
    const int64_t waited_ns = difference_ns(waiting_.stamp_ns, last_stamp_ns_);
    const int64_t next_ns = difference_ns(pose.stamp_ns, waiting_.stamp_ns);
    if (next_ns == 0) return OVT_DUPLICATE;
    if (next_ns > 0 && next_ns <= std::max(rhythm_ns(), std::min(2 * std::min(waited_ns, kMaxGapNs), kMaxGapNs))) {
      waits_ = false;
      append(waiting_, true);
      append(pose, false);
      return OVT_OK;
    }
    drop_waiting();
  }
  waits_ = true;
  waiting_ = pose;
  return OVT_OK;
}

EgoRange EgoBuffer::range() const noexcept {
  EgoRange range;
  range.count = count_.load(std::memory_order_acquire);
  range.first = first_.load(std::memory_order_acquire);
  range.refused = refused_.load(std::memory_order_acquire);
  return range;
}

bool EgoBuffer::read(int64_t index, EgoPose& pose) const noexcept {
  pose = ring_[index % capacity_].load().pose;
  return index >= oldest_whole();
}

// The producer may overwrite the oldest entries while the consumer reads. So the consumer skips a quarter of the ring
// once the ring is full.
int64_t EgoBuffer::oldest_safe(const EgoRange& range) const noexcept {
  const int64_t pushed = horizon_ >= 0 ? horizon_ : count_.load(std::memory_order_acquire);
  return std::min(range.count, std::max(range.first, pushed - capacity_ + capacity_ / 4));
}

int64_t EgoBuffer::first_run_after(const EgoRange& range, int64_t run) const noexcept {
  const int64_t oldest = oldest_safe(range);
  int64_t begin = range.count;
  while (begin > oldest && run_at(begin - 1) > run) begin = std::max(oldest, run_at(begin - 1));
  return begin;
}

int64_t EgoBuffer::gaps_after(const EgoRange& range, int64_t run) const noexcept {
  const int64_t oldest = oldest_safe(range);
  int64_t sum_ns = 0;
  for (int64_t end = range.count; end > oldest && run_at(end - 1) > run;) {
    end = run_at(end - 1);
    if (end <= oldest) return INT64_MAX;
    const int64_t step_ns = difference_ns(stamp_at(end), stamp_at(end - 1));
    sum_ns = step_ns > INT64_MAX - sum_ns ? INT64_MAX : sum_ns + step_ns;
  }
  return sum_ns;
}

void EgoBuffer::copy_window(const EgoRange& range, int64_t first_ns, int64_t last_ns,
                            EgoWindow& window) const noexcept {
  constexpr int32_t kTries = 4;
  const int64_t count = range.count;
  for (int32_t k = 0; k < kTries; ++k) {
    const int64_t oldest = oldest_safe(range);
    const auto first_after = [&](int64_t stamp_ns, int64_t reach_ns) {  // first i with stamp_at(i) - stamp > reach
      int64_t low = oldest, high = count;
      while (low < high) {
        const int64_t middle = low + (high - low) / 2;
        if (difference_ns(stamp_at(middle), stamp_ns) > reach_ns) {
          high = middle;
        } else {
          low = middle + 1;
        }
      }
      return low;
    };
    const int64_t last = std::min(count, first_after(last_ns, kReachNs) + 1);
    const int64_t first = std::max({oldest, first_after(first_ns, -kReachNs) - 1, last - EgoWindow::kCapacity});
    window.count = 0;
    for (int64_t i = first; i < last; ++i)
      window.count = read(i, window.poses[window.count]) ? window.count + 1 : 0;  // nor are the older ones whole
    if (oldest == count || oldest >= oldest_whole()) return;  // else the producer may have misled the search
  }
}

}  // namespace overtake
