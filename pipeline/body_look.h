// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// What the points of a merged cluster look like. Smoke is dark, and its ranges jump from pixel to pixel. A point is lit
// if it is brighter than the frame's smoke_limit of its sensor, and up to twice that also beside another one on a
// surface. All points of a sensor that sees little or no smoke are lit.
#pragma once

#include "pipeline/cluster_places.h"
#include "pipeline/pixel_view.h"
#include "pipeline/stages.h"

namespace overtake {

// Writes frame.smoke_limit.
void find_smoke_limits(const StageContext& context, Frame& frame) noexcept;

// Whether at least half of a cluster's points are lit.
bool is_lit(const StageContext& context, const Frame& frame, int32_t row) noexcept;

// The box of a cluster's body along a heading; `box` is that of all its points.
//   smoke   what smoke adds to a car lies at its ends: only lit points count, if they are at least half of it
//   strays  returns of rain or spray in front of a car may be in one cluster with it. Where the box is longer or wider
//           than a car, points beyond an empty stretch of 0.2 m do not count, if they are at most one in 50
OrientedBox trim_box(const StageContext& context, const Frame& frame, int32_t row, float cos, float sin,
                     const OrientedBox& box) noexcept;

// The pixels of a cluster in the image of its main sensor, which `view` is of; row_high is -1 if it has none.
PixelBox main_pixels(const Frame& frame, int32_t row, const PixelView& view) noexcept;

// The rows of a cluster, of all its sensors, and those beside which the ground has the same range.
LevelRows count_level_rows(const StageContext& context, const Frame& frame, int32_t row) noexcept;

// Whether the shadow of the own car may cut off the sides of a near cluster: the sensor sees no ground beside it. There
// a car shows few points, and not its width. False where the sensor sees smoke, which hides the ground, too.
bool is_in_own_shadow(const StageContext& context, const Frame& frame, int32_t row) noexcept;

// Whether a cluster is a sign, which reflects the light back to where it comes from: most of it is far brighter than
// the road. Of a car so are lamps and plates, but not the body around them.
bool is_sign(const Frame& frame, int32_t row) noexcept;

// Whether a cluster is a small reflector with the glare around it, which is darker than the reflector itself but large:
// its mean is far brighter than the road, and not by one point alone, which may be the lamp of a car. A share of the
// points, bare_share at least, must be as bright as a bare reflector: of a car, its plates and lamps are.
bool is_reflector(const Frame& frame, int32_t row, float bare_share) noexcept;

// Whether a cluster is a car beyond doubt: many points on several rows, at most half of them on one, lit, and most of
// them beside another one on a surface; it stands on the ground, is about as high as a car, is wider than a piece of a
// wall, and is no sign.
bool is_surely_car(const StageContext& context, const Frame& frame, int32_t row) noexcept;

}  // namespace overtake
