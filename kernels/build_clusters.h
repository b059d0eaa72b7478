// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// Section 8 of kernels/README.md: makes a table of clusters in the vehicle frame from the labels.
#pragma once

#include "core/cluster_table.h"
#include "core/point_table.h"
#include "core/sensor_model.h"

namespace overtake {

// Counting sort of the points by label. Transforms the points to the vehicle frame and computes bounds and sums per
// cluster. Labels without a point (all their pixels were repaired) get no row. With more clusters than
// clusters.capacity it keeps those of kLeastPoints and more first, of both sorts the nearest (smallest range of a
// point, ties: smaller label); rows stay in label order.
//   reads    scan x y z time_offset_ns; points label range_m; label_count (at most the number of pixels)
//   writes   clusters, cluster_points, row_of_label[label_count + 1] (row or -1; entry 0 is -1)
//            cluster_points has room for kRowAlign rows more than the points: vectors begin at the first row of a
//            cluster
//   returns  clusters that did not fit
//   sums     in input order within a cluster, in 16 lanes (core/reduce.h)
//   scratch  cursor[label_count + 1], order[label_count]
//   agrees   exactly on every ISA
namespace ref {
int32_t build_clusters(const Transform& T_vehicle_sensor, const ScanTable& scan, const PointTable& points,
                       int32_t label_count, ClusterTable& clusters, ClusterPointTable& cluster_points,
                       int32_t* row_of_label, int32_t* cursor, int32_t* order) noexcept;

// Chooses the labels that get a row. point_count and nearest_bits [label_count + 1] hold each label's number of points
// and the bits of its smallest range; nearest_bits may be unset when all labels with points fit. Writes the chosen
// labels, in label order, into order. Returns the number of labels with points.
int32_t choose_labels(int32_t label_count, int32_t capacity, const int32_t* point_count, const int32_t* nearest_bits,
                      int32_t* order) noexcept;
}  // namespace ref

}  // namespace overtake
