/* Copyright 2026 The Overtake authors
 * SPDX-License-Identifier: Apache-2.0
 *
 * The library from plain C99: the README's example, word for word. One LiDAR sees a car drive away for a second.
 */
/* README begin */
#include <math.h>
#include <overtake/overtake.h>
#include <stdio.h>

typedef struct point {
  float x, y, z;
  uint16_t layer;
} point;
static point cloud[32 * 857];

/* Yours come from a driver. Here: the road under a LiDAR and the tail of a car so far ahead; how many points. */
static int look(double ahead_m) {
  int count = 0;
  for (int r = 0; r < 32; ++r)
    for (int c = 0; c < 857; ++c) {
      const double azimuth = 1.0472 - 0.0024438 * (c + 0.5), left = tan(azimuth);
      const double up = tan(0.0873 - 0.0108 * r) / cos(azimuth);
      const int on_car = fabs(ahead_m * left) < 0.95 && fabs(ahead_m * up + 0.6) < 0.6;
      const double x = on_car ? ahead_m : up < -0.01 ? -1.2 / up : 0;
      if (x <= 0 || x > 150) continue;
      const point p = {(float)x, (float)(x * left), (float)(x * up), (uint16_t)r};
      cloud[count++] = p;
    }
  return count;
}

int main(void) {
  ovt_sensor_def sensor = ovt_default_sensor_def(); /* 32 x 857 pixels over 120 degrees, looking ahead */
  sensor.z_m = 1.2;
  ovt_detector_def def = ovt_default_detector_def();
  def.sensors = &sensor;
  def.sensor_count = 1;
  ovt_detector* detector;
  ovt_reader* reader;
  if (ovt_create_detector(&def, &detector) || ovt_create_reader(detector, &reader)) return 1;
  ovt_tracks tracks = {0};
  for (int k = 0; k < 20; ++k) { /* 20 scans, 50 ms apart; ovt_push_ego_pose would put the tracks into the map */
    ovt_points scan;
    ovt_points_init(&scan, sizeof scan);
    scan.stamp_ns = k * INT64_C(50000000);
    scan.count = look(20.0 + 0.5 * k);
    scan.x = OVT_FIELD(cloud, scan.count, x, OVT_F32);
    scan.y = OVT_FIELD(cloud, scan.count, y, OVT_F32);
    scan.z = OVT_FIELD(cloud, scan.count, z, OVT_F32);
    scan.layer = OVT_FIELD(cloud, scan.count, layer, OVT_U16);
    if (ovt_push_scan(detector, &scan) || ovt_next_frame(reader, NULL)) return 1;
    if (ovt_read_tracks(reader, OVT_AT_FRAME_STAMP, &tracks)) return 1;
    for (int i = 0; i < tracks.count; ++i) printf("x %5.2f m  %5.2f m/s\n", tracks.x_m[i], tracks.speed_mps[i]);
  }
  const int good = tracks.count == 1 && tracks.state[0] == OVT_CONFIRMED && fabs(tracks.speed_mps[0] - 10) < 1;
  ovt_destroy_reader(reader);
  ovt_destroy_detector(detector);
  return good ? 0 : 1;
}
/* README end */
