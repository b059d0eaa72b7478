// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
#include "kernels/fit_road.h"
#include "kernels/fit_road_pass.h"

namespace overtake::ref {

void fit_road(const RunningGroundParams& params, const RoadAxes& axes, const SensorModel& sensor,
              Plane<const float> range_m, Plane<const float> elevation_rad, RoadShape& shape) noexcept {
  const FitColumns columns(sensor, shape);
  RoadPoints points;
  for (const FitPass& pass : kFitPasses) {
    if (fits_plane(shape) && !pass.of_plane) continue;
    const GroundBlock block = make_fit_block(params, pass);
    points.clear();
    for (int32_t k = 0; k < columns.count; ++k) {
      float sine, cosine;
      sin_cos_f32(azimuth_of(sensor, columns[k]), sine, cosine);
      GroundState<float> state = start_walk<float>(axes, shape);
      for (int32_t r = range_m.rows - 1; r >= 0; --r) {
        const float range = range_m.row(r)[columns[k]];
        const RoadPixel<float> p = place_pixel(axes, shape, range, elevation_rad.row(r)[columns[k]], sine, cosine);
        if (walk_pixel(block, axes, shape, pass.reach_m, p, range > 0.0f, state)) points.add(p.x, p.n, p.above_m);
      }
    }
    if (!fit_shape(points, pass.trim_m, shape)) return;
  }
}

}  // namespace overtake::ref
