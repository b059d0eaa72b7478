/* Copyright 2026 The Overtake authors
 * SPDX-License-Identifier: Apache-2.0
 *
 * The library from plain C99: the README's example, word for word. One LiDAR sees a car drive away for a second.
 */
/* README begin */
#include <stdio.h>

#include "pipeline/overtake.h"
#include "tests/support/small_scene.h" /* cloud[], look(): a simulated scan with a car so far ahead */

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
    scan.x = (ovt_column){&cloud->x, sizeof cloud, sizeof *cloud, OVT_F32};
    scan.y = (ovt_column){&cloud->y, sizeof cloud - 4, sizeof *cloud, OVT_F32};
    scan.z = (ovt_column){&cloud->z, sizeof cloud - 8, sizeof *cloud, OVT_F32};
    scan.layer = (ovt_column){&cloud->layer, sizeof cloud - 12, sizeof *cloud, OVT_U16};
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
