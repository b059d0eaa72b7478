// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// Weights of the Savitzky-Golay filter (Savitzky & Golay 1964; its table I lists some of them).
//
// Least squares in the basis of polynomials that are orthogonal over the window's taps: the value of the fitted
// polynomial at the centre is sum_k a_k sum_n p_n(0) p_n(k) / <p_n, p_n>. This needs no linear system, and loses no
// digits at high orders, as the normal equations in powers of k would.
#include "kernels/smooth_sg.h"

namespace overtake {

bool make_smooth_sg(int32_t window, int32_t order, SmoothSgParams* params) noexcept {
  const int32_t half = (window - 1) / 2;
  if (window < 1 || window % 2 == 0 || half > kMaxHalfWindow || order < 0 || order >= window) return false;

  constexpr int32_t kTaps = 2 * kMaxHalfWindow + 1;
  double now[kTaps], before[kTaps] = {}, weight[kTaps] = {};  // p_n, p_n-1 at tap k = i - half
  for (double& p : now) p = 1.0;
  double norm_before = 1.0;
  for (int32_t n = 0; n <= order; ++n) {
    double norm = 0.0;
    for (int32_t i = 0; i < window; ++i) norm += now[i] * now[i];
    for (int32_t i = 0; i < window; ++i) weight[i] += now[half] * now[i] / norm;

    const double b = n == 0 ? 0.0 : norm / norm_before;  // p_n+1 = k p_n - b p_n-1
    for (int32_t i = 0; i < window; ++i) {
      const double next = double(i - half) * now[i] - b * before[i];
      before[i] = now[i];
      now[i] = next;
    }
    norm_before = norm;
  }

  *params = {};
  params->half_window = half;
  for (int32_t k = 0; k <= half; ++k) params->weight[k] = float(weight[half + k]);
  return true;
}

}  // namespace overtake
