// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
#include "pipeline/free_heading.h"

#include <algorithm>
#include <cmath>
#include <iterator>

#include "core/math.h"

namespace overtake {

RearEnd find_rear(const PointsAlong& points, float low_m, float high_m, float higher_m) noexcept {
  constexpr float kLeastLength_m = 3.0f;  // shorter points do not show both ends
  constexpr float kEnd_m = 0.7f;          // rear wing and crash structure; nose and front wing
  constexpr float kNone_m = -1e9f;
  if (high_m - low_m < kLeastLength_m) return RearEnd::kUnknown;
  float low_top_m = kNone_m, high_top_m = kNone_m;
  for (int32_t i = 0; i < points.count; ++i) {
    if (points.along_m[i] < low_m + kEnd_m) low_top_m = max_of(low_top_m, points.height_m[i]);
    if (points.along_m[i] > high_m - kEnd_m) high_top_m = max_of(high_top_m, points.height_m[i]);
  }
  if (low_top_m == kNone_m || high_top_m == kNone_m) return RearEnd::kUnknown;
  if (low_top_m > high_top_m + higher_m) return RearEnd::kLow;
  return high_top_m > low_top_m + higher_m ? RearEnd::kHigh : RearEnd::kUnknown;
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
