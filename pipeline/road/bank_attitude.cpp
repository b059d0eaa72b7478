// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
#include "pipeline/road/bank_attitude.h"

#include <cmath>

#include "core/math.h"

namespace overtake {
namespace {

constexpr double kOffRoad_m = 1.0;    // a pose this far outside of the circuit is not on its road
constexpr double kLevel_rad = 1e-6;   // no vehicle that is measured stands so level
constexpr double kLeastCosine = 0.1;  // of a bank

}  // namespace

bool is_on_road(const MapProjection& at) noexcept {
  return at.d_m <= at.width_left_m + kOffRoad_m && at.d_m >= -at.width_right_m - kOffRoad_m;
}

EgoPose BankAttitude::complete(const EgoPose& pose) noexcept {
  if (!is_built_ || std::fabs(pose.roll_rad) > kLevel_rad || std::fabs(pose.pitch_rad) > kLevel_rad) return pose;
  EgoPose on_bank = pose;
  on_bank.has_attitude = false;
  if (!map_) return on_bank;
  const MapProjection at = map_->project(pose.x_m, pose.y_m, hint_);
  hint_ = at.segment;
  if (at.segment < 0 || !is_on_road(at)) return on_bank;
  double sine, cosine;
  sin_cos_f64(map_->at(at.s_m).banking_rad, sine, cosine);
  if (!(cosine > kLeastCosine)) return on_bank;
  const double slope = sine / cosine;
  sin_cos_f64(pose.yaw_rad - at.heading_rad, sine, cosine);
  const double along = slope * sine, across = slope * cosine;  // falls ahead, rises to the right
  on_bank.pitch_rad = atan2_f64(along, 1.0);
  on_bank.roll_rad = -atan2_f64(across, hypot_f64(1.0, along));
  return on_bank;
}

}  // namespace overtake
