// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// A car's position at any time from its recorded odometry: fits a quadratic to the poses around that time (least
// squares, as Savitzky & Golay 1964, on uneven stamps). This synchronises and smooths in one step.
#pragma once

#include <optional>
#include <vector>

#include "tools/evaluation/truth_log.h"

namespace overtake::evaluation {

class PoseHistory {
 public:
  // Uses poses up to half_window_s before and after the given time.
  explicit PoseHistory(double half_window_s = 0.15) : half_window_s_(half_window_s) {}
  void add(const io::EgoRow& row);  // any order; ignores a repeated stamp
  std::size_t size() const { return rows_.size(); }
  // Nothing without poses on both sides within the window (at least 3). Speed, course and yaw rate are the fit's
  // slopes; below 1 m/s the course is the heading.
  std::optional<CarTruth> at(int64_t stamp_ns) const;

 private:
  double half_window_s_;
  std::vector<io::EgoRow> rows_;  // by stamp
};

}  // namespace overtake::evaluation
