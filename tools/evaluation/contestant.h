// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// A preset on a log: the pipeline, what its input is changed to first, and its judge.
//
//   paper               the preset as it is
//   paper:ground        oracle: no ground point is in the clouds, by truth, and every pixel left is non-ground
//   paper:cars          oracle: only the points of cars are in the clouds: ground and clusters of cars are perfect
//   paper:ego           oracle: the true ego pose, at once
//   paper:shuffled      control: the points of each scan in a random order; no count may change, places by a rounding
//   paper:late_truth    control: held against the truth of one period later; errors must grow by what a car drives
//   paper@NAME=VALUE    one parameter changed (--sweep)
#pragma once

#include <exception>
#include <memory>
#include <string>
#include <vector>

#include "tools/evaluation/judge.h"
#include "tools/session.h"

namespace overtake::evaluation {

std::vector<std::string> variant_names();  // without the preset

class Contestant {
 public:
  // `map_file`: the log's map. Throws io::Error: no such preset, variant or parameter.
  Contestant(const std::string& name, const SimulatedLog& log, const std::string& map_file);
  // Frames in order. Throws what the library or the judge throws.
  void push(const LogFrame& frame);
  void finish();

  const std::string& name() const { return name_; }
  Judge& judge() { return *judge_; }

 private:
  static void on_frame(ovt_reader* reader, void* self);
  void push_poses(int64_t until_ns);

  std::string name_, variant_;
  const SimulatedLog& log_;
  std::unique_ptr<Judge> judge_;
  std::unique_ptr<cli::Session> session_;
  std::exception_ptr failure_;
  std::size_t next_pose_ = 0;
  int64_t next_true_ns_ = INT64_MIN;
};

// The rows whose place is in `rows`, in that order.
LogFrame take_points(const LogFrame& frame, const std::vector<std::vector<int32_t>>& rows);

}  // namespace overtake::evaluation
