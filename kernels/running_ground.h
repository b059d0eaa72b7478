// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// Section 5b of kernels/README.md: ground removal by a running ground height.
#pragma once

#include "core/range_image.h"
#include "core/road_surface.h"

namespace overtake {

// How far ground may lie from the running height, and how fast the running slope may change.
struct GroundTolerance {
  float per_m;          // allowed height grows by this per metre from the last ground pixel
  float limit_m;        // ... up to this
  float slope_limit;    // of the running slope against the road surface
  float slope_reach_m;  // the running slope is measured over this distance
};

struct RunningGroundParams {
  float height_m;           // allowed height above the running ground at the last ground pixel
  GroundTolerance known;    // up to known_m of the rays
  GroundTolerance guess;    // beyond
  float start_per_m;        // per_m until the slope is measured
  float start_limit_m;      // limit_m until then
  float level_reach_m;      // ground may also rise like a level plane this far from the last ground pixel,
  float free_level_m;       // ... this far without a map
  float level_slope_slack;  // ... by this much steeper
  float echo_limit_m;       // a road has no returns where distance^2 / height over its tangent is larger
  float foot_slope;         // a ground pixel below an obstacle belongs to it when the pair is steeper
};

// Walks up each column from the road under the sensor. A pixel is ground if its height over the running ground is
// small. Only ground pixels move the running ground: its place (distance, height) and its slope against the road
// surface. So a missing row costs nothing, and an obstacle does not lift the ground behind it.
//   reads    range_filled_m elevation_filled_rad; road: its rays for this image
//   writes   height_m (height over the running ground, 0 without a return), nonground, every word
//   rules    - ground: height <= height_m + per_m * distance from the last ground pixel, at most limit_m; or, up to
//              level_reach_m or free_level_m from it, a rise up to that of a level plane (apron and infield beside a
//              banked track)
//              until the ground pixels have measured a slope, over 2 m and a quarter of the run, start_per_m and
//              start_limit_m hold
//            - only up to where a road returns an echo: distance^2 <= echo_limit_m * height of the sensor over its
//              tangent
//            - only pixels farther than the last ground pixel, that rise by a slope of 0.45 at most (the foot of a wall
//              must not lift it) and fall by less than a slope of 0.2 and 0.2 m, over a long run of 0.04 and 1 m, and
//              where the road is known of 0.01 and 0.3 m (nor a hole or a mirror image lower it), move it
//            - the running slope adapts over slope_reach_m and is limited; the first ground pixel measures none
//            - feet: below a non-ground pixel, pixels over the running ground are non-ground while the pairs are
//              steeper than foot_slope
//   scratch  steep
//   agrees   exactly on every ISA
namespace ref {
void running_ground(const RunningGroundParams& params, const RoadSurface& road, Plane<const float> range_filled_m,
                    Plane<const float> elevation_filled_rad, Plane<float> height_m, BitPlane nonground, BitPlane steep,
                    ColumnSpan columns = {}) noexcept;
}

}  // namespace overtake
