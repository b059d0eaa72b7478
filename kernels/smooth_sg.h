// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// Section 4 of kernels/README.md: Savitzky-Golay smoothing (Savitzky & Golay 1964).
#pragma once

#include "core/range_image.h"

namespace overtake {

inline constexpr int32_t kMaxHalfWindow = 7;
struct SmoothSgParams {
  int32_t half_window;
  float weight[kMaxHalfWindow + 1];  // weight[k] of the taps k rows up and down
};
// Weights of a window and polynomial order, by least squares in double. Returns false for an even window, a window
// outside 1..2 * kMaxHalfWindow + 1, and an order outside 0..window - 1. Window 1 means no smoothing.
bool make_smooth_sg(int32_t window, int32_t order, SmoothSgParams* params) noexcept;

// Taps whose weights sum to less than this are ignored.
inline constexpr float kLeastSmoothWeight = 0.05f;
// Smoothing overshoots next to an edge, also below zero. A result equal to the marker is replaced by this value.
inline constexpr float kBesideUndefined = -0.99999994f;

// Smooths down each column of the angle image's pairs.
//   reads    angle_rad, `pairs` rows    writes  smooth_rad, same rows, must not alias; the rows below kAngleUndefined
//   edges    rows mirror (reflect-101; a window larger than the image keeps mirroring)
//   taps     undefined and skipped taps are left out, the weights renormalised: sum(w a) / sum(w), taps from top to
//            bottom. Where |sum(w)| < kLeastSmoothWeight the pair keeps its value (a skipped pair becomes level, 0).
//            An undefined pair stays kAngleUndefined; a skipped one gets its value from the other taps (none: 0).
//   agrees   exactly on every ISA
namespace ref {
void smooth_sg(const SmoothSgParams& params, int32_t pairs, Plane<const float> angle_rad, Plane<float> smooth_rad,
               ColumnSpan columns = {}) noexcept;
}

}  // namespace overtake
