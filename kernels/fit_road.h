// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// Section 5b of kernels/README.md: the shape of a road whose heights are not known, fitted to the ground of one scan.
#pragma once

#include "core/math.h"
#include "core/plane.h"
#include "core/sensor_model.h"
#include "kernels/running_ground.h"

namespace overtake {

// The vehicle's axes in the map and the sensor's axes in the vehicle.
struct RoadAxes {
  float map[9];
  Transform mounting;
  float to_sensor_z(float vehicle_z, float x, float y) const noexcept {  // x, y in the sensor's axes
    return (vehicle_z - mounting.t[2] - mounting.r[6] * x - mounting.r[7] * y) / mounting.r[8];
  }
};

// The road that is expected at places of the vehicle's lane.
struct ExpectedRoad {
  static constexpr int32_t kPlaces = 37;
  static constexpr float kFirst_m = -80.0f, kStep_m = 5.0f;  // x of the places
  // What tells it. kNone: a level plane, and the rest is not valid. kLearned: its heights are known, so what the scan
  // differs from them is a plane, an error of the sensor's mounting or of the ego pose.
  enum class Source : int8_t { kNone, kWay, kMap, kLearned } source = Source::kNone;
  float from_m = -1e9f, to_m = 1e9f;  // ground at these x counts; kLearned: where heights are known
  float left_m = 0, right_m = 0;      // from the vehicle to these edges, at least 0
  float base_m[kPlaces], twist[kPlaces];
};

// The shape of a road that is not known, in the vehicle frame: z = a + b x + c n + q x^2 + e x n with n the distance
// from the vehicle's lane, which bends by `curvature`. Beyond kBend_m it goes on straight, beyond kLane_m it is as at
// the edge. Where heights are known, a map has banking, or ego poses tell the own way, this is the difference to the
// road that they let expect: z = base + twist n, n no farther to either side than the edges of the bank. Beside it the
// ground does not twist with it. V: float or a vector of floats.
struct RoadShape {
  static constexpr int32_t kTerms = 5;
  float term[kTerms] = {};  // a, b, c, q, e
  float curvature = 0;
  ExpectedRoad expected;

  static constexpr float kBend_m = 100.0f, kLane_m = 12.0f;
  template <class V>
  OVT_INLINE static V limited(V v, V least, V most) noexcept {
    return max_of(min_of(v, most), least);
  }
  template <class V>
  OVT_INLINE V lane_offset(V x, V y) const noexcept {
    const V near = limited(x, V(-kBend_m), V(kBend_m));
    return y - V(0.5f * curvature) * near * (V(2.0f) * x - near);
  }
  // From the expected road.
  template <class V>
  OVT_INLINE V difference_at(V x, V lane_offset_m) const noexcept {
    const V near = limited(x, V(-kBend_m), V(kBend_m)), n = limited(lane_offset_m, V(-kLane_m), V(kLane_m));
    return V(term[0]) + V(term[1]) * x + V(term[2]) * n + V(term[3]) * near * (V(2.0f) * x - near) +
           V(term[4]) * near * n;
  }
  // Between two places; beyond the last ones straight on, with their twist.
  template <class V>
  OVT_INLINE V expected_at(V x, V lane_offset_m) const noexcept {
    if (expected.source == ExpectedRoad::Source::kNone) return V(0.0f);
    const V place = (x - V(ExpectedRoad::kFirst_m)) * V(1.0f / ExpectedRoad::kStep_m);
    const auto i = to_int(limited(place, V(0.0f), V(float(ExpectedRoad::kPlaces - 2))));
    const V t = place - to_float(i), within = limited(t, V(0.0f), V(1.0f));
    const V base = gather(expected.base_m, i), twist = gather(expected.twist, i);
    return base + t * (gather(expected.base_m + 1, i) - base) +
           (twist + within * (gather(expected.twist + 1, i) - twist)) *
               limited(lane_offset_m, V(-expected.right_m), V(expected.left_m));
  }
  template <class V>
  OVT_INLINE V height_at(V x, V lane_offset_m) const noexcept {
    return difference_at(x, lane_offset_m) + expected_at(x, lane_offset_m);
  }
};

// Fits the terms of the shape to the scan's own ground near the vehicle's lane, from near to far. Each pass walks up
// some columns like running_ground, over the shape so far, and fits the terms to the ground that it finds.
//   reads    range_m elevation_rad; axes, sensor: the image's; shape: its lane and its expected road
//   writes   shape.term; a scan with too little ground leaves it as it is
//   cost     20 columns x rows (12 where heights are known), and 2 or 3 walks over them     agrees   exactly
namespace ref {
void fit_road(const RunningGroundParams& params, const RoadAxes& axes, const SensorModel& sensor,
              Plane<const float> range_m, Plane<const float> elevation_rad, RoadShape& shape) noexcept;
}

}  // namespace overtake
