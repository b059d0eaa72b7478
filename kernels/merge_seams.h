// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// Section 8 of kernels/README.md: merges clusters of one object across neighbouring sensors (eq. 4).
#pragma once

#include "core/cluster_table.h"
#include "core/point_table.h"
#include "core/range_image.h"
#include "core/sensor_model.h"

namespace overtake {

// The input of one sensor of the frame. `present` false: the frame has no scan of the sensor, and only `sensor` is
// read.
struct SeamSide {
  bool present = false;
  const SensorModel* sensor = nullptr;
  const RangeImages* images = nullptr;
  const ScanTable* scan = nullptr;
  const PointTable* points = nullptr;
  const ClusterTable* clusters = nullptr;
  const int32_t* row_of_label = nullptr;
  int64_t stamp_ns = 0;
};

struct MergeSeamsParams {
  float distance_m;  // th_mrg
  int32_t columns;   // K
};

// Pairs (left sensor, right sensor): the right edge of the first meets the left edge of the second. Follows from the
// mounting azimuths of all sensors, clockwise; sensors that wrap have no edge. Returns the pair count (<= sensors).
int32_t find_seams(const SensorModel* sensors, int32_t sensor_count, int32_t left[kMaxSensors],
                   int32_t right[kMaxSensors]) noexcept;

// Merges two clusters of a seam's sensors when any point of the last K columns of the left one is closer (3-D, vehicle
// frame) than distance_m to any point of the first K columns of the right one. Transitive (union-find) over all
// sensors. Only winners of a pixel that carry a cluster's label count as points here.
//   reads    sides [sensor_count]       writes  members, merged
//   order    members: sensor by sensor, label order; merged: by first member. Beyond merged.capacity the rows of which
//            a member has kLeastPoints or more are kept first, of both sorts the nearest (ties: earlier row); members
//            of dropped clusters have merged = -1
//   returns  merged clusters that did not fit
//   center   sums of the members in member order, divided by the count; stamp = mean of the points' stamps (integer,
//            rounded toward minus infinity)
//   scratch  the points of both sides of a seam, K * rows on each; union-find     agrees  exactly on every ISA
struct SeamScratch {
  float *x_m[2] = {}, *y_m[2] = {}, *z_m[2] = {};
  int32_t* member[2] = {};
  int32_t* parent = nullptr;  // union-find, one per member
  int32_t* order = nullptr;   // one per merged row
  int32_t capacity = 0;       // points on one side of a seam
};

// The only step with a vector form. Bit i: place begin + i of the columns is closer than sqrt(limit) to (x, y, z).
// `column`: x, y, z, with all 16 places readable; begin is a multiple of 16.
using NearBitsFn = uint32_t(const float* const column[3], int32_t begin, const float place[3], float limit);
// The other steps have one form for every ISA: mostly copies of columns, which the compiler vectorises well.
int32_t merge_seams_by(NearBitsFn* near_bits, const MergeSeamsParams& params, const SeamSide* sides,
                       int32_t sensor_count, MemberTable& members, FrameClusterTable& merged,
                       SeamScratch& scratch) noexcept;
// Sums up the members of one merged row, which first_member and next_member list in member order, into its other
// columns. Reads the sides' clusters and stamps only.
void sum_up_members(const SeamSide* sides, const MemberTable& members, FrameClusterTable& merged, int32_t row) noexcept;
namespace ref {
NearBitsFn near_bits;
int32_t merge_seams(const MergeSeamsParams& params, const SeamSide* sides, int32_t sensor_count, MemberTable& members,
                    FrameClusterTable& merged, SeamScratch& scratch) noexcept;
}  // namespace ref

}  // namespace overtake
