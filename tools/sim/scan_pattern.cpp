// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
#include "tools/sim/scan_pattern.h"

#include <stdexcept>

namespace overtake::sim {

PatternKind pattern_kind(const std::string& name) {
  if (name == "uniform") return PatternKind::uniform;
  if (name == "gaussian") return PatternKind::gaussian;
  if (name == "horizon_dense") return PatternKind::horizon_dense;
  throw std::invalid_argument("no scan pattern is named '" + name + "'; there are uniform, gaussian and horizon_dense");
}

// Series for small |x|, else a continued fraction of the tail.
double normal_distribution(double x) {
  const double density = exp_of(-0.5 * x * x) * 0.39894228040143267794;
  if (std::fabs(x) < 3) {
    double term = x, sum = x;
    for (int k = 1; k < 80; ++k) {
      term *= x * x / (2 * k + 1);
      sum += term;
    }
    return 0.5 + density * sum;
  }
  double f = 0;
  for (int k = 60; k >= 1; --k) f = k / (std::fabs(x) + f);
  const double tail = density / (std::fabs(x) + f);
  return x > 0 ? 1 - tail : tail;
}

double normal_quantile(double p) {
  // Bisection is fast enough: patterns call this a few dozen times per scan.
  double low = -9, high = 9;
  for (int i = 0; i < 48; ++i) {
    const double middle = (low + high) / 2;
    (normal_distribution(middle) < p ? low : high) = middle;
  }
  return (low + high) / 2;
}

double ScanPattern::elevation(double u, double time_s) const {
  const double drift = drift_rad == 0 ? 0 : drift_rad * sin_of(2 * kPi * time_s / drift_period_s);
  const double middle = (fov_top_rad + fov_bottom_rad) / 2, half = (fov_top_rad - fov_bottom_rad) / 2;
  switch (kind) {
    case PatternKind::uniform: return fov_top_rad + (fov_bottom_rad - fov_top_rad) * u + drift;
    case PatternKind::gaussian: {
      const double top = normal_distribution((fov_top_rad - center_rad) / sigma_rad);
      const double bottom = normal_distribution((fov_bottom_rad - center_rad) / sigma_rad);
      return center_rad + sigma_rad * normal_quantile(lerp(top, bottom, clamp(u, 1e-9, 1 - 1e-9))) + drift;
    }
    case PatternKind::horizon_dense: {
      const double w = 1 - 2 * u;
      // The cubic is bent so that it passes center_rad at its densest point and still reaches both ends.
      const double bend = (center_rad - middle) * (1 - w * w);
      return middle + half * (dense_share * w + (1 - dense_share) * w * w * w) + bend + drift;
    }
  }
  return 0;
}

}  // namespace overtake::sim
