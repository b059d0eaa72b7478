// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// Errors that a localisation shows in its own poses: a place that stays while the vehicle moves on, a yaw rate that the
// yaws contradict, and places with more noise than learned heights bear. Poses without them stay as they are.
#pragma once

#include <cstdint>

#include "pipeline/ego_buffer.h"

namespace overtake {

// Belongs to the producer of the poses.
class PoseRepair {
 public:
  // From now on poses are looked at.
  void build() noexcept { is_built_ = true; }

  enum class Found : uint32_t { kHeld = 1, kLost = 2, kWrongRate = 4, kNoise = 8 };

  // Looks at a pose, and returns bits of Found.
  //   kHeld       x and y are those of the pose before, at more than 1 m/s, and have moved before: nothing measured
  //               them. The pose becomes the last one that was measured, moved on by speed and yaw
  //   kLost       so for more than 0.15 s: the pose is to be left out
  //   kWrongRate  the yaws of the last second contradict the yaw rates (sign, unit, or never set); the yaw rate becomes
  //               that of the yaws, until the two agree through a bend
  //   kNoise      x, y or z of the last second scatter by centimetres; it becomes the line through them, along the way
  //               that speed, yaw and pitch tell
  // Only poses whose stamps grow by at most 0.2 s are compared. One that is late by up to 0.5 s changes nothing.
  uint32_t repair(EgoPose& pose) noexcept;

 private:
  static constexpr int32_t kCapacity = 128;
  struct Sample {
    double t_s;       // since the window's begin
    double turn_rad;  // by the yaws since then
    double off_rad;   // turn_rad less the turn by the yaw rates
    double off_m[3];  // x, y, z less the way that speed and attitude tell
  };

  void begin(const EgoPose& pose) noexcept;
  void add(const EgoPose& pose) noexcept;
  bool hold(EgoPose& pose, int64_t step_ns) noexcept;
  bool is_rate_wrong() noexcept;
  bool smooth(int32_t axis, double noise_m, double& place_m) noexcept;
  const Sample& at(int32_t i) const noexcept { return ring_[(first_ + i) % kCapacity]; }

  bool is_built_ = false, has_last_ = false, rate_wrong_ = false;
  EgoPose last_;  // as pushed; the last one that was measured
  bool has_moved_ = false;
  int32_t older_ = 0;  // late poses in a row
  int64_t begin_ns_ = 0, added_ns_ = 0;
  double turn_rad_ = 0, turn_by_rate_rad_ = 0, way_m_[3] = {0, 0, 0}, origin_m_[3] = {0, 0, 0};
  double places_from_s_ = 0;  // of the last jump of the places: earlier ones are not of their line
  double rate_rps_ = 0;       // what the last wrong rate became
  int32_t first_ = 0, count_ = 0;
  Sample ring_[kCapacity];
};

}  // namespace overtake
