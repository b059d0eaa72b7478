// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
#include "tools/evaluation/metrics/calibration.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace overtake::metrics {

double Calibration::Bin::share() const {
  return count > 0 ? double(hits) / double(count) : std::numeric_limits<double>::quiet_NaN();
}

void Calibration::add(double probability, bool hit) {
  if (!std::isfinite(probability)) return;
  Bin& bin = bins_[std::size_t(std::clamp(probability * 10, 0.0, 9.0))];
  ++bin.count, bin.hits += hit, bin.probability += probability;
  squares_ += (probability - hit) * (probability - hit);
}

int64_t Calibration::count() const {
  int64_t sum = 0;
  for (const Bin& bin : bins_) sum += bin.count;
  return sum;
}

double Calibration::expected_error() const {
  double sum = 0;
  for (const Bin& bin : bins_) sum += std::fabs(double(bin.hits) - bin.probability);
  return count() > 0 ? sum / double(count()) : std::numeric_limits<double>::quiet_NaN();
}

double Calibration::brier() const {
  return count() > 0 ? squares_ / double(count()) : std::numeric_limits<double>::quiet_NaN();
}

}  // namespace overtake::metrics
