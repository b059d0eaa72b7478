// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// Ground removal by height.
#include "kernels/keep_above_road.h"

#include "core/math.h"

namespace overtake::ref {

void keep_above_road(const Transform& T_vehicle_sensor, Plane<const float> range_filled_m,
                     Plane<const float> elevation_filled_rad, Plane<float> range_repaired_m,
                     Plane<float> elevation_repaired_rad, BitPlane nonground_repaired) noexcept {
  const float sensor_height_m = T_vehicle_sensor.t[2];
  for (int32_t r = 0; r < range_filled_m.rows; ++r) {
    nonground_repaired.clear_row(r);
    for (int32_t c = 0; c < range_filled_m.cols; ++c) {
      const float range = range_filled_m.row(r)[c], elevation = elevation_filled_rad.row(r)[c];
      float sine, cosine;
      sin_cos_small_f32(elevation, sine, cosine);
      const bool keep = range > 0.0f && sensor_height_m + range * sine > kRoadHeight_m;
      range_repaired_m.row(r)[c] = keep ? range : 0.0f;
      elevation_repaired_rad.row(r)[c] = keep ? elevation : 0.0f;
      if (keep) nonground_repaired.set(r, c);
    }
  }
}

}  // namespace overtake::ref
