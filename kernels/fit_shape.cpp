// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// Section 5b: what each form of fit_road calls, built once for all ISAs.
#include <algorithm>
#include <cmath>
#include <cstdint>

#include "core/math.h"
#include "kernels/fit_road_pass.h"

namespace overtake {

FitColumns::FitColumns(const SensorModel& sensor, const RoadShape& shape) noexcept {
  constexpr int32_t kColumns = 20, kPlaneColumns = 12;  // a plane has fewer terms
  step = std::max(1, sensor.cols / (fits_plane(shape) ? kPlaneColumns : kColumns));
  first = step / 2;
  count = (sensor.cols - first + step - 1) / step;
}

float azimuth_of(const SensorModel& sensor, int32_t column) noexcept {
  return float(wrap_angle(double(sensor.azimuth_left_rad) - (column + 0.5) * double(sensor.pitch_rad)));
}

bool fit_shape(const RoadPoints& points, double trim_m, RoadShape& shape) noexcept {
  constexpr int32_t kTerms = RoadShape::kTerms;
  constexpr int32_t kBins = 40, kFewest = 24, kFewestBins = 3;
  constexpr double kBin_m = 5.0;
  // Standard deviations of the ground's heights, and of the terms from what is expected. Errors of learned heights are
  // the same for many points.
  constexpr struct {
    double height_m, term[kTerms];
  } kSigmas[] = {{0.03, {0.1, 0.02, 0.02, 5e-4, 2e-3}},      // kNone
                 {0.03, {0.1, 0.02, 0.02, 1e-4, 5e-4}},      // kWay
                 {0.03, {0.1, 0.02, 0.02, 2e-5, 2e-4}},      // kMap
                 {0.06, {0.02, 0.005, 0.005, 1e-7, 1e-6}}};  // kLearned: a plane
  const auto& sigma = kSigmas[int32_t(shape.expected.source)];
  const auto bin_of = [](float x) { return std::clamp(int32_t(x / kBin_m + 0.5 * kBins), 0, kBins - 1); };
  int32_t of_bin[kBins] = {}, used = 0, bins = 0;
  static_assert(RoadPoints::kCapacity <= INT16_MAX);
  struct Chosen {
    int16_t point, bin;
  } chosen[RoadPoints::kCapacity];
  double p[kTerms];
  std::copy_n(shape.term, kTerms, p);
  for (int32_t i = 0; i < points.count; ++i) {
    const double x = double(points.x[i]), n = double(points.n[i]);
    if (!(std::fabs(p[0] + p[1] * x + p[2] * n + p[3] * x * x + p[4] * x * n - double(points.above_m[i])) <= trim_m))
      continue;
    const int32_t bin = bin_of(points.x[i]);
    chosen[used++] = {int16_t(i), int16_t(bin)};
    bins += of_bin[bin]++ == 0;
  }
  if (used < kFewest || bins < kFewestBins) return false;
  double weight_of[kBins];
  for (int32_t bin = 0; bin < kBins; ++bin) weight_of[bin] = 1.0 / std::max(of_bin[bin], 1);
  // The upper triangle of the normal equations, in pairs of columns. Below the diagonal it is not used.
  static_assert(kTerms == 5);
  using Pair = double __attribute__((vector_size(16)));
  Pair sum[kTerms][3] = {};
  for (int32_t k = 0; k < kTerms; ++k)
    sum[k][k / 2][k % 2] = sigma.height_m * sigma.height_m / (sigma.term[k] * sigma.term[k]);
  for (int32_t k = 0; k < used; ++k) {
    const int32_t i = chosen[k].point;
    const double x = double(points.x[i]), n = double(points.n[i]), weight = weight_of[chosen[k].bin];
    const double basis[kTerms] = {1.0, x, n, x * x, x * n};
    const Pair pair[3] = {{1.0, x}, {n, basis[3]}, {basis[4], double(points.above_m[i])}};
    for (int32_t row = 0; row < kTerms; ++row) {
      const double weighted = weight * basis[row];
      for (int32_t at = row / 2; at < 3; ++at) sum[row][at] += Pair{weighted, weighted} * pair[at];
    }
  }
  double a[kTerms][kTerms + 1];
  for (int32_t row = 0; row < kTerms; ++row)
    for (int32_t col = 0; col <= kTerms; ++col) a[row][col] = sum[row][col / 2][col % 2];
  // Symmetric and positive definite by the prior: elimination without pivots.
  for (int32_t k = 0; k < kTerms; ++k)
    for (int32_t row = k + 1; row < kTerms; ++row) {
      const double factor = a[k][row] / a[k][k];
      for (int32_t col = row; col <= kTerms; ++col) a[row][col] -= factor * a[k][col];
    }
  for (int32_t k = kTerms - 1; k >= 0; --k) {
    double value = a[k][kTerms];
    for (int32_t col = k + 1; col < kTerms; ++col) value -= a[k][col] * p[col];
    p[k] = value / a[k][k];
    shape.term[k] = float(p[k]);
  }
  return true;
}

}  // namespace overtake
