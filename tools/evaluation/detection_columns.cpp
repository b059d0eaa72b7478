// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
#include "tools/evaluation/detection_columns.h"

#include "tools/evaluation/metrics/consistency.h"
#include "tools/evaluation/numbers.h"
#include "tools/sim/material.h"

namespace overtake::evaluation {

double height_of(const ovt_detections& d, int32_t row) { return double(d.road_z_m ? d.road_z_m[row] : d.z_m[row]); }

io::EgoRow corrected(io::EgoRow pose, const ovt_frame_info& info) {
  pose.yaw_rad += info.ego_heading_offset_rad;
  return pose;
}

io::EgoRow corrected(io::EgoRow pose, const ovt_frame_info& info, const ovt_detections& d, int32_t row) {
  if (!d.ego_offset_rad) return corrected(pose, info);
  pose.yaw_rad += double(d.ego_offset_rad[row]);
  return pose;
}

MapPlace place_in_map(const std::vector<PublishedPose>& poses, const ovt_frame_info& info, const ovt_detections& d,
                      int32_t row) {
  return place_in_map(corrected(pose_at(poses, d.stamp_ns[row]), info, d, row), d, row);
}

MapPlace place_in_map(const io::EgoRow& pose, const ovt_detections& d, int32_t row) {
  return to_map(pose, double(d.x_m[row]), double(d.y_m[row]), height_of(d, row), double(d.heading_rad[row]));
}

bool is_debris(const ovt_detections& d, int32_t row) {
  return d.object_class && d.object_class[row] == OVT_CLASS_DEBRIS;
}

bool is_on_obstacle(const ovt_detections& d, int32_t row, int32_t surface) {
  if (surface == int32_t(sim::Surface::parked_vehicle)) return !is_debris(d, row);
  return surface == int32_t(sim::Surface::debris) && d.object_class && d.object_class[row] == OVT_CLASS_UNKNOWN;
}

void note_parked(const ovt_tracks& t, const ovt_detections& d,
                 const std::function<int32_t(int32_t cluster)>& surface_of, std::set<uint64_t>& parked) {
  for (int32_t i = 0; i < t.count && d.cluster; ++i) {
    const int32_t row = t.detection[i];
    if (row < 0 || row >= d.count) continue;  // it stays where its last detection was
    if (surface_of(d.cluster[row]) == int32_t(sim::Surface::parked_vehicle) && !is_debris(d, row))
      parked.insert(t.id[i]);
    else
      parked.erase(t.id[i]);
  }
}

double square_of(const ovt_detections& d, int32_t row, const io::Rotation& vehicle, double x_map_m, double y_map_m) {
  if (!d.var_x || !d.var_y || !d.cov_xy) return kNan;
  const auto &ahead = vehicle[0], &left = vehicle[1];
  const double det = ahead[0] * left[1] - ahead[1] * left[0];
  const double error[2] = {(x_map_m * left[1] - y_map_m * left[0]) / det,
                           (y_map_m * ahead[0] - x_map_m * ahead[1]) / det};
  const double lower[3] = {double(d.var_x[row]), double(d.cov_xy[row]), double(d.var_y[row])};
  return metrics::normalized_square(error, lower, 2);
}

std::array<double, 3> covariance_in_map(const ovt_detections& d, int32_t row, const io::Rotation& vehicle) {
  if (!d.var_x || !d.var_y || !d.cov_xy) return {kNan, kNan, kNan};
  const double xx = double(d.var_x[row]), xy = double(d.cov_xy[row]), yy = double(d.var_y[row]);
  const auto &a = vehicle[0], &l = vehicle[1];
  return {a[0] * a[0] * xx + 2 * a[0] * l[0] * xy + l[0] * l[0] * yy,
          a[0] * a[1] * xx + (a[0] * l[1] + a[1] * l[0]) * xy + l[0] * l[1] * yy,
          a[1] * a[1] * xx + 2 * a[1] * l[1] * xy + l[1] * l[1] * yy};
}

}  // namespace overtake::evaluation
