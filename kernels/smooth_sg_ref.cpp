// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// Section 4: Savitzky-Golay smoothing down each column.
#include "kernels/smooth_sg.h"

#include <algorithm>
#include <cmath>

#include "core/check.h"

namespace overtake::ref {
namespace {

// Reflect-101 (the border row is not repeated), repeated as often as needed.
int32_t mirrored(int32_t r, int32_t rows) {
  if (rows == 1) return 0;
  while (r < 0 || r >= rows) r = r < 0 ? -r : 2 * (rows - 1) - r;
  return r;
}

}  // namespace

void smooth_sg(const SmoothSgParams& params, int32_t pairs, Plane<const float> angle_rad, Plane<float> smooth_rad,
               ColumnSpan columns) noexcept {
  OVT_CHECK(pairs >= 0 && pairs <= angle_rad.rows && params.half_window <= kMaxHalfWindow);
  const int32_t half = params.half_window, taps = 2 * half + 1;
  const ColumnSpan own_columns = columns.within(angle_rad.cols);
  for (int32_t r = 0; r < pairs; ++r) {
    const float* tap_row[2 * kMaxHalfWindow + 1];
    float tap_weight[2 * kMaxHalfWindow + 1];
    for (int32_t t = 0; t < taps; ++t) {
      tap_row[t] = angle_rad.row(mirrored(r + t - half, pairs));
      tap_weight[t] = params.weight[t < half ? half - t : t - half];
    }
    for (int32_t c = own_columns.first; c < own_columns.last; ++c) {
      float sum = 0.0f, weight_sum = 0.0f;
      for (int32_t t = 0; t < taps; ++t) {
        const float angle = tap_row[t][c];
        const bool defined = angle >= 0.0f;
        sum += defined ? tap_weight[t] * angle : 0.0f;
        weight_sum += defined ? tap_weight[t] : 0.0f;
      }
      const float own = angle_rad.row(r)[c];
      const bool enough = std::fabs(weight_sum) >= kLeastSmoothWeight;
      float value = own == kAngleSkipped ? 0.0f : own;
      if (enough) value = sum / weight_sum;
      if (value == kAngleUndefined) value = kBesideUndefined;
      smooth_rad.row(r)[c] = own == kAngleUndefined ? kAngleUndefined : value;
    }
  }
  for (int32_t r = pairs; r < smooth_rad.rows; ++r)
    std::fill(smooth_rad.row(r) + own_columns.first, smooth_rad.row(r) + own_columns.last, kAngleUndefined);
}

}  // namespace overtake::ref
