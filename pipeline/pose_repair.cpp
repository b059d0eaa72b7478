// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
#include "pipeline/pose_repair.h"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <utility>

#include "core/math.h"
#include "pipeline/clock_watch.h"

namespace overtake {
namespace {

constexpr double kWindow_s = 1.0, kLeastWindow_s = 0.8;
constexpr int64_t kShortestStepNs = 9'000'000;  // of two samples: a window of them has room
constexpr int64_t kHeldNs = 150'000'000;        // so long speed and yaw tell the place of a held pose
constexpr int32_t kOlderMost = 2;               // late poses in a row: the time went back
// A gyroscope errs by less, and so do the yaws of a localisation over half a second.
constexpr double kWrongRate_rps = 0.03, kRightRate_rps = 0.015, kRateSigmas = 3.0;
constexpr double kBend_rps = 0.1;  // in less of a bend, a yaw rate of the wrong sign agrees, too
constexpr double kRateWindow_s = 0.25, kMostRate_rps = 100.0;
constexpr int32_t kFewestOfRate = 4, kFewestBends = 8;
constexpr double kNoiseStep_s = 0.155;  // noise shows over this, also that of places that are held for so long
constexpr double kSmooth_s = 0.6;       // of the line: an acceleration that speed and attitude do not tell bends it
// Larger noise of a place is smoothed. An error of z is one of the road: 3 cm of it in 20 m is 0.12 m at 80 m. Beyond
// kMostNoise_m there is no line.
constexpr double kNoise_m[] = {0.05, 0.05, 0.03}, kMostNoise_m = 1.0;
constexpr double kJump_m = 0.5, kJumpSigmas = 6.0;  // farther from the line: a jump
constexpr double kSigmaOfMedian = 1.4826;           // the standard deviation, from the median of the absolute values

// Least squares: the line through values over times.
struct Line {
  double mean_t = 0, mean = 0, slope = 0, slope_sigma = 0;
  template <class Time, class Value>
  Line(int32_t first, int32_t last, Time&& t, Value&& value) noexcept {
    const int32_t n = last - first;
    for (int32_t i = first; i < last; ++i) mean_t += t(i), mean += value(i);
    mean_t /= n, mean /= n;
    double tt = 0, tv = 0, vv = 0;
    for (int32_t i = first; i < last; ++i) {
      const double dt = t(i) - mean_t, dv = value(i) - mean;
      tt += dt * dt, tv += dt * dv, vv += dv * dv;
    }
    if (!(tt > 0)) return;
    slope = tv / tt;
    if (n > 2) slope_sigma = std::sqrt(std::max(vv - slope * tv, 0.0) / (n - 2) / tt);
  }
  double at(double t) const noexcept { return mean + slope * (t - mean_t); }
};

double median_of(double* values, int32_t count) noexcept {
  std::nth_element(values, values + count / 2, values + count);
  return values[count / 2];
}

struct Velocity {  // along the vehicle's x axis, in the map
  double mps[3];
};
Velocity velocity_of(const EgoPose& pose) noexcept {
  double sine, cosine, down, level;
  sin_cos_f64(pose.yaw_rad, sine, cosine);
  sin_cos_f64(pose.pitch_rad, down, level);
  return {{pose.speed_mps * level * cosine, pose.speed_mps * level * sine, -pose.speed_mps * down}};
}

double seconds(int64_t later_ns, int64_t earlier_ns) noexcept {
  return double(difference_ns(later_ns, earlier_ns)) * 1e-9;
}

}  // namespace

void PoseRepair::begin(const EgoPose& pose) noexcept {
  begin_ns_ = pose.stamp_ns;
  origin_m_[0] = pose.x_m, origin_m_[1] = pose.y_m, origin_m_[2] = pose.z_m;
  turn_rad_ = turn_by_rate_rad_ = places_from_s_ = 0;
  std::fill(std::begin(way_m_), std::end(way_m_), 0.0);
  first_ = count_ = 0;
  last_ = pose;
}

// Adds the way from the last pose to this one, and a sample.
void PoseRepair::add(const EgoPose& pose) noexcept {
  const double dt_s = seconds(pose.stamp_ns, last_.stamp_ns), t_s = seconds(pose.stamp_ns, begin_ns_);
  const Velocity before = velocity_of(last_), now = velocity_of(pose);
  turn_rad_ += wrap_angle(pose.yaw_rad - last_.yaw_rad);
  turn_by_rate_rad_ += 0.5 * (last_.yaw_rate_rps + pose.yaw_rate_rps) * dt_s;
  for (int32_t k = 0; k < 3; ++k) way_m_[k] += 0.5 * (before.mps[k] + now.mps[k]) * dt_s;
  last_ = pose;
  if (count_ > 0 && difference_ns(pose.stamp_ns, added_ns_) < kShortestStepNs) return;
  added_ns_ = pose.stamp_ns;
  while (count_ > 0 && (count_ == kCapacity || at(0).t_s < t_s - kWindow_s))
    first_ = (first_ + 1) % kCapacity, --count_;
  const double place[] = {pose.x_m, pose.y_m, pose.z_m};
  Sample& sample = ring_[(first_ + count_++) % kCapacity];
  sample = {t_s, turn_rad_, turn_rad_ - turn_by_rate_rad_, {}};
  for (int32_t k = 0; k < 3; ++k) sample.off_m[k] = place[k] - origin_m_[k] - way_m_[k];
}

// Whether the place is that of the last pose. A vehicle whose place never moved may stand on rollers.
bool PoseRepair::hold(EgoPose& pose, int64_t step_ns) noexcept {
  if (!is_moving(pose)) return false;
  if (pose.x_m != last_.x_m || pose.y_m != last_.y_m) {
    has_moved_ = true;
    return false;
  }
  if (!has_moved_) return false;
  const double dt_s = double(step_ns) * 1e-9;
  if (rate_wrong_) pose.yaw_rate_rps = rate_rps_;
  if (pose.yaw_rad == last_.yaw_rad) pose.yaw_rad = wrap_angle(last_.yaw_rad + dt_s * pose.yaw_rate_rps);
  const Velocity before = velocity_of(last_), now = velocity_of(pose);
  double* const place[] = {&pose.x_m, &pose.y_m, &pose.z_m};
  const double from[] = {last_.x_m, last_.y_m, last_.z_m};
  for (int32_t k = 0; k < 3; ++k) *place[k] = from[k] + 0.5 * (before.mps[k] + now.mps[k]) * dt_s;
  return true;
}

// A step of the yaws is in one half of the window only: the yaw rates must be wrong in both halves, and by the same
// sign. On a bank the rate about the vehicle's axis and that of the yaw differ by the cosine of its roll: either is
// right.
bool PoseRepair::is_rate_wrong() noexcept {
  const int32_t half = count_ / 2;
  if (half < kFewestOfRate || at(count_ - 1).t_s - at(0).t_s < kLeastWindow_s) return rate_wrong_;
  double sine, cosine;
  sin_cos_f64(last_.roll_rad, sine, cosine);
  const auto time = [&](int32_t i) { return at(i).t_s; };
  const auto off = [&](int32_t i) { return at(i).off_rad; };
  const Line early(0, half, time, off), late(half, count_, time, off);
  const double turn_rps = (at(count_ - 1).turn_rad - at(0).turn_rad) / (at(count_ - 1).t_s - at(0).t_s);
  const double about_axis_rps = std::fabs(turn_rps) * (1.0 - std::min(std::fabs(cosine), 1.0));
  const auto is_off = [&](const Line& line) {
    return std::fabs(line.slope) > kWrongRate_rps + about_axis_rps + kRateSigmas * line.slope_sigma;
  };
  const auto is_right = [&](const Line& line) { return std::fabs(line.slope) < kRightRate_rps + about_axis_rps; };
  if (rate_wrong_)
    rate_wrong_ = !(std::fabs(turn_rps) > kBend_rps && is_right(early) && is_right(late));
  else
    rate_wrong_ = is_off(early) && is_off(late) && (early.slope > 0) == (late.slope > 0);
  return rate_wrong_;
}

// Whether the noise of an axis is larger; then place_m becomes the line's. The noise is that of how far a place is from
// the line through two before it: neither a steady error of the speed nor a steady acceleration is in it.
bool PoseRepair::smooth(int32_t axis, double noise_m, double& place_m) noexcept {
  const auto time = [&](int32_t i) { return at(i).t_s; };
  const auto off = [&](int32_t i) { return at(i).off_m[axis]; };
  int32_t begin = 0;
  while (begin < count_ && time(begin) < places_from_s_) ++begin;
  double bend_m[kCapacity];
  int32_t bends = 0;
  for (int32_t i = begin, middle = begin, first = begin; i < count_; ++i) {
    while (time(i) - time(middle) > kNoiseStep_s) ++middle;
    while (time(middle) - time(first) > kNoiseStep_s) ++first;
    const double after_s = time(i) - time(middle), before_s = time(middle) - time(first);
    if (std::min(after_s, before_s) < 0.5 * kNoiseStep_s) continue;
    const double ratio = after_s / before_s;  // the line through the first two, at the third
    bend_m[bends++] = (off(i) - off(middle) - ratio * (off(middle) - off(first))) /
                      std::sqrt(1.0 + (1.0 + ratio) * (1.0 + ratio) + ratio * ratio);
  }
  if (bends < kFewestBends) return false;
  const double usual_m = median_of(bend_m, bends);
  for (int32_t i = 0; i < bends; ++i) bend_m[i] = std::fabs(bend_m[i] - usual_m);
  const double sigma_m = kSigmaOfMedian * median_of(bend_m, bends);
  if (!(sigma_m > noise_m && sigma_m < kMostNoise_m)) return false;
  int32_t from = count_ - 1;
  while (from > begin && time(count_ - 1) - time(from - 1) <= kSmooth_s) --from;
  const double t_s = seconds(last_.stamp_ns, begin_ns_);
  const double on_line_m = origin_m_[axis] + way_m_[axis] + Line(from, count_, time, off).at(t_s);
  if (!(std::fabs(place_m - on_line_m) <= std::max(kJump_m, kJumpSigmas * sigma_m))) {
    places_from_s_ = t_s;  // the line begins anew
    return false;
  }
  place_m = on_line_m;
  return true;
}

uint32_t PoseRepair::repair(EgoPose& pose) noexcept {
  if (!is_built_) return 0;
  const bool had_last = std::exchange(has_last_, true);
  const int64_t step_ns = had_last ? difference_ns(pose.stamp_ns, last_.stamp_ns) : 0;
  if (had_last && step_ns <= 0 && step_ns >= -kLateNs) {
    older_ += step_ns < 0;
    if (older_ < kOlderMost) return 0;  // the buffer refuses it
  }
  older_ = 0;
  if (had_last && step_ns > 0 && hold(pose, step_ns))
    return uint32_t(Found::kHeld) | (step_ns > kHeldNs ? uint32_t(Found::kLost) : 0u);
  uint32_t found = 0;
  if (!had_last || step_ns <= 0 || step_ns > kEgoStepNs) begin(pose);
  add(pose);
  if (is_rate_wrong()) {
    int32_t from = count_ - 1;
    while (from > 0 && at(count_ - 1).t_s - at(from).t_s < kRateWindow_s) --from;
    if (count_ - from > 1) {
      const auto turn = [&](int32_t i) { return at(i).turn_rad; };
      const Line line(
          from, count_, [&](int32_t i) { return at(i).t_s; }, turn);
      rate_rps_ = std::clamp(line.slope, -kMostRate_rps, kMostRate_rps);
    }
    pose.yaw_rate_rps = rate_rps_;
    found |= uint32_t(Found::kWrongRate);
  }
  double* const place[] = {&pose.x_m, &pose.y_m, &pose.z_m};
  for (int32_t axis = 0; axis < 3; ++axis)
    if (smooth(axis, kNoise_m[axis], *place[axis])) found |= uint32_t(Found::kNoise);
  return found;
}

}  // namespace overtake
