/* Copyright 2026 The Overtake authors
 * SPDX-License-Identifier: Apache-2.0
 *
 * One LiDAR 1.2 m above a level road, and the rear of a car ahead, 1.9 x 1.2 m; one beam per pixel.
 */
#ifndef OVERTAKE_SMALL_SCENE_H
#define OVERTAKE_SMALL_SCENE_H

#include <math.h>
#include <stdint.h>

enum { SCENE_ROWS = 32, SCENE_COLS = 857 };
static struct scene_point {
  float x, y, z;
  uint16_t layer, unused;
} cloud[SCENE_ROWS * SCENE_COLS];

/* Fills `cloud`; returns the number of points. */
static int32_t look(double ahead_m) {
  int32_t count = 0;
  for (int r = 0; r < SCENE_ROWS; ++r)
    for (int c = 0; c < SCENE_COLS; ++c) {
      const double elevation = 0.0873 - 0.0108 * r, azimuth = 1.0472 - 0.0024438 * (c + 0.5);
      const double up = tan(elevation), left = tan(azimuth);
      const int on_car = fabs(ahead_m * left) < 0.95 && fabs(ahead_m * up / cos(azimuth) + 0.6) < 0.6;
      const double x = on_car ? ahead_m : up < -0.01 ? -1.2 / up * cos(azimuth) : 0;
      if (x <= 0 || x > 150) continue;
      cloud[count].x = (float)x;
      cloud[count].y = (float)(x * left);
      cloud[count].z = (float)(x * up / cos(azimuth));
      cloud[count++].layer = (uint16_t)r;
    }
  return count;
}

#endif
