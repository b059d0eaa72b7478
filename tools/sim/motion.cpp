// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
#include "tools/sim/motion.h"

#include <algorithm>
#include <cstdio>
#include <stdexcept>

namespace overtake::sim {
namespace {

constexpr double kStepS = 0.002;

// Value, first and second derivative of a plan of smooth steps.
struct Planned {
  double value, rate, second;
};
template <class Change, class Target>
Planned planned(double start, const std::vector<Change>& changes, Target&& target, double t) {
  Planned p{start, 0, 0};
  for (const Change& c : changes) {
    if (t <= c.at_s) break;
    const double u = clamp((t - c.at_s) / c.over_s, 0, 1), by = target(c) - p.value;
    p = {p.value + by * smooth_step(u), by / c.over_s * 30 * u * u * square(1 - u),
         by / square(c.over_s) * 60 * u * (1 - u) * (1 - 2 * u)};
  }
  return p;
}

[[noreturn]] void refuse(const CarPlan& plan, double t, const char* what, double value, double most) {
  char text[200];
  std::snprintf(text, sizeof text, "car '%s' at %.2f s: %s %.1f is beyond %.1f", plan.name.c_str(), t, what, value,
                most);
  throw std::invalid_argument(text);
}

template <class Change>
void check_order(const CarPlan& plan, const std::vector<Change>& changes, const char* what) {
  for (std::size_t i = 0; i < changes.size(); ++i) {
    if (changes[i].over_s <= 0) refuse(plan, changes[i].at_s, "a change of no duration, over_s", changes[i].over_s, 0);
    if (i > 0 && changes[i].at_s < changes[i - 1].at_s + changes[i - 1].over_s)
      refuse(plan, changes[i].at_s, what, changes[i - 1].at_s + changes[i - 1].over_s, changes[i].at_s);
  }
}

}  // namespace

Motion::Motion(const Track& track, const CarPlan& plan, double seconds) : track_(&track), name_(plan.name) {
  check_order(plan, plan.speed, "changes of speed overlap: the end of the one before,");
  check_order(plan, plan.lane, "changes of lane overlap: the end of the one before,");
  check_order(plan, plan.spin, "spins overlap: the end of the one before,");
  const int64_t count = int64_t(seconds / kStepS) + 600;  // a second longer: the last scan extends beyond the end
  double s = plan.start_s_m, body = 0, last_course = 0;
  for (int64_t i = 0; i < count; ++i) {
    const double t = double(i) * kStepS;
    const auto speed_at = [&](double at) {
      return planned(
          plan.start_speed_mps, plan.speed, [](const SpeedChange& c) { return c.speed_mps; }, at);
    };
    const Planned v = speed_at(t), d = planned(
                                       plan.start_d_m, plan.lane, [](const LaneChange&c) { return c.d_m; }, t);
    const TrackPoint p = track.at(s);
    const double forward = std::sqrt(std::max(0.0, v.value * v.value - d.rate * d.rate));
    const SinCos h = sin_cos(p.heading_rad);
    Row row{};
    row.s = s, row.d = d.value, row.speed = v.value;
    row.x = p.x - d.value * h.sin, row.y = p.y + d.value * h.cos;
    row.vx = forward * h.cos - d.rate * h.sin, row.vy = forward * h.sin + d.rate * h.cos;
    const double aside = v.value > 0.1 ? atan2_of(d.rate, forward) : 0;
    row.course = p.heading_rad + aside;
    if (i > 0) row.course = last_course + wrap_angle(row.course - last_course);
    last_course = row.course;
    const double track_turn = p.curvature_pm * forward / (1 - p.curvature_pm * d.value);
    const double course_rate =
        track_turn + (v.value > 0.1 ? (d.second * forward - d.rate * v.rate) / square(v.value) : 0);
    row.along = v.rate;
    row.across = v.value * course_rate;
    // In the plane of the banked road, gravity helps.
    const SinCos bank = sin_cos(p.banking_rad);
    const double in_plane = row.across * bank.cos - kGravity * bank.sin;
    if (v.value > kMostSpeed + 1e-9) refuse(plan, t, "speed in m/s", v.value, kMostSpeed);
    if (std::fabs(v.rate) > kMostAlong) refuse(plan, t, "acceleration along in m/s2", v.rate, kMostAlong);
    if (std::fabs(in_plane) > kMostAcross) refuse(plan, t, "acceleration across in m/s2", in_plane, kMostAcross);

    // d(body)/dt = v / l_r (course - slip - body), small angles; the exact solution over a step
    // with a constant course rate.

    const double slip =
        -in_plane / kSlipStiffness;  // of the rear wheels, which slide outwards: the body points inwards
    const double target = row.course - slip, rate = v.value / kRearAxleToCg;
    const double lag = rate > 0.1 ? course_rate / rate : 0;
    if (i == 0) body = target - lag;
    double spin = 0;
    for (const Spin& c : plan.spin) spin += c.turns * 2 * kPi * smooth_step((t - c.at_s) / c.over_s);
    row.heading = body + spin;
    const double before = body;
    body = target + course_rate * kStepS - lag + (body - target + lag) * exp_of(-rate * kStepS);
    double next_spin = 0;
    for (const Spin& c : plan.spin) next_spin += c.turns * 2 * kPi * smooth_step((t + kStepS - c.at_s) / c.over_s);
    row.yaw_rate = (body - before + next_spin - spin) / kStepS;
    rows_.push_back(row);
    const Planned half = speed_at(t + kStepS / 2);
    const double d_half = planned(
                              plan.start_d_m, plan.lane, [](const LaneChange& c) { return c.d_m; }, t + kStepS / 2)
                              .value;
    s += std::max(0.0, half.value * (forward / std::max(v.value, 1e-9))) * kStepS /
         (1 - track.at(s + forward * kStepS / 2).curvature_pm * d_half);
  }
}

CarState Motion::at(double time_s) const {
  const double position = clamp(time_s / kStepS, 0, double(rows_.size()) - 1.000001);
  const std::size_t i = std::size_t(position);
  const double t = position - double(i);
  const Row &a = rows_[i], &b = rows_[i + 1];
  const double h00 = (1 + 2 * t) * square(1 - t), h10 = t * square(1 - t), h01 = t * t * (3 - 2 * t),
               h11 = t * t * (t - 1);
  const double x = h00 * a.x + h10 * kStepS * a.vx + h01 * b.x + h11 * kStepS * b.vx;
  const double y = h00 * a.y + h10 * kStepS * a.vy + h01 * b.y + h11 * kStepS * b.vy;
  CarState state;
  state.heading_rad = lerp(a.heading, b.heading, t);
  state.course_rad = lerp(a.course, b.course, t);
  state.speed_mps = lerp(a.speed, b.speed, t);
  state.yaw_rate_rps = a.yaw_rate;
  state.accel_along_mps2 = lerp(a.along, b.along, t);
  state.accel_across_mps2 = lerp(a.across, b.across, t);
  state.s_m = lerp(a.s, b.s, t);
  state.d_m = lerp(a.d, b.d, t);
  // The body: up along the surface's normal, forward by its heading, rear axle behind the centre of gravity.
  const SurfaceFrame f = track_->frame(state.s_m, state.d_m);
  const SinCos h = sin_cos(state.heading_rad);
  const Vec3 level{h.cos, h.sin, 0};
  const Vec3 ahead = normalized({level.x, level.y, -dot(f.up, level) / f.up.z});
  const Vec3 cg{x, y, f.place.z};
  state.T_map_vehicle = {{ahead, cross(f.up, ahead), f.up}, cg - ahead * kRearAxleToCg};
  return state;
}

}  // namespace overtake::sim
