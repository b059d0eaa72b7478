// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// Global nearest neighbour for a policy: gates every pair of track and measurement, then assigns as many pairs as
// possible at the least total cost (munkres.h). The policy has these members besides those of TrackPolicy:
//
//   Estimate                        a track at the stamp of a measurement, as cost() needs it
//   Ahead                           a cheaper prediction: most pairs are too far apart to need the estimate
//   look_ahead(state, dt_s)         -> Ahead, and place(Ahead)
//   estimate(state, dt_s, ahead)    -> Estimate
//   cost(estimate, z, cost)         false: outside of the policy's gate
//   alone_cost(state, cost)         optional. True: the track may also stay without a measurement, at this cost
//   doubt(state)                    -> Doubt, optional: how much faster than predicted a car may be, and since when,
//                                   and how far off its measurements; widens the distance gate
//   travel_m(state, dt_s)           upper limit of the distance between the state's place and the predicted one
#pragma once

#include <algorithm>
#include <cmath>
#include <cstring>

#include "pipeline/track/munkres.h"
#include "pipeline/track/track_policy.h"

namespace overtake {

// A car may drive so much faster or slower than its track, and may have done so for that long before the track's state.
// A measurement of it may be as far off as place_m.
struct Doubt {
  double speed_mps = 0, since_s = 0, place_m = 0;
};

template <class Policy>
class GlobalAssignment {
 public:
  using State = typename Policy::State;
  using Estimate = typename Policy::Estimate;
  using Ahead = typename Policy::Ahead;

  GlobalAssignment(const TrackerParams& params, const Allocator& allocator)
      : gate_m_(params.gate_m),
        work_limit_(int64_t(params.work_limit)),
        munkres_(params.track_capacity, params.detection_capacity, params.track_capacity * params.detection_capacity,
                 allocator) {
    const auto rows = std::size_t(params.detection_capacity);
    arena_.build_or_throw(allocator, [&](Carver& carver) {
      predictions_ = carver.take<Prediction>(std::size_t(params.track_capacity));
      x_m_ = carver.take<double>(rows + kBlock - 1);
      y_m_ = carver.take<double>(rows + kBlock - 1);
      within_reach_ = carver.take<int32_t>(rows);
      nearest_ = carver.take<uint64_t>(rows);
    });
  }

  // Gating may use half of the work limit; beyond it, each track is gated with its nearest measurements only. The
  // assignment may use the rest; beyond it, the result is not the cheapest.
  Effort run(const Policy& policy, const TrackView<State>& tracks, const Iteration& it,
             int32_t* measurement_of_slot) noexcept {
    Effort effort;
    munkres_.clear(tracks.slot_count, it.count);
    for (int32_t i = 0; i < it.count; ++i) {
      x_m_[i] = it.measurement[i].x_m;
      y_m_[i] = it.measurement[i].y_m;
    }
    std::fill_n(x_m_ + it.count, kBlock - 1, kNotMeasured);  // the rest of the last block is near to nothing
    const int64_t near_share = work_limit_ / 2 / kStepsPerPair / std::max(tracks.alive_count, 1);
    const auto most_near = int32_t(std::min(std::max(near_share, kFewestNear), int64_t(INT32_MAX)));
    if (it.count > 0)
      for (int32_t slot = 0; slot < tracks.slot_count; ++slot)
        if (tracks.head[slot].alive)
          gate_track(policy,
                     {it, tracks.head[slot], tracks.state[slot], doubt_of(policy, tracks.state[slot]), slot, most_near},
                     effort);
    munkres_.solve(measurement_of_slot, std::max(work_limit_ - effort.work, int64_t(0)));
    effort.work += munkres_.steps();
    effort.limited |= munkres_.was_limited();
    return effort;
  }

  // The estimate of the slot's track at that stamp if run() computed it, else null.
  const Estimate* find_estimate(int32_t slot, double dt_s) const noexcept {
    const Prediction& prediction = predictions_[slot];
    return prediction.there && prediction.dt_s == dt_s ? &prediction.estimate : nullptr;
  }

 private:
  // A step is the cost of one pair or one column in the assignment's search. Gating and adding a pair costs
  // kStepsPerPair steps. Beyond the limit each track may still examine kFewestNear measurements.
  static constexpr int64_t kStepsPerPair = 16;
  static constexpr int64_t kFewestNear = 8;

  // A track at the stamp of a measurement it was gated with.
  struct Prediction {
    bool there;
    double dt_s;
    Estimate estimate;
  };

  struct Gated {
    const Iteration& it;
    const TrackHead& head;
    const State& state;
    Doubt doubt;
    int32_t slot, most_near;
  };

  // A track predicted to the stamp of the last go_to(): the measurements of a frame come in stamp order and have few
  // different stamps. The update reuses the estimate.
  class TrackAtStamp {
   public:
    TrackAtStamp(const Policy& policy, const State& state, Prediction& prediction)
        : policy_(policy), state_(state), prediction_(prediction) {
      prediction_.there = false;
    }
    void go_to(double dt_s) noexcept {
      if (asked_ && dt_s == dt_s_) return;
      asked_ = true;
      dt_s_ = dt_s;
      ahead_ = policy_.look_ahead(state_, dt_s);
    }
    double distance_to_m2(const Measurement& z) const noexcept {
      return distance_m2(place_of(z), policy_.place(ahead_));
    }
    const Estimate& estimate() noexcept {
      if (!prediction_.there || prediction_.dt_s != dt_s_)
        prediction_ = {true, dt_s_, policy_.estimate(state_, dt_s_, ahead_)};
      return prediction_.estimate;
    }

   private:
    const Policy& policy_;
    const State& state_;
    Prediction& prediction_;
    double dt_s_ = 0;
    Ahead ahead_;
    bool asked_ = false;
  };

