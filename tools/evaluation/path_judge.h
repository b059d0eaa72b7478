// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// Compares the predicted paths of tracks with the truth at the times of their points, which later frames of the log
// give. Rows of `paths`, one for each path and horizon:
//
//   frame  car  horizon_s
//   along_m, across_m     predicted minus true position, in the axes of the true car's course at that time
//   square                the error's square in units of the published covariance
//   speed_change_mps      of the true speeds until then (every 0.1 s), the one farthest from the speed at the time of
//                         publication, minus the latter
//   offset_change_m       the same for the car's offset from the centre line: by the truth where the log has it, else
//                         by the circuit; NaN without both
//   steady_square         the error's square in units of a steady car's variances (path_steady_along_m, ..._across_m);
//                         NaN without them
//
// A horizon uses the path's nearest point and is compared at the time of that point. A point whose time the truth does
// not reach has no row.
#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "core/circuit_map.h"
#include "pipeline/overtake.h"
#include "tools/evaluation/table.h"
#include "tools/evaluation/truth_log.h"

namespace overtake::evaluation {

inline constexpr double kHorizonsS[] = {0.5, 1, 2, 3};

class PathJudge {
 public:
  using CarsAt = std::function<std::vector<CarTruth>(int64_t stamp_ns)>;

  // For logs whose truth has no offsets. Throws io::Error.
  void use_circuit(const std::string& map_file);
  // The path of a track at `car`, the truth at tracks.publish_ns.
  void add(double frame, const ovt_tracks& tracks, int32_t row, const CarTruth& car);
  void forget() { open_.clear(); }
  // Adds the rows of all points up to `until_ns`, to which the truth is known.
  void advance(int64_t until_ns, const CarsAt& cars_at, Table& out);

 private:
  struct Point {
    double horizon_s = 0;
    int64_t stamp_ns = 0;
    double x_m = 0, y_m = 0, var_x = 0, cov_xy = 0, var_y = 0;
    double course_rad = 0, steady_along_m = 0, steady_across_m = 0;  // deviations of 0: not published
  };
  struct Path {
    double frame = 0, speed_mps = 0, offset_m = 0;
    int32_t car = 0, segment = -1;
    int64_t sample_ns = 0;  // the next sample of the truth
    double speed_change_mps = 0, offset_change_m = 0;
    std::size_t next = 0;  // of `points`
    std::vector<Point> points;
  };
  static double steady_square(const Point& p, const double (&error)[2]);
  double offset_of(const CarTruth& car, int32_t& segment) const;
  // False: the truth has no such car any more.
  bool sample(Path& path, int64_t stamp_ns, const std::vector<CarTruth>& cars, Table& out);

  CircuitMap circuit_;
  std::vector<Path> open_;
};

}  // namespace overtake::evaluation
