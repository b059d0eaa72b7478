// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
#include "pipeline/road/bank_attitude.h"

#include <algorithm>
#include <cmath>

#include "core/math.h"

namespace overtake {
namespace {

constexpr double kFade_m = 1.0;      // beside the circuit, which is level
constexpr double kLevel_rad = 1e-6;  // no vehicle that is measured stands so level

}  // namespace

EgoPose BankAttitude::complete(const EgoPose& pose) noexcept {
  if (!is_built_ || std::fabs(pose.roll_rad) > kLevel_rad || std::fabs(pose.pitch_rad) > kLevel_rad) return pose;
  EgoPose on_bank = pose;
  on_bank.has_attitude = false;
  if (!map_) return on_bank;
  const MapProjection at = map_->project(pose.x_m, pose.y_m, hint_);
  hint_ = at.segment;
  if (!map_->is_beside(at)) return on_bank;
  // Beside the circuit it is level. So that poses with noise do not tilt to and fro at the edge, the bank fades.
  const double outside_m = std::max(at.d_m - at.width_left_m, -at.d_m - at.width_right_m);
  const double share = std::clamp(1.0 - outside_m / kFade_m, 0.0, 1.0);
  const double slope = share * map_->at(at.s_m).cross_slope();
  double sine, cosine;
  sin_cos_f64(pose.yaw_rad - at.heading_rad, sine, cosine);
  const double along = slope * sine, across = slope * cosine;  // falls ahead, rises to the right
  on_bank.pitch_rad = atan2_f64(along, 1.0);
  on_bank.roll_rad = -atan2_f64(across, hypot_f64(1.0, along));
  return on_bank;
}

}  // namespace overtake
