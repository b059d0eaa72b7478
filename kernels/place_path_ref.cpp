// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
#include "kernels/place_path.h"

namespace overtake::ref {

void place_path(const PathCar& car, const PathTimes& times, const LanePlaces& lane, int32_t count,
                const PathColumns& columns) noexcept {
  for (int32_t k = 0; k < count; ++k) {
    const PathPoint<double> p =
        place_path_point(car, times.along_s[k], times.across_s[k], times.across_s2[k], times.along_m2[k],
                         times.across_m2[k], times.steady_along_m2[k], times.steady_across_m2[k], lane.x_m[k],
                         lane.y_m[k], lane.heading_rad[k], lane.ahead_m[k], lane.left_m[k], lane.turn_rad[k]);
    columns.x_m[k] = p.x_m;
    columns.y_m[k] = p.y_m;
    columns.course_rad[k] = p.course_rad;
    columns.var_x[k] = p.var_x;
    columns.var_y[k] = p.var_y;
    columns.cov_xy[k] = p.cov_xy;
    columns.steady_along_m[k] = p.steady_along_m;
    columns.steady_across_m[k] = p.steady_across_m;
  }
}

}  // namespace overtake::ref
