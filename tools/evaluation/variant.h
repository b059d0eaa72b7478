// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// A preset on a log: changes the input, runs the pipeline and evaluates the results. Names:
//
//   paper               the preset without changes
//   paper:ground        oracle: of the ground's points only the lowest one of each column remains (the bottom row is
//                       ground by definition), and every other point that is not level is non-ground. Only of methods
//                       that judge ground by angles: others need the ground that this removes
//   paper:clusters      oracle: each car is one cluster of its own non-ground points, and no others (tracker_replay.h)
//   paper:heading       oracle: rectangles at cars use the true heading (tracker_replay.h)
//   paper:relay         the path of these two to the tracker without any change, for comparison (tracker_replay.h)
//   paper:ego           oracle: the true ego pose, without delay
//   paper:mounting      the mounting of each sensor is wrong by 2 cm and 0.2 deg on every axis, with different signs
//   paper:empty         control: an empty track; removes all points of cars and of their effects (blooming, smoke);
//                       detections at cars are then chance
//   paper:shuffled      control: the points of each scan in random order; counts must not change, positions only by
//                       rounding
//   paper:late_truth    control: compared with the truth of one period later; errors must grow by the cars' motion
//   paper:no_map        condition: without the log's map
//   paper:no_poses      condition: without ego poses; detections and tracks are compared at the true pose
//
// A configuration (--config NAME.toml) has its file's name in place of the preset's. Its rig, map and poses are the
// log's.
//
//   paper@NAME=VALUE    one parameter changed (--sweep); gets every N-th frame only. The library gets the longer
//                       period: otherwise it would take all sensors for silent and not wait for any of them
#pragma once

#include <exception>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "tools/client/session.h"
#include "tools/evaluation/evaluator.h"
#include "tools/evaluation/snapshot_picker.h"
#include "tools/evaluation/tracker_replay.h"

namespace overtake::evaluation {

using ConfigFiles = std::map<std::string, std::string>;  // name of a configuration -> its file
std::string config_name(const std::string& file);        // its name without folder and ".toml"
// The options that load a preset or a configuration.
cli::Options options_of(const std::string& name, const ConfigFiles& files);
std::vector<std::string> variant_names();  // oracles and controls, without the preset
// Those that exist of a preset or configuration. Throws io::Error for an unknown one.
std::vector<std::string> variants_of(const std::string& name, const ConfigFiles& files = {});
std::vector<std::string> condition_names();  // the same for the conditions
inline bool is_of_sweep(const std::string& name) { return name.find('@') != std::string::npos; }

// Throws io::Error for an unknown preset, variant or parameter, or an invalid value.
void check_variant(const std::string& name, const ConfigFiles& files = {});

// The rig with its sensors' mounting wrong by 2 cm and 0.2 deg on every axis.
io::Rig misplace(io::Rig rig);

class Variant {
 public:
  // `map_file`: the log's map, "" none. `every`: a variant of a sweep gets every N-th frame. Throws io::Error for an
  // unknown preset, variant or parameter, for one that needs the surface of each point when the log has none, and for
  // more time between two frames than the library accepts.
  Variant(const std::string& name, const TruthLog& log, const std::string& map_file, int32_t every = 1,
          const ConfigFiles& files = {});
  // Whether this variant gets the log's n-th frame, from 0 on.
  bool takes(int64_t n) const { return n % every_ == 0; }
  // Pushes frames in order. Throws what the library or the evaluator throws.
  void push(const LogFrame& frame);
  int64_t frames() const { return frames_; }  // pushed frames
  void finish();
  // Sentences on capacities that were reached: the farthest clusters, candidates or tracks were dropped.
  std::vector<std::string> full_capacities() const { return session_->full_capacities("[capacities] "); }
  // A piece of the log (pieces.h) begins: the frames so far were its warm-up.
  void begin_piece() { evaluator_->begin_piece(), frames_ = 0; }

  const std::string& name() const { return name_; }
  Evaluator& evaluator() { return *evaluator_; }
  void take_pictures();                                           // from now on
  const SnapshotPicker* picker() const { return picker_.get(); }  // null: takes no pictures

 private:
  static void on_frame(ovt_reader* reader, void* self);
  void push_poses(int64_t until_ns);
  std::vector<io::EgoRow> true_poses(int64_t until_ns);

  std::string name_, variant_;
  bool without_poses_ = false;
  const TruthLog& log_;
  int32_t every_;
  int64_t frames_ = 0;
  std::unique_ptr<Evaluator> evaluator_;
  std::unique_ptr<TrackerReplay> replay_;
  const LogFrame* input_ = nullptr;
  const std::string map_file_;
  ovt_params params_;
  std::unique_ptr<SnapshotPicker> picker_;
  std::unique_ptr<cli::Session> session_;
  std::exception_ptr failure_;
  std::size_t next_pose_ = 0;
  int64_t next_true_ns_ = INT64_MIN;
  std::vector<PublishedPose> true_poses_;  // those that push_poses has pushed instead of the log's
};

// The rows listed in `rows`, in that order.
LogFrame take_points(const LogFrame& frame, const std::vector<std::vector<int32_t>>& rows);

}  // namespace overtake::evaluation
