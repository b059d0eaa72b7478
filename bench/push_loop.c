/* Copyright 2026 The Overtake authors
 * SPDX-License-Identifier: Apache-2.0
 *
 * The C API's side of bench_python: the same pushes as the Python package makes, timed one by one. */
#define _POSIX_C_SOURCE 199309L /* clock_gettime */
#include <time.h>

#include "pipeline/overtake.h"

OVT_API ovt_detector* push_loop_create(int worker_count) {
  ovt_sensor_def sensor = ovt_default_sensor_def();
  ovt_params params;
  ovt_detector_def def = ovt_default_detector_def();
  ovt_detector* detector = NULL;
  if (ovt_params_init(&params, sizeof params, "best") != OVT_OK) return NULL;
  def.sensors = &sensor;
  def.sensor_count = 1;
  def.params = &params;
  def.worker_count = worker_count;
  def.keep_images = 0;
  return ovt_create_detector(&def, &detector) == OVT_OK ? detector : NULL;
}

OVT_API void push_loop_destroy(ovt_detector* detector) { ovt_destroy_detector(detector); }

/* Columns x, y, z, intensity, layer. ns[i]: of push i. piece: ovt_push_points instead of ovt_push_scan; the end of the
 * scan is not timed. Returns how many pushes were not OVT_OK. */
OVT_API int push_loop_run(ovt_detector* detector, const void* const data[5], const int64_t stride[5],
                          const int32_t type[5], int32_t count, int64_t first_stamp_ns, int32_t pushes, int64_t* ns,
                          int piece) {
  ovt_points scan = ovt_default_points();
  ovt_column* columns[5] = {&scan.x, &scan.y, &scan.z, &scan.intensity, &scan.layer};
  int failed = 0;
  scan.count = count;
  for (int c = 0; c < 5; ++c) {
    columns[c]->data = data[c];
    columns[c]->stride = (size_t)stride[c];
    columns[c]->type = type[c];
    columns[c]->size_bytes = (size_t)(count - 1) * (size_t)stride[c] + 1 + (type[c] == OVT_F32 ? 3 : 1);
  }
  for (int32_t i = 0; i < pushes; ++i) {
    struct timespec before, after;
    scan.stamp_ns = first_stamp_ns + (int64_t)i * 50000000;
    clock_gettime(CLOCK_MONOTONIC, &before);
    failed += (piece ? ovt_push_points(detector, &scan) : ovt_push_scan(detector, &scan)) != OVT_OK;
    clock_gettime(CLOCK_MONOTONIC, &after);
    ns[i] = (int64_t)(after.tv_sec - before.tv_sec) * 1000000000 + (after.tv_nsec - before.tv_nsec);
    if (piece) failed += ovt_end_scan(detector, 0, scan.stamp_ns, -1) != OVT_OK;
  }
  return failed;
}
