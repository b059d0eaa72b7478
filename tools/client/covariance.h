// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// The covariance of a row that another detector measured. The library uses its own instead of one that is none, and
// says nothing; whoever wrote such numbers should know.
#pragma once

#include <cmath>

namespace overtake::cli {

// NaN: not given. nullptr: a covariance, without cov_xy of independent errors, or none at all; else what is wrong.
inline const char* find_covariance_fault(double var_x, double var_y, double cov_xy) {
  constexpr double kLeast = 1e-12, kMost = 1e12;  // m^2; the library's limits
  if (std::isnan(var_x) != std::isnan(var_y)) return "var_x and var_y are needed together";
  if (std::isnan(var_x)) return std::isnan(cov_xy) ? nullptr : "cov_xy needs var_x and var_y";
  for (const double variance : {var_x, var_y})
    if (!(variance >= kLeast && variance <= kMost)) return "a variance is not between 1e-12 and 1e12 m^2";
  if (std::isnan(cov_xy)) return nullptr;
  return var_x * var_y - cov_xy * cov_xy > 1e-9 * var_x * var_y
             ? nullptr
             : "cov_xy is too large: its square must be below var_x * var_y";
}

}  // namespace overtake::cli
