// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// Predicted paths of the tracker of `best` in closed form (pipeline/README.md, "Predicted paths of best"). With the
// place s0 and offset d0 on the lane, and the course less the lane's heading in two parts, e0 of the car's own way
// across its lane, and c0 an error of the estimate, with which d0 is wrong by b0:
//
//   e(t) = e0 f(t / path_turn_s) + c0 f(t / 0.05 s)            f(h) = 1 / (1 + h + h^2 / 2)
//   d(t) = d0 + the integral of v e(t) - b0 (1 - f(t / 0.05 s))
//   s(t)   where the car has driven v t: a way ds at the offset d is (1 - kappa d) ds long
//
// A pure function of the estimate, the map and the parameters. A path starts at the estimate: as t goes to 0, place,
// course and covariance go to those of the estimate.
#pragma once

#include "core/arena.h"
#include "core/circuit_map.h"
#include "core/track_table.h"
#include "kernels/kernel_table.h"
#include "pipeline/track/track_filter.h"
#include "pipeline/track/tracker_params.h"

namespace overtake {

enum class PathKind : int32_t {
  kLane,      // along the centre line, at the car's offset
  kArc,       // at the estimate's yaw rate
  kStraight,  // along the course
  kRest       // along the course, and comes to rest
};

// How much more, or less, than others this car changes its speed and its place across the lane: variances. And what
// counts of them, and of the estimate's variances, if it goes on as it drives.
struct PathNoise {
  double along = 1.0, across = 1.0;
  double steady_along = 1.0, steady_across = 1.0, steady_speed = 0.0, steady_drift = 0.0;
};

class LanePath {
 public:
  LanePath(const TrackerParams& params, const CircuitMap* map);  // map: null, or not empty
  void carve(Carver& carver);
  void fill();  // after the memory is there
  // Appends the points_per_track points of a car's path, at most path_points(params). `segment`: of the map, a hint.
  // `noise` counts for a car that drives (not kRest).
  void write(const TrackEstimate& estimate, PathKind kind, int32_t segment, const PathNoise& noise,
             PathTable& t) const noexcept;

 private:
  struct Columns {  // by point, see PathTimes; of the variances, what does not depend on the car
    double *along_s, *across_s, *across_s2, *along_m2, *across_m2;
  };
  template <class PlaceOf>
  void write_points(const PathCar& car, const Columns& by_point, const PathNoise& noise, PlaceOf&& place,
                    PathTable& t) const noexcept;

  Columns lane_{}, free_{}, rest_{};
  double* turn_left_ = nullptr;  // of e0: what is left, of 1; its integral is lane_.across_s
  double *error_left_ = nullptr, *error_across_s_ = nullptr;  // the same of c0 and b0
  double* late_s_ = nullptr;  // of e0^2: the time that a car loses along the lane while it drives across it
  double *speed_m2_ = nullptr, *drift_m2_ = nullptr;  // of path_speed and path_across, times PathNoise
  double* rest_speed_ = nullptr;                      // of the speed: what a car that comes to rest still has
  const LaneTrackerParams params_;
  const CircuitMap* const map_;
  const KernelTable& kernels_;
  const double step_s_;
  const int32_t points_;
};

}  // namespace overtake
