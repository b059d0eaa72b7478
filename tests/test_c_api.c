/* Copyright 2026 The Overtake authors
 * SPDX-License-Identifier: Apache-2.0
 *
 * The library from plain C, and the README's example: one LiDAR sees a car ahead for a second.
 */
#include <math.h>
#include <stdio.h>

#include "pipeline/overtake.h"

enum { ROWS = 32, COLS = 857 };
static struct point { float x, y, z; uint16_t layer, unused; } cloud[ROWS * COLS];

/* One beam a pixel, from 1.2 m above a level road: onto the road or the tail of a car `ahead_m` ahead, 1.9 x 1.2 m. */
static int32_t look(double ahead_m) {
  int32_t count = 0;
  for (int r = 0; r < ROWS; ++r)
    for (int c = 0; c < COLS; ++c) {
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

/* README begin */
int main(void) {
  ovt_sensor_def sensor = ovt_default_sensor_def();          /* 32 x 857 pixels over 120 degrees, looking ahead */
  sensor.z_m = 1.2;
  ovt_detector_def def = ovt_default_detector_def();
  def.sensors = &sensor;
  def.sensor_count = 1;
  ovt_detector* detector;
  ovt_reader* reader;
  if (ovt_create_detector(&def, &detector) || ovt_create_reader(detector, &reader)) return 1;

  ovt_tracks tracks = {0};
  for (int k = 0; k < 20; ++k) {                             /* 20 scans, 50 ms apart: the car drives away at 10 m/s */
    ovt_points scan;
    ovt_points_init(&scan, sizeof scan);
    scan.stamp_ns = k * INT64_C(50000000);
    scan.count = look(20.0 + 0.5 * k);
    scan.x = (ovt_column){&cloud->x, sizeof cloud, sizeof *cloud, OVT_F32};
    scan.y = (ovt_column){&cloud->y, sizeof cloud - 4, sizeof *cloud, OVT_F32};
    scan.z = (ovt_column){&cloud->z, sizeof cloud - 8, sizeof *cloud, OVT_F32};
    scan.layer = (ovt_column){&cloud->layer, sizeof cloud - 12, sizeof *cloud, OVT_U16};
    if (ovt_push_scan(detector, &scan) || ovt_next_frame(reader, NULL)) return 1;
    if (ovt_read_tracks(reader, OVT_AT_FRAME_STAMP, &tracks)) return 1;
    for (int i = 0; i < tracks.count; ++i)
      printf("%3d ms  %s  x %5.2f m  y %5.2f m  %5.2f m/s\n", 50 * k,
             tracks.state[i] == OVT_CONFIRMED ? "confirmed" : "tentative", tracks.x_m[i], tracks.y_m[i],
             tracks.speed_mps[i]);
  }
  const int good = tracks.count == 1 && tracks.state[0] == OVT_CONFIRMED && fabs(tracks.speed_mps[0] - 10) < 1;
  ovt_destroy_reader(reader);
  ovt_destroy_detector(detector);
  return good ? 0 : 1;
}
/* README end */
