// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
#include "tools/sim/overtake_plan.h"

#include <algorithm>

namespace overtake::sim {
namespace {

constexpr double kLane = 2.3;  // distance of both cars from the centre line, on different sides, when side by side
constexpr double kTurnOutGap = 42, kBackGap = 30, kLaneTime = 2.6;

}  // namespace

// The gap over time is exact while the track is straight and both lanes are equally long. In a turn the inner lane is
// shorter by d times the angle of the turn, some metres per pass, which the large gaps absorb.
void plan_overtakes(const std::vector<Overtake>& list, CarPlan& ego, CarPlan& other, double& seconds) {
  double now = 0;
  CarPlan* cars[2] = {&ego, &other};
  const auto passer_of = [&](const Overtake& o) { return o.ego_passes ? 0 : 1; };
  const int first = passer_of(list.front());
  const double begin_s = ego.start_s_m;
  ego.start_s_m = begin_s, other.start_s_m = begin_s + (first == 0 ? kOvertakeGap : -kOvertakeGap);
  cars[first]->start_speed_mps = list.front().passer_mps;
  cars[1 - first]->start_speed_mps = list.front().passed_mps;
  double lane[2] = {0, 0};
  cars[0]->start_d_m = cars[1]->start_d_m = 0;
  double speed[2] = {ego.start_speed_mps, other.start_speed_mps};
  const auto steer = [&](int car, double at, double d, double over) {
    if (std::fabs(lane[car] - d) < 1e-9) return;
    CarPlan& plan = *cars[car];
    if (!plan.lane.empty()) at = std::max(at, plan.lane.back().at_s + plan.lane.back().over_s);
    plan.lane.push_back({at, d, over});
    lane[car] = d;
  };
  for (const Overtake& o : list) {
    const int p = passer_of(o), q = 1 - p;
    // Duration of speed changes: the mean acceleration stays within 5 m/s2.
    const double change = std::max(std::fabs(o.passer_mps - speed[p]), std::fabs(o.passed_mps - speed[q]));
    const double over = change > 1e-9 ? std::max(2.0, change / 5) : 0;
    if (over > 0) {
      cars[p]->speed.push_back({now, o.passer_mps, over});
      cars[q]->speed.push_back({now, o.passed_mps, over});
    }
    const double closing = o.passer_mps - o.passed_mps;
    const double gained = over * ((speed[p] - speed[q]) + closing) / 2;  // during the speed changes
    const double side = o.on_left ? kLane : -kLane;
    const auto time_of_gap = [&](double gap) { return now + over + (gap + kOvertakeGap - gained) / closing; };
    // The passed car keeps to the other side early; the passer pulls out behind it.
    steer(q, now + 0.5, -side, kLaneTime);
    const double out = std::max(now + 0.5, time_of_gap(-kTurnOutGap) - kLaneTime / 2);
    if (o.defends) {
      // It blocks the passer's side, then yields.
      steer(q, std::max(now + 0.5 + kLaneTime, out - 1.0), side * 0.2, 1.6);
      steer(q, std::max(now + 2.2 + kLaneTime, out + 0.8), -side, 1.6);
    }
    steer(p, out, side, kLaneTime);
    const double end = time_of_gap(kOvertakeGap);
    steer(p, std::min(end - kLaneTime, time_of_gap(kBackGap)), 0, kLaneTime);
    speed[p] = o.passer_mps, speed[q] = o.passed_mps;
    now = end;
  }
  seconds = now;
}

}  // namespace overtake::sim
