// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// The images of one sensor's scan. Row 0 is the top layer, column 0 the leftmost azimuth, columns grow to the right.
// All images share one shape and one stride, so one pixel index (row * stride + column) is valid in all of them.
#pragma once

#include <initializer_list>

#include "core/arena.h"
#include "core/plane.h"

namespace overtake {

// Angles run from 0 (level) to pi/2 (upright). Negative values mark pairs without an angle.
inline constexpr float kAngleUndefined = -1.0f;  // a pixel of the pair is missing: not "ground"
inline constexpr float kAngleSkipped = -2.0f;    // the two layers almost touch

struct RangeImages {
  Plane<float> range_m, elevation_rad;                    // winners; kNoReturn where no point fell (paper: R, E)
  Plane<int32_t> pixel_point;                             // index of the winner in the scan, kNoPoint
  Plane<float> range_filled_m, elevation_filled_rad;      // gaps filled: range here, kNoReturn in range_m
  Plane<float> angle_rad, angle_smooth_rad;               // row r is the pair (r, r + 1); the last row is unused (A)
  Plane<float> height_m;                                  // over the running ground
  BitPlane nonground, steep;                              // before repair; steep: with the pixel below, then scratch
  BitPlane considered, smoke;                             // non-ground or dark; of these, taken out of nonground
  Plane<float> range_repaired_m, elevation_repaired_rad;  // non-ground image after repair; other pixels are 0
  BitPlane nonground_repaired;
  BitPlane link_right, link_down;  // pixel joins its right / lower neighbour (eq. 2)
  Plane<int32_t> labels;           // kLabelNone, kLabelGround, clusters 1, 2, ... (L)
};

inline void carve_range_images(Carver& carver, RangeImages& m, int32_t rows, int32_t cols) {
  for (Plane<float>* p : {&m.range_m, &m.elevation_rad, &m.range_filled_m, &m.elevation_filled_rad, &m.angle_rad,
                          &m.angle_smooth_rad, &m.height_m, &m.range_repaired_m, &m.elevation_repaired_rad})
    *p = carver.take_plane<float>(rows, cols);
  for (Plane<int32_t>* p : {&m.pixel_point, &m.labels}) *p = carver.take_plane<int32_t>(rows, cols);
  for (BitPlane* p :
       {&m.nonground, &m.steep, &m.considered, &m.smoke, &m.nonground_repaired, &m.link_right, &m.link_down})
    *p = carver.take_bits(rows, cols);
}

}  // namespace overtake
