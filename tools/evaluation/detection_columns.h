// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// Columns of ovt_detections and values of ovt_frame_info that only some methods compute: null or 0 otherwise.
#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <set>
#include <vector>

#include "pipeline/overtake.h"
#include "tools/evaluation/places.h"

namespace overtake::evaluation {

// The height that a detection's centre is taken to the map at: that of the road under the object, else that of its
// points; vehicle frame.
double height_of(const ovt_detections& detections, int32_t row);
// The pose with the error of its heading that the method has found, if any.
io::EgoRow corrected(io::EgoRow pose, const ovt_frame_info& info);
// The same for one detection: the offset at its own stamp, of its own sensor, if the method publishes it.
io::EgoRow corrected(io::EgoRow pose, const ovt_frame_info& info, const ovt_detections& detections, int32_t row);
// A detection in the map, as the method takes it there: by the corrected pose, at the height of the road.
MapPlace place_in_map(const std::vector<PublishedPose>& poses, const ovt_frame_info& info,
                      const ovt_detections& detections, int32_t row);
MapPlace place_in_map(const io::EgoRow& pose, const ovt_detections& detections, int32_t row);
bool is_debris(const ovt_detections& detections, int32_t row);
// Whether an obstacle that the truth does not list among the cars is there, so that a detection at no car is not false:
// debris and a detection of class unknown, or a parked vehicle and a detection of another class than debris. `surface`:
// that of most of its points.
bool is_on_obstacle(const ovt_detections& detections, int32_t row, int32_t surface);
// Keeps `parked` the tracks that are on a parked vehicle: most points of their last detection lie on one, and it is not
// of class debris. `surface_of`: that of most points of a cluster.
void note_parked(const ovt_tracks& tracks, const ovt_detections& detections,
                 const std::function<int32_t(int32_t cluster)>& surface_of, std::set<uint64_t>& parked);
// The square of a centre's error in units of its published covariance; NaN without one. The error is level, in the map;
// the covariance is in the plane of the vehicle with the given axes.
double square_of(const ovt_detections& detections, int32_t row, const io::Rotation& vehicle, double x_map_m,
                 double y_map_m);

// The published covariance of a centre in the map, for a vehicle with the given axes: xx, xy, yy. NaN without one.
std::array<double, 3> covariance_in_map(const ovt_detections& detections, int32_t row, const io::Rotation& vehicle);

}  // namespace overtake::evaluation
