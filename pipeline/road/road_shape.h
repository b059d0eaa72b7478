// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// The shape of a road whose heights are not known, fitted to the ground of one scan.
#pragma once

#include <algorithm>

#include "core/math.h"
#include "core/plane.h"
#include "core/sensor_model.h"
#include "kernels/running_ground.h"

namespace overtake {

// The vehicle's axes in the map and the sensor's axes in the vehicle, in float.
struct RoadAxes {
  float map[9];
  Transform mounting;
  float to_sensor_z(float vehicle_z, float x, float y) const noexcept {  // x, y in the sensor's axes
    return (vehicle_z - mounting.t[2] - mounting.r[6] * x - mounting.r[7] * y) / mounting.r[8];
  }
};

// The shape of a road that is not known, in the vehicle frame: z = a + b x + c n + q x^2 + e x n with n the distance
// from the vehicle's lane, which bends by `curvature`. Beyond kBend_m it goes on straight, beyond kLane_m it is as at
// the edge. Where heights are known, a map has banking, or ego poses tell the own way, this is the difference to the
// road that they let expect: z = base + twist n, n no farther to either side than the edges of the bank. Beside it the
// ground does not twist with it.
constexpr int32_t kTerms = 5;

// The road that is expected at places of the vehicle's lane.
struct ExpectedRoad {
  static constexpr int32_t kPlaces = 37;
  static constexpr float kFirst_m = -80.0f, kStep_m = 5.0f;  // x of the places
  // What tells it. kNone: a level plane, and the rest is not valid. kLearned: its heights are known, so what the scan
  // differs from them is a plane, an error of the sensor's mounting or of the ego pose.
  enum class Source : int8_t { kNone, kWay, kMap, kLearned } source = Source::kNone;
  float from_m = -1e9f, to_m = 1e9f;  // ground at these x counts; kLearned: where heights are known
  double left_m = 0, right_m = 0;     // from the vehicle to these edges, at least 0
  float base_m[kPlaces], twist[kPlaces];

  struct At {
    double base_m, twist;
  };
  // Between two places; beyond the last ones straight on, with their twist.
  At at(double x) const noexcept {
    const double place = (x - double(kFirst_m)) * double(1.0f / kStep_m);
    const int32_t i = int32_t(place > 0.0 ? (place < kPlaces - 2 ? place : kPlaces - 2) : 0.0);
    const double t = place - i, within = t < 0.0 ? 0.0 : t > 1.0 ? 1.0 : t;
    return {double(base_m[i]) + t * double(base_m[i + 1] - base_m[i]),
            double(twist[i]) + within * double(twist[i + 1] - twist[i])};
  }
};

// Two doubles side by side, for the shape. Compilers make the baseline's vectors of it; the results are those of
// double.
struct Two {
  using Values = double __attribute__((vector_size(16)));
  using Bits = int64_t __attribute__((vector_size(16)));
  Values v;
  explicit Two(double all) : v{all, all} {}
  Two(double first, double second) : v{first, second} {}
  explicit Two(const float* at) : v{double(at[0]), double(at[1])} {}
  friend Two operator+(Two a, Two b) { return Two(a.v + b.v); }
  friend Two operator-(Two a, Two b) { return Two(a.v - b.v); }
  friend Two operator*(Two a, Two b) { return Two(a.v * b.v); }
  friend Bits operator<(Two a, Two b) { return a.v < b.v; }
  friend Bits operator>(Two a, Two b) { return a.v > b.v; }
  friend Two select(Bits mask, Two yes, Two no) { return Two(mask ? yes.v : no.v); }
  void store(float* at) const { at[0] = float(v[0]), at[1] = float(v[1]); }

 private:
  explicit Two(Values values) : v(values) {}
};
struct RoadShape {
  double term[kTerms] = {};  // a, b, c, q, e
  double curvature = 0;
  ExpectedRoad expected;

  static constexpr double kBend_m = 100.0, kLane_m = 12.0;
  // V: double, or several of them side by side.
  template <class V>
  static V limited(V v, double most) noexcept {
    const V low = select(v < V(-most), V(-most), v);
    return select(low > V(most), V(most), low);
  }
  template <class V>
  V lane_offset(V x, V y) const noexcept {
    const V near = limited(x, kBend_m);
    return y - V(0.5 * curvature) * near * (V(2.0) * x - near);
  }
  // From the expected road.
  template <class V>
  V difference_at(V x, V lane_offset_m) const noexcept {
    const V near = limited(x, kBend_m), n = limited(lane_offset_m, kLane_m);
    return V(term[0]) + V(term[1]) * x + V(term[2]) * n + V(term[3]) * near * (V(2.0) * x - near) +
           V(term[4]) * near * n;
  }
  template <class V>
  V height_at(V x, V lane_offset_m) const noexcept {
    return difference_at(x, lane_offset_m) + expected_at(x, lane_offset_m);
  }
  double height(double x, double y) const noexcept { return height_at(x, lane_offset(x, y)); }
  double expected_at(double x, double lane_offset_m) const noexcept {
    if (expected.source == ExpectedRoad::Source::kNone) return 0.0;
    const ExpectedRoad::At at = expected.at(x);
    return at.base_m + at.twist * std::clamp(lane_offset_m, -expected.right_m, expected.left_m);
  }
  Two expected_at(Two x, Two lane_offset_m) const noexcept {
    return {expected_at(x.v[0], lane_offset_m.v[0]), expected_at(x.v[1], lane_offset_m.v[1])};
  }
};

// Fits the shape to the scan's own ground, from near to far. A scan with too little ground leaves it as it is.
void fit_road(const RunningGroundParams& params, const RoadAxes& axes, const SensorModel& sensor,
              Plane<const float> range_m, Plane<const float> elevation_rad, RoadShape& shape) noexcept;

}  // namespace overtake
