// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
#include "pipeline/free_heading.h"

#include <algorithm>
#include <cmath>
#include <iterator>

#include "core/math.h"

namespace overtake {

void EndTops::add(float along_m, float height_m) noexcept {
  constexpr float kEnd_m = 0.7f;  // rear wing and crash structure; nose and front wing
  if (along_m < low_m_ + kEnd_m) low_top_m_ = max_of(low_top_m_, height_m);
  if (along_m > high_m_ - kEnd_m) high_top_m_ = max_of(high_top_m_, height_m);
}

RearEnd EndTops::rear(float higher_m) const noexcept {
  constexpr float kLeastLength_m = 3.0f;  // shorter clusters do not show both ends
  if (high_m_ - low_m_ < kLeastLength_m || low_top_m_ == kNone_m || high_top_m_ == kNone_m) return RearEnd::kUnknown;
  if (low_top_m_ > high_top_m_ + higher_m) return RearEnd::kLow;
  return high_top_m_ > low_top_m_ + higher_m ? RearEnd::kHigh : RearEnd::kUnknown;
}

double psi_var_error(double view_rad) noexcept {
  constexpr double kError_deg[] = {0, 0, 19, 16, 8, 3, -2, -3, -4, -5, -7, -5, 0};  // at 0, 15, ... 180 deg
  constexpr int32_t kSteps = int32_t(std::size(kError_deg)) - 1;
  const double place = std::fabs(view_rad) * (kSteps / kPi);
  const int32_t i = std::min(int32_t(place), kSteps - 1);
  const double error_deg = kError_deg[i] + (place - i) * (kError_deg[i + 1] - kError_deg[i]);
  return (view_rad < 0.0 ? -error_deg : error_deg) * (kPi / 180.0);
}

}  // namespace overtake
