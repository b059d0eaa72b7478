// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// Section 7a of kernels/README.md: cuts links between an object and what stands behind it.
#pragma once

#include "core/plane.h"
#include "core/road_surface.h"

namespace overtake {

// A step in range is cut from this on, or from this share of the nearer range; across a bound, from a smaller share.
inline constexpr float kCutStep_m = 1.5f, kCutStepShare = 0.12f, kCutBoundShare = 0.08f;
// Share of its distance by which a bound may err: along a ray that meets it at 0.1 rad, 0.3 m are 3 m.
inline constexpr float kBoundSlack = 0.03f;
// The surface below the step is upright: it comes nearer by less than this part of the step from row to row.
inline constexpr float kCutStepBelow = 0.5f;

// Cuts a link down with a large step in range, where
//   - the upper pixel lies behind the top of an upright object: the next pixel further down, ground included, is at
//     nearly the range of the lower pixel. On ground that was taken for an obstacle each step is about as large as the
//     next one: its rows stay linked. An empty pixel below tells nothing; or
//   - the lower pixel lies inside of the circuit and the upper one outside, where the ray leaves the circuit for the
//     first or for the last time, give or take kBoundSlack: a car and the wall behind it. Ranges stand for distances,
//     the bound between two rays is a straight line, and rays without a bound cut nothing.
//   reads    range_filled_m range_repaired_m bound_per_m[count_rays] last_bound_per_m[count_rays]
//   writes   link_down: clears bits              cost    two differences a linked pixel, four products a group of them
//   agrees   exactly on every ISA
namespace ref {
void cut_steps(Plane<const float> range_filled_m, Plane<const float> range_repaired_m, const float* bound_per_m,
               const float* last_bound_per_m, BitPlane link_down) noexcept;
}

}  // namespace overtake
