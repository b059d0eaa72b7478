// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// Stage 8b: clusters of neighbouring sensors that are one object (eq. 4).
#pragma once

#include "core/cluster_table.h"
#include "core/point_table.h"
#include "core/range_image.h"
#include "core/sensor_model.h"

namespace overtake {

// What merging reads of one sensor of the frame. `present` false: no scan of it in this frame; only `sensor` is read
// then.
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

// Pairs (left sensor, right sensor): the right edge of the first meets the left edge of the second. From the mounting
// azimuths of all sensors of the rig, clockwise; sensors that wrap have no edge. Returns the pair count (<= sensors).
int32_t find_seams(const SensorModel* sensors, int32_t sensor_count, int32_t left[kMaxSensors],
                   int32_t right[kMaxSensors]) noexcept;

// Two clusters of the sensors of a seam are one when any point of the last K columns of one is closer (3-D, vehicle
// frame) than distance_m to any of the first K columns of the other. Transitive (union-find), all sensors at once. A
// point here is a pixel's winner that carries a cluster's label.
//   reads    sides [sensor_count]       writes  members, merged
//   order    members: sensor by sensor, label order. merged: by first member. With more than merged.capacity the
//            nearest are kept (ties: earlier row); members of the others have merged = -1
//   returns  merged clusters that did not fit
//   center   sums of the members in member order, divided by the count; stamp = mean of the points' stamps (integer,
//            rounded toward minus infinity)
//   scratch  seam: two columns sets of K * rows points (x y z member)     agrees  exactly on every ISA
struct SeamScratch {
  float *x_m[2] = {}, *y_m[2] = {}, *z_m[2] = {};
  int32_t* member[2] = {};
  int32_t* parent = nullptr;  // union-find, one per member
  int32_t* order = nullptr;   // one per merged row
  int32_t capacity = 0;       // points on one side of a seam
};

// The one step with lanes: which of the places begin .. begin + 15 of the columns are closer than the root of limit to
// (x, y, z), a bit each. `column`: x, y, z, all 16 places readable; begin is a multiple of 16.
using NearBitsFn = uint32_t(const float* const column[3], int32_t begin, const float place[3], float limit);
// Everything else is one code on every ISA: mostly moving columns, which the compiler does well.
int32_t merge_seams_by(NearBitsFn* near_bits, const MergeSeamsParams& params, const SeamSide* sides,
                       int32_t sensor_count, MemberTable& members, MergedTable& merged, SeamScratch& scratch) noexcept;
namespace ref {
NearBitsFn near_bits;
int32_t merge_seams(const MergeSeamsParams& params, const SeamSide* sides, int32_t sensor_count, MemberTable& members,
                    MergedTable& merged, SeamScratch& scratch) noexcept;
}  // namespace ref

}  // namespace overtake
