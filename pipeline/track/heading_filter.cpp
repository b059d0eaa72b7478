// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
#include "pipeline/track/heading_filter.h"

#include <algorithm>

#include "core/math.h"

namespace overtake {
namespace {

constexpr double kGravity = 9.81;
constexpr double kSlowest_mps = 5.0;       // the curvature of a slower course is noise
constexpr double kTypicalSlip = 1e-3;      // rad per m/s^2: between the course of a race car and its axis
constexpr double kGate = 9.0;              // squared innovation over its variance, with
constexpr double kGateNoise = 4.0;         // times the variance of the walls: bounds err by twice their deviation, too
constexpr int32_t kContradictions = 120;   // walls in a row: the error of the heading has changed
constexpr double kLargestOffset = 0.0873;  // rad: 5 deg

// Growth of the standard deviations in a minute.
constexpr double kSlipWalk = 1e-4, kLeverWalk = 0.1, kConstantWalk = 1e-3;
constexpr double kMinute_s = 60.0;
constexpr double kLongestWalk_s = 600.0;

}  // namespace

void follow_course(const EgoWindow& in, EgoWindow& out) noexcept {
  out.count = in.count;
  double rate_rps = in.count > 0 ? in.poses[0].yaw_rate_rps : 0.0;
  for (int32_t i = 0; i < in.count; ++i) {
    EgoPose& pose = out.poses[i] = in.poses[i];
    if (i > 0) {
      const double dt = double(difference_ns(pose.stamp_ns, in.poses[i - 1].stamp_ns)) * 1e-9;
      rate_rps += dt / (dt + kTypicalSlip * std::max(pose.speed_mps, kSlowest_mps)) * (pose.yaw_rate_rps - rate_rps);
    }
    pose.yaw_rate_rps = rate_rps;
  }
}

HeadingCause cause_of(const EgoPose& pose) noexcept {
  double sr, cr, sp, cp;
  sin_cos_f64(pose.roll_rad, sr, cr);
  sin_cos_f64(pose.pitch_rad, sp, cp);
  return {pose.speed_mps * pose.yaw_rate_rps * cr + kGravity * sr * cp,
          pose.yaw_rate_rps / std::max(pose.speed_mps, kSlowest_mps)};
}

double HeadingFilter::State::offset_rad(const HeadingCause& cause, int32_t sensor,
                                        int32_t sensor_count) const noexcept {
  double offset = x[0] * cause.accel_mps2 + x[1] * cause.curvature_per_m;
  if (sensor >= 0) {
    offset += x[kCommon + sensor];
  } else if (sensor == kMean) {
    double sum = 0;
    for (int32_t s = 0; s < sensor_count; ++s) sum += x[kCommon + s];
    if (sensor_count > 0) offset += sum / double(sensor_count);
  }
  return std::clamp(offset, -kLargestOffset, kLargestOffset);
}

double HeadingFilter::State::variance(const HeadingCause& cause, int32_t sensor, int32_t sensor_count) const noexcept {
  double h[kSize] = {cause.accel_mps2, cause.curvature_per_m};
  for (int32_t s = 0; s < sensor_count; ++s)
    h[kCommon + s] = sensor < 0 ? 1.0 / double(sensor_count) : s == sensor ? 1.0 : 0.0;
  double sum = 0;
  for (int32_t i = 0; i < kCommon + sensor_count; ++i)
    for (int32_t k = 0; k < kCommon + sensor_count; ++k) sum += h[i] * p[i][k] * h[k];
  return std::max(sum, 0.0);
}

HeadingFilter::HeadingFilter(const HeadingFilterParams& params, int32_t sensor_count, const Allocator& allocator,
                             int64_t lead_ns)
    : params_(params), sensor_count_(sensor_count), kept_ns_(2 * kLagNs + lead_ns), base_(first_state()) {
  arena_.build_or_throw(allocator, [this](Carver& carver) { entries_ = carver.take<Entry>(std::size_t(kCapacity)); });
}

// The covariance of what is unknown before any wall.
void HeadingFilter::open(State& state) const noexcept {
  for (auto& row : state.p) std::fill(std::begin(row), std::end(row), 0.0);
  state.p[0][0] = params_.slip_sigma * params_.slip_sigma;
  state.p[1][1] = params_.lever_sigma_m * params_.lever_sigma_m;
  const double common = params_.constant_sigma_rad * params_.constant_sigma_rad;
  const double own = params_.mounting_sigma_rad * params_.mounting_sigma_rad;
  for (int32_t i = kCommon; i < kSize; ++i)
    for (int32_t k = kCommon; k < kSize; ++k) state.p[i][k] = common + (i == k ? own : 0.0);
  state.contradicted = 0;
  std::fill(std::begin(state.contradicted_by), std::end(state.contradicted_by), 0);
}

// The mounting of one sensor changed, while others agree with the model.
void HeadingFilter::open_constant(State& state, int32_t sensor) const noexcept {
  const int32_t at = kCommon + sensor;
  for (int32_t i = 0; i < kSize; ++i) state.p[at][i] = state.p[i][at] = 0.0;
  state.p[at][at] =
      params_.constant_sigma_rad * params_.constant_sigma_rad + params_.mounting_sigma_rad * params_.mounting_sigma_rad;
  state.contradicted_by[sensor] = 0;
}

HeadingFilter::State HeadingFilter::first_state() const noexcept {
  State state{};
  open(state);
  state.stamp_ns = INT64_MIN;
  return state;
}

double HeadingFilter::measure(const State& state, const HeadingCause& cause, int32_t sensor, const WallHeading& wall,
                              double& innovation) const noexcept {
  innovation = wall.offset_rad - state.offset_rad(cause, sensor, sensor_count_);
  const double noise = params_.wall_sigma_rad * params_.wall_sigma_rad + wall.variance;
  return innovation * innovation / (state.variance(cause, sensor, sensor_count_) + kGateNoise * noise);
}

// One Kalman step for each sensor with walls. The errors of neighbouring frames are the same errors of the map:
// together the frames of wall_memory_s count as one.
void HeadingFilter::step(State& state, const Entry& entry) const noexcept {
  const int32_t n = kCommon + sensor_count_;
  double repeats = 1.0;
  if (state.stamp_ns != INT64_MIN) {
    const double dt = std::clamp(double(difference_ns(entry.stamp_ns, state.stamp_ns)) * 1e-9, 0.0, kLongestWalk_s);
    const double minutes = dt / kMinute_s;
    state.p[0][0] += kSlipWalk * kSlipWalk * minutes;
    state.p[1][1] += kLeverWalk * kLeverWalk * minutes;
    for (int32_t i = kCommon; i < n; ++i) state.p[i][i] += kConstantWalk * kConstantWalk * minutes;
    if (dt < params_.wall_memory_s) repeats = params_.wall_memory_s / std::max(dt, 1e-3);
  }
  state.stamp_ns = entry.stamp_ns;
  for (int32_t s = 0; s < sensor_count_; ++s) {
    const WallHeading& wall = entry.walls[s];
    if (!wall.valid) continue;
    double innovation;
    if (measure(state, entry.cause, s, wall, innovation) > kGate) {
      ++state.contradicted_by[s];
      if (++state.contradicted >= kContradictions)
        open(state);
      else if (state.contradicted_by[s] >= kContradictions)
        open_constant(state, s);
      continue;
    }
    state.contradicted = state.contradicted_by[s] = 0;
    double h[kSize] = {entry.cause.accel_mps2, entry.cause.curvature_per_m}, ph[kSize], hph = 0;
    h[kCommon + s] = 1.0;
    for (int32_t i = 0; i < n; ++i) {
      ph[i] = 0;
      for (int32_t k = 0; k < n; ++k) ph[i] += state.p[i][k] * h[k];
    }
    for (int32_t i = 0; i < n; ++i) hph += h[i] * ph[i];
    const double noise = (params_.wall_sigma_rad * params_.wall_sigma_rad + wall.variance) * repeats;
    for (int32_t i = 0; i < n; ++i) {
      const double gain = ph[i] / (hph + noise);
      state.x[i] += gain * innovation;
      for (int32_t k = 0; k < n; ++k) state.p[i][k] -= gain * ph[k];
    }
  }
}

void HeadingFilter::add(int64_t stamp_ns, const HeadingCause& cause, const WallHeading* walls) noexcept {
  if (newest_ns_ != INT64_MIN && stamp_ns < newest_ns_ && difference_ns(newest_ns_, stamp_ns) > kLagNs) return;
  newest_ns_ = std::max(newest_ns_, stamp_ns);
  if (std::none_of(walls, walls + sensor_count_, [](const WallHeading& w) { return w.valid; })) return;
  if (count_ == kCapacity) {
    int32_t old = 1;
    while (old < count_ && difference_ns(newest_ns_, entries_[old].stamp_ns) > kept_ns_) ++old;
    base_ = entries_[old - 1].after;
    std::move(entries_ + old, entries_ + count_, entries_);
    count_ -= old;
  }
  int32_t place = count_;
  while (place > 0 && entries_[place - 1].stamp_ns > stamp_ns) --place;
  std::move_backward(entries_ + place, entries_ + count_, entries_ + count_ + 1);
  ++count_;
  entries_[place].stamp_ns = stamp_ns;
  entries_[place].cause = cause;
  std::copy_n(walls, sensor_count_, entries_[place].walls);
  for (int32_t i = place; i < count_; ++i) {
    entries_[i].after = i > 0 ? entries_[i - 1].after : base_;
    step(entries_[i].after, entries_[i]);
  }
}

const HeadingFilter::State& HeadingFilter::at(int64_t stamp_ns) const noexcept {
  int32_t place = count_;
  while (place > 0 &&
         (entries_[place - 1].stamp_ns >= stamp_ns || difference_ns(stamp_ns, entries_[place - 1].stamp_ns) <= kLagNs))
    --place;
  return place > 0 ? entries_[place - 1].after : base_;
}

bool HeadingFilter::contradicts(const State& state, const HeadingCause& cause,
                                const WallHeading* walls) const noexcept {
  int32_t seen = 0, against = 0;
  for (int32_t s = 0; s < sensor_count_; ++s) {
    if (!walls[s].valid) continue;
    double innovation;
    ++seen;
    against += measure(state, cause, s, walls[s], innovation) > kGate;
  }
  return 2 * against > seen;
}

void HeadingFilter::restart() noexcept {
  if (count_ > 0) base_ = entries_[count_ - 1].after;
  base_.stamp_ns = INT64_MIN;
  count_ = 0;
  newest_ns_ = INT64_MIN;
}

}  // namespace overtake
