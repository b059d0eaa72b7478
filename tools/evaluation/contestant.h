// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// A preset on a log: the pipeline, what its input is changed to first, and its judge.
//
//   paper               the preset as it is
//   paper:ground        oracle: of the ground's points only the lowest one of each column is left (the bottom row is
//                       ground by definition), and everything else that is not level is non-ground
//   paper:clusters      oracle: each car is one cluster of its own non-ground points, and there are no others (relay.h)
//   paper:heading       oracle: the rectangles at cars are laid by the true heading (relay.h)
//   paper:relay         what the two above have in common with the preset: their way to the tracker (relay.h)
//   paper:ego           oracle: the true ego pose, at once
//   paper:mounting      each sensor is taken to sit 2 cm and 0.2 deg off on every axis, in signs of its own
//   paper:empty         control: an empty track, no point of a car is in the clouds, nor of what cars cause (blooming,
//                       smoke); what is found at cars is chance
//   paper:shuffled      control: the points of each scan in a random order; no count may change, places by a rounding
//   paper:late_truth    control: held against the truth of one period later; errors must grow by what a car drives
//   paper@NAME=VALUE    one parameter changed (--sweep); given every N-th frame only. The library is told that a frame
//                       comes that seldom: else it would take all sensors for silent and no longer wait for any
#pragma once

#include <exception>
#include <memory>
#include <string>
#include <vector>

#include "tools/client/session.h"
#include "tools/evaluation/album.h"
#include "tools/evaluation/judge.h"
#include "tools/evaluation/relay.h"

namespace overtake::evaluation {

std::vector<std::string> variant_names();  // without the preset
inline bool is_of_sweep(const std::string& name) { return name.find('@') != std::string::npos; }

// Throws io::Error where no contestant has that name: no such preset, variant or parameter, or no such value.
void check_contestant(const std::string& name);

// The rig with its sensors 2 cm and 0.2 deg off on every axis.
io::Rig misplace(io::Rig rig);

class Contestant {
 public:
  // `map_file`: the log's map, "" none. `every`: frames between two that one of a sweep is given. Throws io::Error: no
  // such preset, variant or parameter, one that needs to know what each point lies on where the log does not say it,
  // or more time between two frames than the library can be told of.
  Contestant(const std::string& name, const TruthLog& log, const std::string& map_file, int32_t every = 1);
  // Whether the log's n-th frame is for this contestant, from 0 on.
  bool takes(int64_t n) const { return n % every_ == 0; }
  // Frames in order. Throws what the library or the judge throws.
  void push(const LogFrame& frame);
  int64_t frames() const { return frames_; }  // that were pushed
  void finish();

  const std::string& name() const { return name_; }
  Judge& judge() { return *judge_; }
  void take_pictures();                                // from now on
  const Album* album() const { return album_.get(); }  // null: takes none

 private:
  static void on_frame(ovt_reader* reader, void* self);
  void push_poses(int64_t until_ns);

  std::string name_, variant_;
  const TruthLog& log_;
  int32_t every_;
  int64_t frames_ = 0;
  std::unique_ptr<Judge> judge_;
  std::unique_ptr<Relay> relay_;
  const LogFrame* input_ = nullptr;
  const std::string map_file_;
  ovt_params params_;
  std::unique_ptr<Album> album_;
  std::unique_ptr<cli::Session> session_;
  std::exception_ptr failure_;
  std::size_t next_pose_ = 0;
  int64_t next_true_ns_ = INT64_MIN;
};

// The rows whose place is in `rows`, in that order.
LogFrame take_points(const LogFrame& frame, const std::vector<std::vector<int32_t>>& rows);

}  // namespace overtake::evaluation
