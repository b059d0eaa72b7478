// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// The inner side of the outer wall in the recorded AV-21 frames.
#pragma once

#include <cmath>
#include <iterator>

namespace overtake::evaluation {

// Vertical planes through these points, vehicle frame: from -5 m on set by hand in pictures of frames 2, 4 and 5 from
// above; behind by the upright points in pieces of 10 m, the median of four frames. The car keeps its distance to the
// wall, so one set fits all frames.
inline constexpr double kRacecarWall[][2] = {{-105.0, 4.4}, {-95.0, 0.8},   {-85.0, -3.2}, {-75.0, -6.4},
                                             {-65.0, -8.7}, {-25.0, -10.0}, {-5.0, -9.6},  {20.0, -9.2},
                                             {50.0, -6.7},  {70.0, -4.4},   {90.0, -1.5},  {110.0, 1.6}};

// Distance of a point behind the wall's inner side, metres; negative on the track. -100 beyond the ends of the planes.
inline double behind_racecar_wall(double x_m, double y_m) {
  for (std::size_t i = 0; i + 1 < std::size(kRacecarWall); ++i) {
    const auto &a = kRacecarWall[i], &b = kRacecarWall[i + 1];
    if (x_m < a[0] || x_m > b[0]) continue;
    const double dx = b[0] - a[0], dy = b[1] - a[1];
    return -((y_m - a[1]) * dx - (x_m - a[0]) * dy) / std::hypot(dx, dy);
  }
  return -100.0;
}

// Between the walls: 0.5 to 16 m from the outer one. The own car's body is not on the road.
inline bool is_on_racecar_road(double x_m, double y_m) {
  const double on_track_m = -behind_racecar_wall(x_m, y_m);
  const bool own_body = x_m > -1.5 && x_m < 4.5 && std::fabs(y_m) < 1.2;
  return on_track_m >= 0.5 && on_track_m <= 16 && !own_body;
}

}  // namespace overtake::evaluation
