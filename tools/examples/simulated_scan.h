/* Copyright 2026 The Overtake authors
 * SPDX-License-Identifier: Apache-2.0
 *
 * What stands in for a LiDAR in these examples: 32 layers of 600 beams over 120 degrees, 1.2 m above a level road, with
 * the box-shaped tail of a car ahead. Your driver's points go where these come from. C99 and C++.
 */
#ifndef SIMULATED_SCAN_H
#define SIMULATED_SCAN_H

#include <math.h>
#include <stdint.h>

enum { SCAN_LAYERS = 32, SCAN_BEAMS = 600, SCAN_CAPACITY = SCAN_LAYERS * SCAN_BEAMS };

/* One return, as many drivers lay it out. */
typedef struct scan_point {
  float x, y, z, intensity;
  uint16_t layer;
} scan_point;

/* Fills `points` (SCAN_CAPACITY of them) with what a sensor sees that is turned left by yaw_rad, when the tail of a car
 * (1.9 m wide, 1.1 m high, facing the rear) is car_x_m ahead and car_y_m to the left of it. Returns their number. */
static inline int32_t simulate_scan(scan_point* points, double yaw_rad, double car_x_m, double car_y_m) {
  const double sensor_height_m = 1.2, car_low_m = -1.15, car_high_m = -0.1;
  int32_t count = 0;
  for (int32_t layer = 0; layer < SCAN_LAYERS; ++layer) {
    const double rise = tan((5.0 - 0.6 * layer) * 3.14159265358979 / 180.0);
    for (int32_t beam = 0; beam < SCAN_BEAMS; ++beam) {
      const double azimuth_rad = (60.0 - 0.2 * (beam + 0.5)) * 3.14159265358979 / 180.0;
      const double ahead = cos(azimuth_rad + yaw_rad), left = sin(azimuth_rad + yaw_rad);
      double range_m = rise < 0 ? -sensor_height_m / rise : 0; /* to the road, along the ground */
      const double to_car_m = ahead > 0.1 ? car_x_m / ahead : 0;
      const int hits_car = to_car_m > 0 && (range_m == 0 || to_car_m < range_m) &&
                           fabs(to_car_m * left - car_y_m) < 0.95 && to_car_m * rise > car_low_m &&
                           to_car_m * rise < car_high_m;
      if (hits_car) range_m = to_car_m;
      if (range_m < 1 || range_m > 120) continue;
      scan_point* point = &points[count++];
      point->x = (float)(range_m * cos(azimuth_rad));
      point->y = (float)(range_m * sin(azimuth_rad));
      point->z = (float)(range_m * rise);
      point->intensity = hits_car ? 80.0f : 20.0f;
      point->layer = (uint16_t)layer;
    }
  }
  return count;
}

#endif
