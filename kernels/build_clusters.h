// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// Stage 8a: labels to a table of clusters in the vehicle frame.
#pragma once

#include "core/cluster_table.h"
#include "core/point_table.h"
#include "core/sensor_model.h"

namespace overtake {

// Counting sort of the points by label, transformed to the vehicle frame, with bounds and sums per cluster. Labels that
// no point carries (all their pixels were repaired) make no row. With more clusters than clusters.capacity the nearest
// (smallest range of a point, ties: smaller label) are kept; rows stay in label order.
//   reads    scan x y z time_offset_ns; points label range_m; label_count (from label_bfs)
//   writes   clusters, cluster_points, row_of_label[label_count + 1] (row or -1; entry 0 is -1)
//   returns  clusters that did not fit
//   sums     in input order within a cluster, in 16 lanes: point k of a cluster goes to lane k % 16, lanes are added
//            pairwise (8, 4, 2, 1 apart)     scratch  cursor[label_count + 1], order[label_count]
//   agrees   exactly on every ISA
namespace ref {
int32_t build_clusters(const Transform& T_vehicle_sensor, const ScanTable& scan, const PointTable& points,
                       int32_t label_count, ClusterTable& clusters, ClusterPointTable& cluster_points,
                       int32_t* row_of_label, int32_t* cursor, int32_t* order) noexcept;

// The step of it that sorts. point_count and nearest_bits [label_count + 1] hold how many points a label has and the
// bits of its smallest range, which need not be known when all labels with points fit. Writes the labels that get a
// row, in label order, into order; returns how many carry points at all.
int32_t choose_labels(int32_t label_count, int32_t capacity, const int32_t* point_count, const int32_t* nearest_bits,
                      int32_t* order) noexcept;
}  // namespace ref

}  // namespace overtake
