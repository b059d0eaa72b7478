/* Copyright 2026 The Overtake authors
 * SPDX-License-Identifier: Apache-2.0
 *
 * The smallest use: one sensor, no threads, tracks polled after every scan. A car 20 m ahead pulls away at 10 m/s.
 * With worker_count 1 everything below happens in this thread: when ovt_push_scan returns, the frame is finished.
 * Exit code 0 when the car was found and its speed is right.
 */
#include <overtake/overtake.h>
#include <stdio.h>

#include "simulated_scan.h"

static scan_point points[SCAN_CAPACITY];

int main(void) {
  ovt_sensor_def sensor = ovt_default_sensor_def();
  sensor.z_m = 1.2;
  sensor.cols = SCAN_BEAMS;
  ovt_params params;
  if (ovt_params_init(&params, sizeof params, "best") != OVT_OK) return 1;
  ovt_detector_def def = ovt_default_detector_def();
  def.params = &params;
  def.sensors = &sensor;
  def.sensor_count = 1;
  def.worker_count = 1;

  char error[256];
  ovt_detector* detector = NULL;
  ovt_reader* reader = NULL;
  if (ovt_create_detector_verbose(&def, &detector, error, sizeof error) != OVT_OK) {
    fprintf(stderr, "poll_tracks: %s\n", error);
    return 1;
  }
  int found = 0;
  ovt_status status = ovt_create_reader(detector, &reader);
  for (int k = 0; status == OVT_OK && k < 40; ++k) {
    ovt_points scan;
    ovt_points_init(&scan, sizeof scan);
    scan.stamp_ns = k * INT64_C(50000000);
    scan.count = simulate_scan(points, 0.0, 20.0 + 0.5 * k, 0.0);
    scan.x = OVT_FIELD(points, scan.count, x, OVT_F32);
    scan.y = OVT_FIELD(points, scan.count, y, OVT_F32);
    scan.z = OVT_FIELD(points, scan.count, z, OVT_F32);
    scan.layer = OVT_FIELD(points, scan.count, layer, OVT_U16);
    scan.intensity = OVT_FIELD(points, scan.count, intensity, OVT_F32);
    status = ovt_push_scan(detector, &scan);

    ovt_tracks tracks = {0};
    if (status == OVT_OK) status = ovt_next_frame(reader, NULL);
    if (status == OVT_OK) status = ovt_read_tracks(reader, OVT_AT_FRAME_STAMP, &tracks);
    found = 0;
    for (int32_t i = 0; status == OVT_OK && i < tracks.count; ++i) {
      if (tracks.state[i] != OVT_CONFIRMED) continue;
      if (k % 10 == 9) printf("%4.2f s: x %5.2f m, %5.2f m/s\n", k * 0.05, tracks.x_m[i], tracks.speed_mps[i]);
      found += fabs(tracks.speed_mps[i] - 10.0) < 1.0;
    }
  }
  if (status != OVT_OK) fprintf(stderr, "poll_tracks: %s\n", ovt_status_text(status));
  ovt_destroy_reader(reader);
  ovt_destroy_detector(detector);
  return status == OVT_OK && found == 1 ? 0 : 1;
}
