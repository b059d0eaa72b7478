/* Copyright 2026 The Overtake authors
 * SPDX-License-Identifier: Apache-2.0
 *
 * The library from plain C99: the README's example, word for word. One LiDAR sees a car drive away for a second.
 * test_c_api.sh looks at what it prints.
 */
/* clang-format off */
/* README begin */
#include <overtake/overtake.h>
#include <stdio.h>

struct point { float x, y, z; unsigned short ring; } cloud[360]; /* yours comes from a driver */

int main(void) {
  ovt_sensor_def sensor = ovt_default_sensor_def(); /* 32 x 857 pixels over 120 degrees, looking ahead */
  ovt_detector_def def = ovt_default_detector_def();
  def.sensors = &sensor, def.sensor_count = 1;
  ovt_detector* detector;
  ovt_reader* reader;
  ovt_tracks tracks = {0};
  if (ovt_create_detector(&def, &detector) || ovt_create_reader(detector, &reader)) return 1;
  for (int k = 0; k < 20; ++k) { /* 20 scans, 50 ms apart: the tail of a car that drives away at 10 m/s */
    for (int i = 0; i < 360; ++i) {
      const float x = 20 + 0.5f * (float)k, left = 0.04f * (float)(i % 45) - 0.9f, up = 0.0108f * (float)(i / 45);
      cloud[i] = (struct point){x, left, x * (0.0f - up), (unsigned short)(8 + i / 45)};
    }
    ovt_points scan;
    ovt_points_init(&scan, sizeof scan);
    scan.count = 360, scan.stamp_ns = k * INT64_C(50000000);
    scan.x = OVT_FIELD(cloud, 360, x, OVT_F32), scan.y = OVT_FIELD(cloud, 360, y, OVT_F32);
    scan.z = OVT_FIELD(cloud, 360, z, OVT_F32), scan.layer = OVT_FIELD(cloud, 360, ring, OVT_U16);
    if (ovt_push_scan(detector, &scan) || ovt_next_frame(reader, NULL)) return 1;
    if (ovt_read_tracks(reader, OVT_AT_FRAME_STAMP, &tracks)) return 1;
    for (int i = 0; i < tracks.count; ++i) printf("x %5.2f m  %5.2f m/s\n", tracks.x_m[i], tracks.speed_mps[i]);
  }
  ovt_destroy_reader(reader);
  ovt_destroy_detector(detector);
}
/* README end */
