// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// Whether a published probability equals the share of cases in which its statement is true.
#pragma once

#include <array>
#include <cstdint>

namespace overtake::metrics {

class Calibration {
 public:
  struct Bin {  // a tenth of the probability; the last one contains 1
    int64_t count = 0, hits = 0;
    double probability = 0;  // sum
    double share() const;    // of hits; NaN: empty
  };
  // Probabilities beyond 0 and 1 belong to the bins at the ends. One that is not finite is left out.
  void add(double probability, bool hit);
  const std::array<Bin, 10>& bins() const { return bins_; }
  int64_t count() const;
  // Expected calibration error (Naeini et al. 2015): the mean over all cases of their bin's
  // | share - mean probability |.
  double expected_error() const;  // NaN: no case
  // Mean of (probability - truth)^2 (Brier 1950).
  double brier() const;  // NaN: no case

 private:
  std::array<Bin, 10> bins_;
  double squares_ = 0;
};

}  // namespace overtake::metrics
