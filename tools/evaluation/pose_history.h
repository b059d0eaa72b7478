// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// Where a car was, from its own recorded odometry: at any time a quadratic is fitted to the poses around it (least
// squares, as Savitzky & Golay 1964, on stamps as they come). Synchronises and smooths in one step.
#pragma once

#include <optional>
#include <vector>

#include "tools/evaluation/truth_log.h"

namespace overtake::evaluation {

class PoseHistory {
 public:
  // Poses up to half_window_s before and after the time asked for count.
  explicit PoseHistory(double half_window_s = 0.15) : half_window_s_(half_window_s) {}
  void add(const io::EgoRow& row);  // any order; a stamp that is there is left out
  std::size_t size() const { return rows_.size(); }
  // Nothing without poses on both sides of it within the window (3 at least). Speed, course and yaw rate are the fit's
  // slopes; below 1 m/s the course is the heading.
  std::optional<CarTruth> at(int64_t stamp_ns) const;

 private:
  double half_window_s_;
  std::vector<io::EgoRow> rows_;  // by stamp
};

}  // namespace overtake::evaluation
