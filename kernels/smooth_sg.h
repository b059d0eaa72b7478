// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// Stage 4: Savitzky-Golay smoothing (Savitzky & Golay 1964).
#pragma once

#include "core/range_image.h"

namespace overtake {

inline constexpr int32_t kMaxHalfWindow = 7;
struct SmoothSgParams {
  int32_t half_window;
  float weight[kMaxHalfWindow + 1];  // weight[k] of the taps k rows up and down
};
// Weights of a window and polynomial order, by least squares in double. False when the window is even or not in
// 1..2 * kMaxHalfWindow + 1, or the order not in 0..window - 1. Window 1 is no smoothing.
bool make_smooth_sg(int32_t window, int32_t order, SmoothSgParams* params) noexcept;

// Taps that weigh less than this together are too little to judge by.
inline constexpr float kLeastSmoothWeight = 0.05f;
// Smoothing overshoots next to an edge, also below zero. A value that lands on the marker moves off it.
inline constexpr float kBesideUndefined = -0.99999994f;

// Smooths down each column of the angle image's pairs.
//   reads    angle_rad, `pairs` rows    writes  smooth_rad, same rows, must not alias; the rows below kAngleUndefined
//   edges    rows mirror (reflect-101; a window larger than the image keeps mirroring)
//   taps     undefined and skipped taps are left out, the weights renormalised: sum(w a) / sum(w), taps from top to
//            bottom; where |sum(w)| < kLeastSmoothWeight the taps carry too little weight to judge by: the tap's own
//            value (a skipped pair: level). An undefined pair stays kAngleUndefined; a skipped one gets its value
//            from the other taps (none: level, 0).
//   agrees   exactly on every ISA
namespace ref {
void smooth_sg(const SmoothSgParams& params, int32_t pairs, Plane<const float> angle_rad,
               Plane<float> smooth_rad) noexcept;
}

}  // namespace overtake
