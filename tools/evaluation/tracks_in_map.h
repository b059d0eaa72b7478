// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// Takes tracks to the map, where the truth is. Those of a pipeline without ego poses are in the vehicle frame.
#pragma once

#include <vector>

#include "pipeline/overtake.h"
#include "tools/evaluation/truth_log.h"

namespace overtake::evaluation {

// The true ego at tracks.publish_ns takes places, headings and motion to the map; the height of a track is that of the
// nearest true car. A track's motion is relative to the vehicle's, so the vehicle's velocity at the track's place is
// added. The yaw rate is NaN: that of a relative course is another quantity. Paths and covariance stay in the vehicle
// frame.
class TracksInMap {
 public:
  // `cars` at tracks.publish_ns, with the ego. The result is valid until the next call.
  const ovt_tracks& take(const ovt_tracks& tracks, const std::vector<CarTruth>& cars);

 private:
  ovt_tracks out_{};
  std::vector<double> x_m_, y_m_, speed_mps_, course_rad_, yaw_rate_rps_, heading_rad_;
};

}  // namespace overtake::evaluation
