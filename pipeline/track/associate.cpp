// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// From a frame's rows to pairs of track and measurement: usable rows, gates, global nearest neighbour.
#include <algorithm>
#include <cmath>
#include <cstring>
#include <tuple>

#include "core/math.h"
#include "pipeline/track/tracker_state.h"

namespace overtake {
namespace {

bool is_measurement(const Measurement& z, int64_t frame_ns) noexcept {
  return std::fabs(z.x_m) <= kMaxPlace_m && std::fabs(z.y_m) <= kMaxPlace_m &&
         std::fabs(seconds_between(frame_ns, z.stamp_ns)) <= kMaxStampSpread_s;
}

double value_or_none(double value, double low, double high) noexcept {
  return value >= low && value <= high ? value : kNotMeasured;
}

// With the measurement's own covariance where it is one, else R of the parameters.
Measurement make_sane(Measurement z, const double* r_diag) noexcept {
  if (!is_position_covariance(z.var_x, z.var_y, z.cov_xy)) {
    z.var_x = r_diag[0];
    z.var_y = r_diag[1];
    z.cov_xy = 0.0;
  }
  z.heading_rad = wrap_angle(value_or_none(z.heading_rad, -kMaxAngle_rad, kMaxAngle_rad));
  z.length_m = value_or_none(z.length_m, 0.0, 1e3);
  z.width_m = value_or_none(z.width_m, 0.0, 1e3);
  return z;
}

double distance_m2(const Measurement& z, const TrackerEgo& ego) noexcept {
  const double dx = z.x_m - (ego.known ? ego.x_m : 0.0), dy = z.y_m - (ego.known ? ego.y_m : 0.0);
  return dx * dx + dy * dy;
}

// The frame's measurements, at most detection_capacity: the nearest to the ego.
void select_measurement_rows(const TrackerParams& params, const TrackerFrame& frame, Iteration& it) noexcept {
  const Measurement* const given = frame.measurements.data();
  // Total orders that depend on what was measured; the row decides only between equals.
  const auto is_nearer = [&](int32_t i, int32_t k) {
    const Measurement &a = given[i], &b = given[k];
    const double of_a = distance_m2(a, it.ego), of_b = distance_m2(b, it.ego);
    return std::tie(of_a, a.stamp_ns, a.x_m, a.y_m, i) < std::tie(of_b, b.stamp_ns, b.x_m, b.y_m, k);
  };
  const auto is_earlier = [&](int32_t i, int32_t k) {
    const Measurement &a = given[i], &b = given[k];
    return std::tie(a.stamp_ns, a.x_m, a.y_m, i) < std::tie(b.stamp_ns, b.x_m, b.y_m, k);
  };
  int32_t* const kept = it.row;  // a heap with the farthest on top once it is full
  int32_t count = 0;
  it.rejected = it.unread = 0;
  for (int32_t row = 0; row < int32_t(frame.measurements.size()); ++row) {
    if (!is_measurement(given[row], frame.stamp_ns)) {
      ++it.rejected;
      continue;
    }
    if (count < params.detection_capacity) {
      kept[count++] = row;
      if (count == params.detection_capacity) std::make_heap(kept, kept + count, is_nearer);
      continue;
    }
    ++it.unread;
    if (!is_nearer(row, kept[0])) continue;
    std::pop_heap(kept, kept + count, is_nearer);
    kept[count - 1] = row;
    std::push_heap(kept, kept + count, is_nearer);
  }
  std::sort(kept, kept + count, is_earlier);
  it.count = count;
}

// A track predicted to the stamp it was last asked for: the measurements of a frame come in stamp order, most of them
// with few stamps, and most pairs are too far apart to need the covariance. What is predicted stays for the update.
class TrackAtStamp {
 public:
  TrackAtStamp(const Tracker::State& state, const Track& track, Prediction& prediction)
      : state_(state), track_(track), prediction_(prediction) {
    prediction_.there = false;
  }

