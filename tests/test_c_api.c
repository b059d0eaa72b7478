/* Copyright 2026 The Overtake authors
 * SPDX-License-Identifier: Apache-2.0
 *
 * The library from plain C99: the README's example, word for word. One LiDAR sees a car drive away for a second.
 * test_c_api.sh checks the output.
 */
/* clang-format off */
#pragma GCC diagnostic ignored "-Wconversion"  /* an example, short */
/* README begin */
#include <overtake/overtake.h>
#include <stdio.h>
struct point { float x, y, z; unsigned short ring; } cloud[360]; /* yours comes from a driver */
int main(void) {
  ovt_sensor_def sensor = ovt_default_sensor_def(); /* 32 x 857 pixels over 120 degrees, looking ahead */
  sensor.z_m = 1.2; /* over the road */
  ovt_params params;
  ovt_params_init(&params, sizeof params, "best");
  ovt_detector_def def = ovt_default_detector_def();
  def.sensors = &sensor, def.sensor_count = 1, def.params = &params;
  ovt_detector* detector; ovt_reader* reader; ovt_tracks tracks = {0};
  if (ovt_create_detector(&def, &detector) || ovt_create_reader(detector, &reader)) return 1;
  ovt_points scan = ovt_default_points();
  scan.count = 360, scan.x = OVT_FIELD(cloud, 360, x, OVT_F32), scan.y = OVT_FIELD(cloud, 360, y, OVT_F32);
  scan.z = OVT_FIELD(cloud, 360, z, OVT_F32), scan.layer = OVT_FIELD(cloud, 360, ring, OVT_U16);
  for (float x = 20; x < 30; x += 0.5f, scan.stamp_ns += 50000000) { /* 20 scans of a car's tail at 10 m/s */
    for (int i = 0; i < 360; ++i) cloud[i] = (struct point){x, 0.04f * (i % 45) - 0.9f, -0.13f * (i / 45), 8 + i / 45};
    if (ovt_push_scan(detector, &scan) || ovt_next_frame(reader, NULL)) return 1;
    if (ovt_read_tracks(reader, OVT_AT_FRAME_STAMP, &tracks)) return 1;
    for (int i = 0; i < tracks.count; ++i) printf("x %5.2f m  %5.2f m/s\n", tracks.x_m[i], tracks.speed_mps[i]);
  }
  ovt_destroy_reader(reader), ovt_destroy_detector(detector);
}
/* README end */
