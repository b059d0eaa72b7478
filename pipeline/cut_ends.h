// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// Which ends and sides of a car the edge of the field of view, or of a gap in it, cuts off.
#pragma once

#include "pipeline/cluster_places.h"

namespace overtake {

// Of the merged cluster `row`, on the axes of the heading (cos, sin); `box` is its box there. An end or a side is cut
// off if the sensor's first or last column, or the one beside a gap, goes through the cluster near it, and no other
// sensor of the frame sees what lies beyond. If something nearer hides what lies beyond the other end, that one counts
// as cut off, too; then the first one does not if it looks like the face of an end. Nearer than 20 m only. Reads
// merged, members, cluster points, present sensors and their mountings, scan, pixel_point and points, gaps.
CutEnds find_cut_ends(const StageContext& context, const Frame& frame, int32_t row, float cos, float sin,
                      const OrientedBox& box) noexcept;

}  // namespace overtake
