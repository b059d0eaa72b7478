/* Copyright 2026 The Overtake authors
 * SPDX-License-Identifier: Apache-2.0
 *
 * Callbacks instead of polling: the library calls on_frame for every finished frame, in order, one at a time. With two
 * workers that is a thread of the library's. The callback may only read from the reader it was lent, and only until it
 * returns; it holds the next frame up, so it is short.
 * Also: a log, and parameters by name. Exit code 0 when every scan was used and the car was tracked.
 */
#include <inttypes.h>
#include <overtake/overtake.h>
#include <stdio.h>

#include "simulated_scan.h"

static scan_point points[SCAN_CAPACITY];

/* Written by the callback, read by main after ovt_destroy_detector: no callback runs then, so no lock is needed. */
typedef struct listener {
  int64_t frames, next_sequence;
  int in_order, confirmed;
  double x_m, speed_mps;
} listener;

static void on_frame(ovt_reader* reader, void* user) {
  listener* to = (listener*)user;
  ovt_frame_info info;
  ovt_tracks tracks;
  if (ovt_read_info(reader, &info) != OVT_OK || ovt_read_tracks(reader, OVT_AT_FRAME_STAMP, &tracks) != OVT_OK) return;
  to->in_order = to->in_order && info.sequence == to->next_sequence++;
  to->frames += 1;
  to->confirmed = 0;
  for (int32_t i = 0; i < tracks.count; ++i) {
    if (tracks.state[i] != OVT_CONFIRMED) continue;
    to->confirmed += 1;
    to->x_m = tracks.x_m[i];
    to->speed_mps = tracks.speed_mps[i];
  }
}

static void on_log(ovt_log_level level, const char* text, void* user) {
  (void)user;
  fprintf(stderr, "%s: %s\n", level == OVT_LOG_ERROR ? "error" : level == OVT_LOG_WARNING ? "warning" : "note", text);
}

int main(void) {
  enum { SCANS = 40 };
  listener heard = {0};
  heard.in_order = 1;

  ovt_params params;
  if (ovt_params_init(&params, sizeof params, "best") != OVT_OK) return 1;
  if (ovt_set_param(&params, "tracker.confirm_hits", "8") != OVT_OK) return 1;
  ovt_sensor_def sensor = ovt_default_sensor_def();
  sensor.z_m = 1.2;
  sensor.cols = SCAN_BEAMS;
  ovt_detector_def def = ovt_default_detector_def();
  def.sensors = &sensor;
  def.sensor_count = 1;
  def.params = &params;
  def.worker_count = 2;
  def.push_policy = OVT_PUSH_WAIT; /* this is a replay: nothing may be dropped. A driver leaves OVT_PUSH_REPLACE */
  def.on_frame = on_frame;
  def.log = on_log;
  def.user = &heard;

  char error[256];
  ovt_detector* detector = NULL;
  if (ovt_create_detector_verbose(&def, &detector, error, sizeof error) != OVT_OK) {
    fprintf(stderr, "on_frame: %s\n", error);
    return 1;
  }
  ovt_status status = OVT_OK;
  for (int k = 0; status == OVT_OK && k < SCANS; ++k) {
    ovt_points scan;
    ovt_points_init(&scan, sizeof scan);
    scan.stamp_ns = k * INT64_C(50000000);
    scan.count = simulate_scan(points, 0.0, 40.0 - 0.25 * k, 1.0);
    scan.x = OVT_FIELD(points, scan.count, x, OVT_F32);
    scan.y = OVT_FIELD(points, scan.count, y, OVT_F32);
    scan.z = OVT_FIELD(points, scan.count, z, OVT_F32);
    scan.layer = OVT_FIELD(points, scan.count, layer, OVT_U16);
    status = ovt_push_scan(detector, &scan); /* copied: `points` may be filled again */
  }
  if (status == OVT_OK) status = ovt_flush(detector);
  ovt_stats stats = ovt_default_stats();
  if (status == OVT_OK) status = ovt_read_stats(detector, &stats);
  ovt_destroy_detector(detector); /* no callback after this */

  if (status != OVT_OK) {
    fprintf(stderr, "on_frame: %s\n", ovt_status_text(status));
    return 1;
  }
  printf("%" PRId64 " frames of %" PRId64 " scans; the car is at x %5.2f m, %5.2f m/s\n", heard.frames, stats.pushed,
         heard.x_m, heard.speed_mps);
  const int good = heard.in_order && heard.frames == SCANS && stats.used == SCANS && heard.confirmed == 1 &&
                   fabs(heard.x_m - (40.0 - 0.25 * (SCANS - 1))) < 4.0; /* its centre is half a length further */
  return good ? 0 : 1;
}
