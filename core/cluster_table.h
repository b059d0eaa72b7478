// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// Clusters of one sensor, clusters of a whole frame, vehicle candidates and detections, in the vehicle frame. Their
// rows live as long as their frame, so they have no ids: relations are index columns. columns.def lists the columns
// that a reader returns.
//
//   sensor 0: ClusterTable --+
//   sensor 1: ClusterTable --+-- merge_seams --> frame: FrameClusterTable -- gate_clusters --> DetectionTable
//   sensor 2: ClusterTable --+                    (members by first_member, next_member)
#pragma once

#include <cstdint>

namespace overtake {

// Where a table is full, clusters of fewer points give way first: rain and dirt make thousands of them near the sensor.
inline constexpr int32_t kLeastPoints = 3;

// One row per cluster of one sensor, in label order.
struct ClusterTable {
  int32_t count = 0, capacity = 0;
  int32_t* label = nullptr;                                // in the sensor's label image
  int32_t *point_begin = nullptr, *point_count = nullptr;  // span in ClusterPointTable
  float *min_x_m = nullptr, *min_y_m = nullptr, *min_z_m = nullptr;
  float *max_x_m = nullptr, *max_y_m = nullptr, *max_z_m = nullptr;
  float *sum_x_m = nullptr, *sum_y_m = nullptr, *sum_z_m = nullptr;  // over points; centroid = sum / count
  int64_t* sum_offset_ns = nullptr;  // sum of the points' time offsets after the scan's stamp
  float* nearest_m = nullptr;        // smallest range of a point, from the sensor
};
// clang-format off
template <class F>
void for_each_column(ClusterTable& t, F&& f) {
  f("label", t.label);        f("point_begin", t.point_begin);  f("point_count", t.point_count);
  f("min_x_m", t.min_x_m);    f("min_y_m", t.min_y_m);          f("min_z_m", t.min_z_m);
  f("max_x_m", t.max_x_m);    f("max_y_m", t.max_y_m);          f("max_z_m", t.max_z_m);
  f("sum_x_m", t.sum_x_m);    f("sum_y_m", t.sum_y_m);          f("sum_z_m", t.sum_z_m);
  f("sum_offset_ns", t.sum_offset_ns);                          f("nearest_m", t.nearest_m);
}
// clang-format on

// Points of one sensor that belong to a kept cluster: grouped by cluster (label order), then in input order. Vehicle
// frame.
struct ClusterPointTable {
  int32_t count = 0, capacity = 0;
  float *x_m = nullptr, *y_m = nullptr, *z_m = nullptr;
  int32_t* point = nullptr;  // row in the ScanTable
};
// clang-format off
template <class F>
void for_each_column(ClusterPointTable& t, F&& f) {
  f("x_m", t.x_m);  f("y_m", t.y_m);  f("z_m", t.z_m);  f("point", t.point);
}
// clang-format on

// One row per cluster of the frame, after merging across sensors. Ordered by (lowest sensor, label) of its members.
struct FrameClusterTable {
  int32_t count = 0, capacity = 0;
#define OVT_CLUSTER(type, name, ...) type* name = nullptr;
#define OVT_CLUSTER_OWN OVT_CLUSTER
#include "core/columns.def"
};
template <class F>
void for_each_column(FrameClusterTable& t, F&& f) {
#define OVT_CLUSTER(type, name, ...) f(#name, t.name);
#define OVT_CLUSTER_OWN OVT_CLUSTER
#include "core/columns.def"
}

// One row per cluster of any sensor of the frame: sensor 0's clusters, then sensor 1's, ...
struct MemberTable {
  int32_t count = 0, capacity = 0;
  int32_t *sensor = nullptr, *cluster = nullptr;  // row `cluster` of that sensor's ClusterTable
  int32_t* next_member = nullptr;                 // next member of the same merged cluster, -1 at the end
  int32_t* merged = nullptr;                      // row in FrameClusterTable, -1 when that table was full
};
// clang-format off
template <class F>
void for_each_column(MemberTable& t, F&& f) {
  f("sensor", t.sensor);  f("cluster", t.cluster);  f("next_member", t.next_member);  f("merged", t.merged);
}
// clang-format on

// Where a merged cluster lies. Rows as FrameClusterTable; the rules locate_clusters and join_shards write it. Axis 1 of
// a box points along psi_REF, axis 2 to the left of it; both from the vehicle's origin.
struct ClusterPlaceTable {
  int32_t count = 0, capacity = 0;
  uint8_t* known = nullptr;              // 0: larger than a vehicle, so the other columns have no values
  float* heading_rad = nullptr;          // psi_REF, vehicle frame, in (-pi, pi]
  float *s_m = nullptr, *d_m = nullptr;  // centroid on the circuit; 0 where the map is not used
  // Of the circuit there. kNoBound_m where the map is not used; -kNoBound_m beyond the end of an open circuit.
  float *width_left_m = nullptr, *width_right_m = nullptr;
  float *cos = nullptr, *sin = nullptr;           // of psi_REF
  float *low_1_m = nullptr, *high_1_m = nullptr;  // box of the points
  float *low_2_m = nullptr, *high_2_m = nullptr;
  // Scratch of join_shards, `group` also of keep_off_walls: by row; lists of rows, by number of points and by place; in
  // the order of `next`, the middle of the box (vehicle frame) and the next place of the same cell; and the places near
  // one row, with their boxes on its axes.
  int32_t *group = nullptr, *order = nullptr, *next = nullptr;
  float *next_x_m = nullptr, *next_y_m = nullptr;
  int32_t *next_in_cell = nullptr, *near = nullptr;
  float *near_low_1_m = nullptr, *near_high_1_m = nullptr, *near_low_2_m = nullptr, *near_high_2_m = nullptr;
};
inline constexpr float kNoBound_m = 1e9f;
// clang-format off
template <class F>
void for_each_column(ClusterPlaceTable& t, F&& f) {
  f("known", t.known);                f("heading_rad", t.heading_rad);
  f("s_m", t.s_m);                    f("d_m", t.d_m);
  f("width_left_m", t.width_left_m);  f("width_right_m", t.width_right_m);
  f("cos", t.cos);                    f("sin", t.sin);
  f("low_1_m", t.low_1_m);            f("high_1_m", t.high_1_m);
  f("low_2_m", t.low_2_m);            f("high_2_m", t.high_2_m);
  f("group", t.group);                f("order", t.order);              f("next", t.next);
  f("next_x_m", t.next_x_m);          f("next_y_m", t.next_y_m);
  f("next_in_cell", t.next_in_cell);  f("near", t.near);
  f("near_low_1_m", t.near_low_1_m);  f("near_high_1_m", t.near_high_1_m);
  f("near_low_2_m", t.near_low_2_m);  f("near_high_2_m", t.near_high_2_m);
}
// clang-format on

// Source of a detection's heading: the map's centre line or the ego heading (kRef), or the points (kVar).
enum class HeadingSource : int32_t { kRef = 0, kVar = 1 };

// One row per vehicle candidate with its pose. Vehicle frame at the ego pose of stamp_ns. In the order of
// FrameClusterTable.
struct DetectionTable {
  int32_t count = 0, capacity = 0;
#define OVT_DETECTION(type, name, ...) type* name = nullptr;
#include "core/columns.def"
};
template <class F>
void for_each_column(DetectionTable& t, F&& f) {
#define OVT_DETECTION(type, name, ...) f(#name, t.name);
#include "core/columns.def"
}

// The side of a car that the sensor faces, and what an object can be: ovt_view and ovt_object_class.
enum class CarView : int32_t { kRear = 0, kFront = 1, kSide = 2 };
enum class ObjectClass : int32_t { kUnknown = 0, kCar = 1, kDebris = 2 };

// The columns of a detection that only the rule pose_by_view writes. Rows as DetectionTable.
struct DetectionViewTable {
  int32_t count = 0, capacity = 0;
#define OVT_DETECTION_VIEW(type, name, ...) type* name = nullptr;
#define OVT_DETECTION_VIEW_OWN OVT_DETECTION_VIEW
#include "core/columns.def"
};
template <class F>
void for_each_column(DetectionViewTable& t, F&& f) {
#define OVT_DETECTION_VIEW(type, name, ...) f(#name, t.name);
#define OVT_DETECTION_VIEW_OWN OVT_DETECTION_VIEW
#include "core/columns.def"
}

}  // namespace overtake
