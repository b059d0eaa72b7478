// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// Oracles of the stages behind the segmentation. What the pipeline detected is changed by the truth and given to a
// second detector of the library that only tracks:
//
//   heading    the rectangle of each detection at a car is laid by the car's true heading
//   clusters   one detection for each car with 3 non-ground points or more by truth, of all of them and of no others,
//   by
//              the pipeline's own pose (stage 10); no other detections
//   relay      nothing is changed: what the way through a second detector does to the tracks, to compare the others
//   with
//
// The second detector takes a frame's detections at one stamp, the frame's: those at a car are moved on by the car's
// true speed from their own stamp to it. It does not know which part of the surroundings no sensor sees.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "core/track_map.h"
#include "tools/client/session.h"
#include "tools/evaluation/judge.h"

namespace overtake::evaluation {

class Relay {
 public:
  // `kind` as above. Throws io::Error.
  Relay(const std::string& kind, const TruthLog& log, const cli::Config& config);
  ~Relay();
  Relay(const Relay&) = delete;
  Relay& operator=(const Relay&) = delete;

  void add_poses(const std::vector<io::EgoRow>& rows);
  // The frame the reader stands on, changed and tracked; stays until the next call. Throws io::Error.
  const Relayed& run(ovt_reader* reader, const LogFrame& frame);

 private:
  struct Points {  // of one cluster, vehicle frame
    std::vector<float> x_m, y_m;
    std::vector<int64_t> of_sensor;  // number of points
    double z_m = 0, stamp_ns = 0;    // sums
    void add(const std::array<double, 3>& at_m, int32_t sensor, int64_t stamp_ns);
  };
  void change_headings(ovt_reader* reader, const LogFrame& frame, const ovt_detections& in);
  void make_clusters(ovt_reader* reader, const LogFrame& frame);
  void add_row(const Points& points, int64_t stamp_ns, double heading_ref_rad, bool only_ref);
  std::vector<Points> gather(ovt_reader* reader, const LogFrame& frame, int32_t count,
                             const std::vector<int32_t>& row_of_cluster) const;

  std::string kind_;
  const TruthLog& log_;
  const ovt_params params_;
  TrackMap map_;
  std::unique_ptr<cli::Session> session_;
  ovt_reader* reader_ = nullptr;
  // The changed detections.
  std::vector<int64_t> stamp_ns_;
  std::vector<float> x_m_, y_m_, z_m_, heading_rad_;
  std::vector<int32_t> source_, point_count_;
  std::vector<uint64_t> track_;
  Relayed out_;
};

}  // namespace overtake::evaluation
