// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// Where a merged cluster lies: on the circuit, along psi_REF, and its points. Functions that several rules of a frame
// share.
#pragma once

#include <algorithm>

#include "core/circuit_map.h"
#include "kernels/heading_grid.h"
#include "pipeline/stages.h"

namespace overtake {

// The inputs of merge_seams, and of sum_up_members: one side for each sensor. sides[sensor_count].
void list_sides(const StageContext& context, const Frame& frame, SeamSide* sides) noexcept;

// A car may be this far outside of the circuit, on its apron.
inline constexpr float kApron_m = 5.0f;

// How far outside of the circuit an object may be in the way of the ego vehicle. If the ego vehicle is a little outside
// of the circuit: a vehicle's width farther out than it. Else 0.
double find_outside(const StageContext& context, const Frame& frame) noexcept;

// psi_REF of a merged cluster, and the place of its centroid on the circuit.
struct ClusterReference {
  double heading_rad = 0.0;  // vehicle frame; not wrapped
  bool on_map = false;       // the map may be used and an ego pose is known: `place` is valid
  bool fresh = false;        // on_map, and the ego pose is no older than kEgoFreshNs
  MapProjection place{};
};

// psi_REF: heading of the centre line at the centroid. Without a usable map or an ego pose it is the ego heading (0),
// also when the ego pose is off the map: the line's heading at another place is a worse estimate. `hint`: the segment
// of a neighbour, -1 none; changes the cost, never the result.
ClusterReference find_reference(const StageContext& context, const Frame& frame, int32_t row, int32_t& hint) noexcept;

// Calls f(sensor part, row in its ClusterTable) for each cluster of a merged row, in the order of its members.
template <class F>
void for_each_member(const Frame& frame, int32_t row, F&& f) {
  for (int32_t m = frame.merged.first_member[row]; m >= 0; m = frame.members.next_member[m])
    f(frame.sensors[frame.members.sensor[m]], frame.members.cluster[m]);
}

// Calls f(height over the running ground, z) for each point of a merged cluster that has a pixel of the height image.
template <class F>
void for_each_height(const Frame& frame, int32_t row, F&& f) {
  for_each_member(frame, row, [&](const SensorPart& part, int32_t cluster) {
    const Plane<float>& image = part.kept.images.height_m;
    const int32_t begin = part.clusters.point_begin[cluster], end = begin + part.clusters.point_count[cluster];
    for (int32_t k = begin; image.data && k < end; ++k) {
      const int32_t pixel = part.kept.points.pixel[part.cluster_points.point[k]];
      if (pixel >= 0) f(image.data[pixel], part.cluster_points.z_m[k]);
    }
  });
}

// All points of a merged cluster as two columns: of the sensor, or copied to the frame's fit_x_m and fit_y_m if the
// cluster has several members.
struct ClusterPoints {
  const float *x_m, *y_m;
  int32_t count;
};
ClusterPoints gather_points(Frame& frame, int32_t row) noexcept;

// Extent of points along and across a heading, from the origin of the vehicle frame. Axis 2 points to the left.
struct OrientedBox {
  float low_1, high_1, low_2, high_2;
  float length() const { return high_1 - low_1; }
  float width() const { return high_2 - low_2; }
};
inline bool fits(const CarLimits& limits, const OrientedBox& box) noexcept {
  return box.length() <= limits.length_m && box.width() <= limits.width_m;
}
// Headings from 0 to 85 deg in steps of 5 deg; the two axes of a box stand for the other three quarters, too. At the
// nearest heading a car of 4.9 x 1.9 m is wider by 0.2 m at most, which is less than the slack of the width.
struct CoarseHeading {
  float cos, sin;
};
inline constexpr int32_t kCoarseStep_deg = 5, kCoarseHeadingCount = kDegreeCount / kCoarseStep_deg;
inline CoarseHeading coarse_heading(int32_t index) noexcept {
  return {kHeadingGrid.degree_cos[index * kCoarseStep_deg], kHeadingGrid.degree_sin[index * kCoarseStep_deg]};
}
// Whether box_at(cos, sin) fits at some coarse heading.
template <class F>
bool fits_at_any_heading(const CarLimits& limits, F&& box_at) noexcept {
  for (int32_t h = 0; h < kCoarseHeadingCount; ++h) {
    const CoarseHeading heading = coarse_heading(h);
    const OrientedBox box = box_at(heading.cos, heading.sin);
    if (fits(limits, box) || fits(limits, {box.low_2, box.high_2, box.low_1, box.high_1})) return true;
  }
  return false;
}
OrientedBox measure_box(const Frame& frame, int32_t row, float cos, float sin) noexcept;

// Heights of a cluster's points over the running ground, and the mean height of that ground below them, vehicle frame.
// Without pixels of the height image, the lowest point stands for the ground.
struct ClusterHeights {
  float low_m, high_m, road_z_m;
};
ClusterHeights measure_heights(const Frame& frame, int32_t row) noexcept;

// The box of a row of frame.places along its psi_REF.
inline OrientedBox box_of(const ClusterPlaceTable& places, int32_t row) noexcept {
  return {places.low_1_m[row], places.high_1_m[row], places.low_2_m[row], places.high_2_m[row]};
}

// psi_VAR and the rectangle at two headings, of all points of a merged cluster (eq. 5).
RectangleFit fit_cluster(const StageContext& context, Frame& frame, int32_t row, float heading_ref_rad) noexcept;
// Writes row i of frame.detections, but the place on the map: the merged cluster's columns, and the fit.
void write_pose(Frame& frame, int32_t i, int32_t row, const RectangleFit& fit) noexcept;

// Fills a row of frame.places from the merged cluster.
void locate_cluster(const StageContext& context, Frame& frame, int32_t row, int32_t& hint) noexcept;

// Whether the circuit's bounds are known at a row: with a map and a fresh ego pose on it.
inline bool has_bounds(const ClusterPlaceTable& places, int32_t row) noexcept {
  return places.width_left_m[row] < kNoBound_m;
}

// How far a place on the circuit is inside of the nearer bound; below 0 outside. `across_m`: from the row's centroid,
// to the left of psi_REF. `right_m`, `left_m`: how far the bounds are moved inside. Large where the row has no bounds.
inline float measure_inside(const ClusterPlaceTable& places, int32_t row, float across_m, float right_m = 0.0f,
                            float left_m = 0.0f) noexcept {
  const float d_m = places.d_m[row] + across_m;
  return std::min(places.width_left_m[row] - left_m - d_m, d_m + places.width_right_m[row] - right_m);
}

// Where the centre of a car of known size lies, by what a sensor at (sensor_1, sensor_2) sees of it; all on the axes of
// its heading.
//   along   both ends seen: the middle. From behind: the rear end plus half a length. From ahead: the front end minus
//           half a length if at least front_length is seen, because the flat nose of a distant car returns no points;
//           else the middle of what is seen
//   across  the middle of what is seen; from the side, or from less than a length beside its ends: the near flank plus
//           half a width, if most of the flank is seen
// An end that the edge of the field of view cuts off is not seen: then the other one, if the sensor sees it or the
// flank, minus or plus half a length; else the middle. Instead of a side that is cut off the other one counts.
struct CarAnchor {
  float center_1, center_2;
  CarView view;
  float unseen_1, unseen_2;   // length and width not seen; unseen_1 is 0 at a known end, but not beside the sensor
  bool knows_no_end = false;  // along: both may be cut off
};
struct CutEnds {
  bool low_1 = false, high_1 = false, low_2 = false, high_2 = false;
};
struct CarSize {
  float length_m, width_m, front_length_m;
};
CarAnchor anchor_car(const CarSize& size, const OrientedBox& seen, float sensor_1, float sensor_2,
                     const CutEnds& cut = {}) noexcept;

}  // namespace overtake
