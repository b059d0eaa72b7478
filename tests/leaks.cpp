// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// Creates, uses and destroys detectors with workers. Directly after each destroy, while oneTBB's workers are still
// stopping, the leak sanitizer checks the heap.
//
//   leaks --rounds N
//
// Then a global object destroys a detector, after the end of main.
//
// Only the linker adds the sanitizer (tests/CMakeLists.txt): the library is the one that all other tests link.
#include <sanitizer/lsan_interface.h>

#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <cstring>

#include "pipeline/overtake.h"

namespace {

constexpr int32_t kSensors = 2;

ovt_detector_def detector_def(ovt_sensor_def (&sensors)[kSensors], int32_t round) {
  for (ovt_sensor_def& sensor : sensors) {
    sensor = ovt_default_sensor_def();
    sensor.rows = 4, sensor.cols = 16, sensor.point_capacity = 16;
  }
  ovt_detector_def def = ovt_default_detector_def();
  def.sensors = sensors;
  def.sensor_count = kSensors;
  def.worker_count = 2 + round % 3;
  def.push_policy = OVT_PUSH_WAIT;
  def.cluster_capacity = def.candidate_capacity = def.track_capacity = def.ego_pose_capacity = 16;
  def.spin_us = round % 4 == 3 ? 100 : 0;
  return def;
}

bool run_one(int32_t round) {
  ovt_sensor_def sensors[kSensors];
  const ovt_detector_def def = detector_def(sensors, round);
  ovt_detector* detector = nullptr;
  if (ovt_create_detector(&def, &detector) != OVT_OK) return false;
  bool good = true;
  for (int64_t frame = 0; frame < round % 5; ++frame)
    for (int32_t s = 0; s < kSensors; ++s) {
      ovt_points points;
      ovt_points_init(&points, sizeof points);
      points.sensor = s;
      points.stamp_ns = frame * 50'000'000;
      points.x.type = points.y.type = points.z.type = OVT_F32;
      points.layer.type = OVT_I32;
      good &= ovt_push_scan(detector, &points) == OVT_OK;
    }
  if (round % 2 == 0) good &= ovt_flush(detector) == OVT_OK;
  ovt_destroy_detector(detector);
  return good;
}

// Constructed before every static object of the library's functions.
struct Global {
  ovt_detector* detector = nullptr;
  ~Global() { ovt_destroy_detector(detector); }
} global;

}  // namespace

int main(int argc, char** argv) {
  int32_t rounds = 40;
  for (int i = 1; i + 1 < argc; i += 2)
    if (!std::strcmp(argv[i], "--rounds")) rounds = std::atoi(argv[i + 1]);
  int32_t leaking = 0;
  for (int32_t round = 0; round < rounds; ++round) {
    if (!run_one(round)) {
      std::printf("leaks: round %d: a call failed\n", round);
      return 1;
    }
    leaking += __lsan_do_recoverable_leak_check() != 0;
  }
  ovt_sensor_def sensors[kSensors];
  const ovt_detector_def def = detector_def(sensors, 0);
  if (ovt_create_detector(&def, &global.detector) != OVT_OK) return 1;
  std::printf("leaks: %d of %d rounds left something behind\n", leaking, rounds);
  return leaking == 0 ? 0 : 1;
}
