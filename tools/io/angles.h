// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// Degrees and medians of the command line.
#pragma once

#include <algorithm>
#include <cstdint>
#include <vector>

namespace overtake::cli {

inline constexpr double kDegreesPerRadian = 180.0 / 3.14159265358979323846;

// The upper one of the two in the middle; 0 of none.
template <class T>
T median(std::vector<T> values) {
  if (values.empty()) return T();
  std::nth_element(values.begin(), values.begin() + int64_t(values.size() / 2), values.end());
  return values[values.size() / 2];
}

}  // namespace overtake::cli
