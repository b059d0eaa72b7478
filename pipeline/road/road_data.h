// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// What the segmentation of one scan knows about the road: the ego pose at the scan's stamp, and the learned heights of
// the centre line around it. The intake copies it into the frame, so the segmentation reads nothing that changes.
#pragma once

#include <cstdint>

#include "core/circuit_map.h"
#include "pipeline/ego_buffer.h"

namespace overtake {

struct RoadData {
  static constexpr int32_t kStations = 69;   // along the centre line, the ego vehicle in the middle
  static constexpr double kStation_m = 5.0;  // between two stations

  bool has_pose = false;            // else the rest is not valid
  EgoState ego;                     // at the scan's stamp
  const CircuitMap* map = nullptr;  // null: none, or the ego pose is not on it; then the rest is not valid
  double s_m = 0, d_m = 0;          // ego pose on the map
  double curvature_per_m = 0;       // of the map's line, in its direction
  bool faces_along = true;          // the ego vehicle faces in the direction of the line, else against it
  // Heights relative to the ego vehicle's rear axle, which stands on the road, and tangents of the cross slope
  // (positive: the right side is higher). Station k is at s_m + (k - kStations / 2) * kStation_m.
  // Where the map has banking, stations that are not known have expected values.
  bool known[kStations] = {};
  bool has_expected = false;
  float height_m[kStations] = {}, cross_slope[kStations] = {};

  // Without a map: where the vehicle drove, behind it and in its frame, from near to far.
  static constexpr int32_t kWay = 24;
  struct WayPlace {
    float x_m, y_m, z_m;
    float slope;  // tangent of the cross slope (positive: the left side is higher)
  };
  int32_t way_count = 0;
  WayPlace way[kWay] = {};
};

}  // namespace overtake
