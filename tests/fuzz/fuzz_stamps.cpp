// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// Times: any sequence of stamps for scans, poses, pushed detections and advance. Frames come in order without gaps,
// every push is counted once, and every number is finite.
#include "tests/fuzz/small_detector.h"

using namespace overtake::fuzz;

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, std::size_t size) {
  Bytes in(data, size);
  const int32_t sensor_count = in.in(0, 2);
  SmallDef small;
  draw_def(in, sensor_count, small);
  for (ovt_sensor_def& sensor : small.sensors) sensor.rows = 4, sensor.cols = 16, sensor.point_capacity = 48;
  FrameWatch watch{sensor_count};
  small.def.on_frame = FrameWatch::on_frame;
  small.def.user = &watch;
  small.def.push_policy = in.in(0, 1);
  ovt_detector* detector = nullptr;
  OVT_FUZZ_REQUIRE(ovt_create_detector(&small.def, &detector) == OVT_OK);
  int64_t stamp_ns = in.chance(32) ? in.raw<int64_t>() : 1'000'000'000;
  int64_t scans = 0, poses = 0, externals = 0;
  Cloud cloud;
  Rows rows;
  for (int32_t step = 0; step < 80 && !in.empty(); ++step) {
    const int32_t what = in.in(0, 15);
    stamp_ns = next_stamp(in, stamp_ns);
    if (what < 9 && sensor_count > 0) {
      const int32_t sensor = what % sensor_count;
      cloud.draw(in, in.chance(100) ? 40 : 0, small.sensors[std::size_t(sensor)]);
      const ovt_points points = cloud.points(sensor, stamp_ns);
      const ovt_status status = ovt_push_scan(detector, &points);
      OVT_FUZZ_REQUIRE(status == OVT_OK || status == OVT_DUPLICATE || status == OVT_LATE);
      ++scans;
    } else if (what < 11) {
      const ovt_ego_pose pose = draw_ego(in, stamp_ns);
      poses += ovt_push_ego_pose(detector, &pose) != OVT_BAD_ARGUMENT;
    } else if (what < 13) {
      const ovt_external_detections d = rows.draw(in, stamp_ns);
      const ovt_status status = ovt_push_detections(detector, &d);
      externals += status == OVT_OK || status == OVT_DUPLICATE || status == OVT_LATE || status == OVT_TOO_MANY;
    } else if (what < 15) {
      OVT_FUZZ_REQUIRE(ovt_advance(detector, stamp_ns) == OVT_OK);
    } else {
      OVT_FUZZ_REQUIRE(ovt_flush(detector) == OVT_OK);
    }
  }
  OVT_FUZZ_REQUIRE(ovt_flush(detector) == OVT_OK);
  const ovt_stats stats = stats_of(detector);
  OVT_FUZZ_REQUIRE(stats.pushed == scans);
  OVT_FUZZ_REQUIRE(stats.pushed == stats.used + stats.dropped + stats.late + stats.dup);
  OVT_FUZZ_REQUIRE(stats.ego_poses + stats.ego_dropped == poses);
  OVT_FUZZ_REQUIRE(stats.external + stats.external_dropped == externals);
  OVT_FUZZ_REQUIRE(stats.frames == watch.frames);
  OVT_FUZZ_REQUIRE(stats.exceptions == 0);
  ovt_destroy_detector(detector);
  return 0;
}