  void go_to(int64_t stamp_ns) noexcept {
    if (asked_ && stamp_ns == stamp_ns_) return;
    asked_ = true;
    stamp_ns_ = stamp_ns;
    dt_s_ = seconds_between(track_.state_ns, stamp_ns);
    at_.state = advance(track_.estimate.mean, dt_s_, &at_.jacobian);
  }
  double distance_m2(const Measurement& z) const noexcept {
    const double dx = z.x_m - at_.state.x_m, dy = z.y_m - at_.state.y_m;
    return dx * dx + dy * dy;
  }
  const TrackEstimate& estimate() noexcept {
    if (!prediction_.is_at(stamp_ns_)) {
      prediction_ = {true, stamp_ns_, track_.estimate};
      overtake::predict(prediction_.estimate, state_.noise, dt_s_, &at_);
    }
    return prediction_.estimate;
  }

 private:
  const Tracker::State& state_;
  const Track& track_;
  Prediction& prediction_;
  int64_t stamp_ns_ = 0;
  double dt_s_ = 0;
  Advanced at_;
  bool asked_ = false;
};

// How far from its state a track may be matched after so long.
double reach_m2(const Tracker::State& state, const Track& track, double dt_s) noexcept {
  const double reach_m = (state.params.gate_m + track.estimate.mean.speed_mps * std::fabs(dt_s)) * (1.0 + 1e-9);
  return reach_m * reach_m;
}

// Whether one of kBlock measurements is so near: most are not.
constexpr int32_t kBlock = 8;
bool is_any_near(const Tracker::State& state, int32_t first, double x_m, double y_m, double most_m2) noexcept {
  using Pair = double __attribute__((vector_size(16)));
  using Bits = int64_t __attribute__((vector_size(16)));
  const Pair x = {x_m, x_m}, y = {y_m, y_m}, most = {most_m2, most_m2};
  Bits near = {0, 0};
  for (int32_t i = first; i < first + kBlock; i += 2) {
    Pair cx, cy;
    std::memcpy(&cx, state.measured_x_m + i, sizeof cx);
    std::memcpy(&cy, state.measured_y_m + i, sizeof cy);
    const Pair dx = cx - x, dy = cy - y;
    near |= Bits(dx * dx + dy * dy <= most);
  }
  return (near[0] | near[1]) != 0;
}

// The measurements that some prediction may bring within the gate, in state.within_reach; a block that is too far as a
// whole is passed over. Measurements are in stamp order, so the first or the last is the farthest away in time.
int32_t find_within_reach(Tracker::State& state, const Iteration& it, const Track& track) noexcept {
  const int32_t last = it.count - 1;
  const double most_m2 =
      std::max(reach_m2(state, track, seconds_between(track.state_ns, it.measurement[0].stamp_ns)),
               reach_m2(state, track, seconds_between(track.state_ns, it.measurement[last].stamp_ns)));
  const double x_m = track.estimate.mean.x_m, y_m = track.estimate.mean.y_m;
  int32_t count = 0;
  for (int32_t begin = 0; begin <= last; begin += kBlock) {
    const int32_t end = std::min(begin + kBlock, last + 1);
    if (end - begin == kBlock && !is_any_near(state, begin, x_m, y_m, most_m2)) continue;
    for (int32_t i = begin; i < end; ++i) {
      const double dx = state.measured_x_m[i] - x_m, dy = state.measured_y_m[i] - y_m;
      state.within_reach[count] = i;
      count += dx * dx + dy * dy <= most_m2;
    }
  }
  return count;
}

// A step is what the assignment's search needs to look at a pair or a column. To gate a pair and to sort it in costs as
// much as so many of them; and so many measurements a track may look at in any case.
constexpr int64_t kStepsPerPair = 16;
constexpr int64_t kFewestNear = 8;

// Of the `count` measurements within reach the `most` nearest to where the track is at their time, in the same order.
void keep_nearest(Tracker::State& state, const Iteration& it, TrackAtStamp& at_stamp, int32_t count, int32_t most) {
  uint64_t* const nearest = state.nearest;
  for (int32_t k = 0; k < count; ++k) {
    const Measurement& c = it.measurement[state.within_reach[k]];
    at_stamp.go_to(c.stamp_ns);
    const auto distance_m2 = float(at_stamp.distance_m2(c));  // its bits are in the order of its value: none is < 0
    uint32_t bits;
    std::memcpy(&bits, &distance_m2, sizeof bits);
    nearest[k] = uint64_t(bits) << 32 | uint32_t(state.within_reach[k]);
  }
  std::nth_element(nearest, nearest + most, nearest + count);
  for (int32_t k = 0; k < most; ++k) state.within_reach[k] = int32_t(uint32_t(nearest[k]));
  std::sort(state.within_reach, state.within_reach + most);
}

// At most `most_near` measurements are gated with the track.
void gate_track(Tracker::State& state, Iteration& it, int32_t slot, int32_t most_near) noexcept {
  const Track& track = state.tracks[slot];
  const MotionState& mean = track.estimate.mean;
  const double gate_m2 = state.params.gate_m * state.params.gate_m;
  TrackAtStamp at_stamp(state, track, state.predictions[slot]);
  int32_t near_count = find_within_reach(state, it, track);
  if (near_count > most_near) {
    keep_nearest(state, it, at_stamp, near_count, most_near);
    near_count = most_near;
    it.limited = true;
  }
  it.work += kStepsPerPair * near_count;
  for (int32_t k = 0; k < near_count; ++k) {
    const int32_t i = state.within_reach[k];
    const Measurement& c = it.measurement[i];
    const double dt_s = seconds_between(track.state_ns, c.stamp_ns);
    if (dt_s < -kMaxBackward_s) continue;
    const double dx = c.x_m - mean.x_m, dy = c.y_m - mean.y_m;
    if (!(dx * dx + dy * dy <= reach_m2(state, track, dt_s))) continue;

    at_stamp.go_to(c.stamp_ns);
    if (!(at_stamp.distance_m2(c) <= gate_m2)) continue;
    Innovation innovation;
    if (!innovate(at_stamp.estimate(), c, &innovation) || !(innovation.d2 <= state.params.gate_d2)) continue;
    state.munkres.add(slot, i, innovation.d2 + innovation.log_det);
  }
}

}  // namespace

void select_measurements(const TrackerParams& params, const TrackerFrame& frame, Iteration& it) noexcept {
  select_measurement_rows(params, frame, it);
  for (int32_t i = 0; i < it.count; ++i) {
    const Measurement& z = frame.measurements[std::size_t(it.row[i])];
    it.measurement[i] = make_sane(z, params.r_diag);
    it.ego_distance_m2[i] = distance_m2(z, it.ego);
  }
}

void associate(Tracker::State& state, Iteration& it) noexcept {
  const int32_t slot_count = state.params.track_capacity;
  std::fill_n(it.slot, it.count, -1);
  state.munkres.clear(slot_count, it.count);
  for (int32_t i = 0; i < it.count; ++i) {
    state.measured_x_m[i] = it.measurement[i].x_m;
    state.measured_y_m[i] = it.measurement[i].y_m;
  }
  const auto limit = int64_t(state.params.work_limit);
  const int64_t near_share = limit / 2 / kStepsPerPair / std::max(state.alive_count, 1);
  const auto most_near = int32_t(std::min(std::max(near_share, kFewestNear), int64_t(INT32_MAX)));
  it.work = 0;
  it.limited = false;
  if (it.count > 0)
    for (int32_t slot = 0; slot < slot_count; ++slot)
      if (state.tracks[slot].alive) gate_track(state, it, slot, most_near);
  state.munkres.solve(state.measurement_of_slot, std::max(limit - it.work, int64_t(0)));
  it.work += state.munkres.steps();
  it.limited |= state.munkres.was_limited();
  for (int32_t slot = 0; slot < slot_count; ++slot) {
    const int32_t c = state.measurement_of_slot[slot];
    if (c >= 0) it.slot[c] = slot;
  }
}

}  // namespace overtake
