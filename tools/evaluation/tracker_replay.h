// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// Oracles of the stages after the segmentation. Changes the pipeline's detections by the truth and pushes them to a
// second detector of the library that only tracks:
//
//   heading    the rectangle of each detection at a car uses the car's true heading
//   clusters   one detection for each car with 3 or more non-ground points by truth, made of exactly these points; no
//              other detections
//   relay      no change: shows the effect of the second detector on the tracks, to compare the others with
//
// The first two lay the rectangle of `paper` (kernels/fit_rectangle.h), whatever the method's own rule is.
// The second detector gets a frame's detections with one stamp, the frame's: detections at a car are moved by the car's
// true speed from their own stamp to it. It does not know the area that no sensor sees.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "core/circuit_map.h"
#include "tools/client/session.h"
#include "tools/evaluation/evaluator.h"

namespace overtake::evaluation {

class TrackerReplay {
 public:
  // `kind` as above. Throws io::Error.
  TrackerReplay(const std::string& kind, const TruthLog& log, const cli::Config& config);
  ~TrackerReplay();
  TrackerReplay(const TrackerReplay&) = delete;
  TrackerReplay& operator=(const TrackerReplay&) = delete;

  void add_poses(const std::vector<io::EgoRow>& rows);
  // Changes and tracks the frame that the reader is positioned at; valid until the next call. Throws io::Error.
  const Replayed& run(ovt_reader* reader, const LogFrame& frame);

 private:
  struct Points {  // of one cluster, vehicle frame
    std::vector<float> x_m, y_m;
    std::vector<int64_t> of_sensor;  // number of points
    double z_m = 0, stamp_ns = 0;    // sums
    void add(const std::array<double, 3>& at_m, int32_t sensor, int64_t stamp_ns);
  };
  void change_headings(ovt_reader* reader, const LogFrame& frame, const ovt_frame_info& info, const ovt_detections& in);
  void make_clusters(ovt_reader* reader, const LogFrame& frame, const ovt_frame_info& info);
  void add_row(const Points& points, int64_t stamp_ns, double heading_ref_rad, bool only_ref);
  std::vector<Points> gather(ovt_reader* reader, const LogFrame& frame, int32_t count,
                             const std::vector<int32_t>& row_of_cluster) const;

  std::string kind_;
  const TruthLog& log_;
  const ovt_params params_;
  CircuitMap map_;
  std::unique_ptr<cli::Session> session_;
  ovt_reader* reader_ = nullptr;
  // The changed detections.
  std::vector<int64_t> stamp_ns_;
  std::vector<float> x_m_, y_m_, z_m_, heading_rad_;
  std::vector<int32_t> source_, point_count_;
  std::vector<uint64_t> track_;
  Replayed out_;
};

}  // namespace overtake::evaluation
