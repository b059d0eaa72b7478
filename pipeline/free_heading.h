// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// The heading of a race car that is not along the track: it spins, or has spun. psi_VAR is known modulo pi only, and
// turns away from the line of sight, because the points lie between a corner of the end that is seen and the far wheel.
#pragma once

#include <cstdint>

namespace overtake {

// Which end of a cluster is the rear one: the wing at the rear is higher than the nose.
enum class RearEnd { kUnknown, kLow, kHigh };

// The highest points at both ends of a cluster that reaches from low_m to high_m along its heading.
class EndTops {
 public:
  EndTops(float low_m, float high_m) noexcept : low_m_(low_m), high_m_(high_m) {}
  void add(float along_m, float height_m) noexcept;
  RearEnd rear(float higher_m) const noexcept;  // higher than the other end by higher_m at least

 private:
  static constexpr float kNone_m = -1e9f;
  float low_m_, high_m_;
  float low_top_m_ = kNone_m, high_top_m_ = kNone_m;
};

// What psi_VAR has too much where the directed heading is view_rad from the line of sight: 0 where the sensor looks at
// the rear end, +-pi where it looks at the front. By simulated scans of a Dallara AV-21.
double psi_var_error(double view_rad) noexcept;

}  // namespace overtake
