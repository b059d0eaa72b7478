// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
#include "pipeline/road/bank_attitude.h"

#include <algorithm>
#include <cmath>

#include "core/math.h"
#include "pipeline/clock_watch.h"

namespace overtake {
namespace {

constexpr double kFade_m = 1.0;                               // beside the circuit, which is level
constexpr double kLevel_rad = 1e-6;                           // no vehicle that is measured stands so level,
constexpr double kSame_rad = 1e-5;                            // or keeps its attitude so well over a way
constexpr double kSameOnBank_m = 20.0, kOffBank_rad = 0.026;  // where the map tells another attitude
constexpr double kSame_m = 100.0, kTurned_rad = 0.1;          // where it tells none, and the vehicle turns

}  // namespace

// Over what way, and what turn, the attitude has stayed the same.
void BankAttitude::follow(const EgoPose& pose) noexcept {
  const int64_t step_ns = difference_ns(pose.stamp_ns, last_ns_);
  last_ns_ = pose.stamp_ns;
  const bool same = std::fabs(wrap_angle(pose.roll_rad - roll_rad_)) <= kSame_rad &&
                    std::fabs(wrap_angle(pose.pitch_rad - pitch_rad_)) <= kSame_rad;
  if (!same) {
    roll_rad_ = pose.roll_rad, pitch_rad_ = pose.pitch_rad, yaw_rad_ = pose.yaw_rad;
    same_m_ = turned_rad_ = 0.0;
  } else if (step_ns > 0 && step_ns <= kEgoStepNs) {
    same_m_ = std::min(same_m_ + std::fabs(pose.speed_mps) * double(step_ns) * 1e-9, kSame_m);
    turned_rad_ = std::max(turned_rad_, std::fabs(wrap_angle(pose.yaw_rad - yaw_rad_)));
  }
}

// Roll and pitch of a vehicle on the bank; false where the map tells none.
bool BankAttitude::stand_on_bank(EgoPose& pose) noexcept {
  if (!map_) return false;
  const MapProjection at = map_->project(pose.x_m, pose.y_m, hint_);
  hint_ = at.segment;
  if (!map_->is_beside(at)) return false;
  // Beside the circuit it is level. So that poses with noise do not tilt to and fro at the edge, the bank fades.
  const double outside_m = std::max(at.d_m - at.width_left_m, -at.d_m - at.width_right_m);
  const double share = std::clamp(1.0 - outside_m / kFade_m, 0.0, 1.0);
  const double slope = share * map_->at(at.s_m).cross_slope();
  double sine, cosine;
  sin_cos_f64(pose.yaw_rad - at.heading_rad, sine, cosine);
  const double along = slope * sine, across = slope * cosine;  // falls ahead, rises to the right
  pose.pitch_rad = atan2_f64(along, 1.0);
  pose.roll_rad = -atan2_f64(across, hypot_f64(1.0, along));
  return true;
}

EgoPose BankAttitude::complete(const EgoPose& pose) noexcept {
  if (!is_built_) return pose;
  follow(pose);
  const bool level = std::fabs(pose.roll_rad) <= kLevel_rad && std::fabs(pose.pitch_rad) <= kLevel_rad;
  if (!level && same_m_ < kSameOnBank_m) return pose;
  EgoPose on_bank = pose;
  on_bank.has_attitude = false;
  const bool told = stand_on_bank(on_bank);
  if (level) return on_bank;
  const bool is_off = std::fabs(wrap_angle(on_bank.roll_rad - pose.roll_rad)) > kOffBank_rad ||
                      std::fabs(wrap_angle(on_bank.pitch_rad - pose.pitch_rad)) > kOffBank_rad;
  return (told ? is_off : same_m_ >= kSame_m && turned_rad_ > kTurned_rad) ? on_bank : pose;
}

}  // namespace overtake