  static Doubt doubt_of(const Policy& policy, const State& state) noexcept {
    if constexpr (requires { policy.doubt(state); })
      return policy.doubt(state);
    else
      return {};
  }
  // The largest distance of a measurement from the track's prediction after dt_s.
  double gate_m(const Gated& g, double dt_s) const noexcept {
    return std::max({gate_m_, g.doubt.speed_mps * (std::fabs(dt_s) + g.doubt.since_s), g.doubt.place_m});
  }
  // Square of the farthest distance from its state at which a track may match after dt_s.
  double reach_m2(const Policy& policy, const Gated& g, double dt_s) const noexcept {
    const double reach_m = (gate_m(g, dt_s) + policy.travel_m(g.state, dt_s)) * (1.0 + 1e-9);
    return reach_m * reach_m;
  }

  // Whether any of kBlock measurements is within most_m2; most blocks have none.
  static constexpr int32_t kBlock = 8;
  bool is_any_near(int32_t first, Place place, double most_m2) const noexcept {
    using Pair = double __attribute__((vector_size(16)));
    using Bits = int64_t __attribute__((vector_size(16)));
    const Pair x = {place.x_m, place.x_m}, y = {place.y_m, place.y_m}, most = {most_m2, most_m2};
    Bits near = {0, 0};
    for (int32_t i = first; i < first + kBlock; i += 2) {
      Pair zx, zy;
      std::memcpy(&zx, x_m_ + i, sizeof zx);
      std::memcpy(&zy, y_m_ + i, sizeof zy);
      const Pair dx = zx - x, dy = zy - y;
      near |= Bits(dx * dx + dy * dy <= most);
    }
    return (near[0] | near[1]) != 0;
  }

  // Writes the measurements that a prediction may bring within the gate to within_reach_; skips blocks that are too far
  // as a whole. Measurements are in stamp order, so the first or the last is the farthest away in time.
  int32_t find_within_reach(const Policy& policy, const Gated& g) noexcept {
    const int32_t last = g.it.count - 1;
    const double most_m2 =
        std::max(reach_m2(policy, g, seconds_between(g.head.state_ns, g.it.measurement[0].stamp_ns)),
                 reach_m2(policy, g, seconds_between(g.head.state_ns, g.it.measurement[last].stamp_ns)));
    const Place place = policy.place(g.state);
    int32_t count = 0;
    for (int32_t begin = 0; begin <= last; begin += kBlock) {
      const int32_t end = std::min(begin + kBlock, last + 1);
      if (!is_any_near(begin, place, most_m2)) continue;
      for (int32_t i = begin; i < end; ++i) {
        within_reach_[count] = i;
        count += distance_m2({x_m_[i], y_m_[i]}, place) <= most_m2;
      }
    }
    return count;
  }

  // Keeps the `most` of the `count` measurements within reach that are nearest to the track at their stamps, in the
  // same order.
  void keep_nearest(const Gated& g, TrackAtStamp& at_stamp, int32_t count, int32_t most) noexcept {
    for (int32_t k = 0; k < count; ++k) {
      const Measurement& z = g.it.measurement[within_reach_[k]];
      at_stamp.go_to(seconds_between(g.head.state_ns, z.stamp_ns));
      const auto value_m2 = float(at_stamp.distance_to_m2(z));  // never < 0, so its bits sort like its value
      uint32_t bits;
      std::memcpy(&bits, &value_m2, sizeof bits);
      nearest_[k] = uint64_t(bits) << 32 | uint32_t(within_reach_[k]);
    }
    std::nth_element(nearest_, nearest_ + most, nearest_ + count);
    for (int32_t k = 0; k < most; ++k) within_reach_[k] = int32_t(uint32_t(nearest_[k]));
    std::sort(within_reach_, within_reach_ + most);
  }

  void gate_track(const Policy& policy, const Gated& g, Effort& effort) noexcept {
    const Place here = policy.place(g.state);
    TrackAtStamp at_stamp(policy, g.state, predictions_[g.slot]);
    int32_t near_count = find_within_reach(policy, g);
    if (near_count > g.most_near) {
      keep_nearest(g, at_stamp, near_count, g.most_near);
      near_count = g.most_near;
      effort.limited = true;
    }
    effort.work += kStepsPerPair * near_count;
    if constexpr (requires(double& cost) { policy.alone_cost(g.state, cost); })
      if (double cost; policy.alone_cost(g.state, cost)) munkres_.leave_alone_for(g.slot, cost);
    for (int32_t k = 0; k < near_count; ++k) {
      const int32_t i = within_reach_[k];
      const Measurement& z = g.it.measurement[i];
      const double dt_s = seconds_between(g.head.state_ns, z.stamp_ns);
      if (dt_s < -kMaxBackward_s) continue;
      if (!(distance_m2(place_of(z), here) <= reach_m2(policy, g, dt_s))) continue;

      at_stamp.go_to(dt_s);
      const double most_m = gate_m(g, dt_s);
      if (!(at_stamp.distance_to_m2(z) <= most_m * most_m)) continue;
      double cost;
      if (policy.cost(at_stamp.estimate(), z, cost)) munkres_.add(g.slot, i, cost);
    }
  }

  double gate_m_;
  int64_t work_limit_;
  Arena arena_;
  Munkres munkres_;
  Prediction* predictions_ = nullptr;       // by slot, if a measurement passed the distance gate
  double *x_m_ = nullptr, *y_m_ = nullptr;  // of the iteration's measurements, padded to whole blocks
  int32_t* within_reach_ = nullptr;         // measurements near the current track
  uint64_t* nearest_ = nullptr;             // sort keys of these, if there are too many
};

}  // namespace overtake
