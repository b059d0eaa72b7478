// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// What one frame tells about the error of the ego heading. A localisation often publishes the course as the heading;
// the vehicle's axis differs from it by the slip angle, and each sensor's axis also by its mounting error.
//
//   poses of the frame  --> smooth_headings: removes the noise between neighbouring poses
//   points of walls     --> measure_walls (stages.h): turns the points of each sensor until the walls are parallel
//                            to the bounds
//
// Both depend on the frame alone. track/heading_filter.h learns from the walls of many frames.
#pragma once

#include <cstdint>

#include "pipeline/ego_buffer.h"

namespace overtake {

// The walls that one sensor saw, against the map's bounds.
struct WallHeading {
  bool valid = false;
  double offset_rad = 0;  // to add to the ego heading; contains the error of the sensor's mounting
  double variance = 0;    // of the fit alone, without errors of the map
  int32_t points = 0;     // that agree with the fit
  // How far the wall on the right, and on the left, stands outside of its bound; kNoSide where too few points agree.
  static constexpr double kNoSide = 1e9;
  double beyond_m[2] = {kNoSide, kNoSide};
  int32_t side_points[2] = {0, 0};  // that agree
};

// What the track stage added to the ego heading at the frame's stamp.
struct EgoHeading {
  double offset_rad = 0, sigma_rad = 0;
  int32_t wall_points = 0;
};

struct WallParams {
  float length_m = 0;    // a longer cluster is a wall
  double reach_m = 0;    // walls are used this far ahead and behind
  double scatter_m = 0;  // root mean square of the points' distances from the fit, at most
};

// Replaces the headings of the poses by a straight line over time plus the turn that the yaw rates give: a filter
// without delay over the window. The line's slope is the drift of the heading's error: the smaller `drift_sigma_rps`,
// its standard deviation, against the noise of the headings, the flatter the line. A window of fewer than 3 poses, and
// one whose headings are not such a line, is copied as it is. in and out may be the same.
void smooth_headings(const EgoWindow& in, EgoWindow& out, double drift_sigma_rps) noexcept;
inline constexpr double kAnyDrift = 1e9;  // rad/s: the headings alone tell the slope

// A point of a wall: `along` is its distance from the ego vehicle along the track, `beyond` its distance outside of
// the bound.
struct WallPoint {
  double along_m, beyond_m;
  bool left;
};
inline constexpr int32_t kMaxWallPoints = 1024;

// The turn by which the points on each side have a constant distance to their bound: one distance for each side, and
// the same turn for both. Robust (biweight, with a scale that shrinks), so gaps, cars and posts do not count. Not valid
// if less than a third of a side's points agree: then the two sides contradict, or the map is of another place.
WallHeading fit_walls(const WallParams& params, const WallPoint* points, int32_t count) noexcept;

// The state turned to the left about the map's vertical axis.
EgoState turned(const EgoState& state, double angle_rad) noexcept;

}  // namespace overtake
