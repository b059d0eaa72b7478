// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// Compares worker counts: the same pushes, in the order of their stamps, give the same bytes in the pushing thread and
// on a graph of two to four workers.
#include "tests/fuzz/small_detector.h"
#include "tests/support/frame_hash.h"

using namespace overtake::fuzz;

namespace {

struct Story {
  int32_t sensor_count;
  std::vector<uint64_t> hashes;
  static void on_frame(ovt_reader* reader, void* user) {
    auto& story = *static_cast<Story*>(user);
    story.hashes.push_back(overtake::test::FrameHash(reader, story.sensor_count).value());
  }
};

std::vector<uint64_t> tell(Bytes in, int32_t workers) {
  Story story{in.in(1, 3), {}};
  SmallDef small;
  draw_def(in, story.sensor_count, small);
  small.def.worker_count = workers;
  small.def.push_policy = OVT_PUSH_WAIT;
  small.def.frames_in_flight = in.in(1, 3);
  small.def.on_frame = Story::on_frame;
  small.def.user = &story;
  ovt_detector* detector = nullptr;
  OVT_FUZZ_REQUIRE(ovt_create_detector(&small.def, &detector) == OVT_OK);
  int64_t stamp_ns = 0;
  Cloud cloud;
  Rows rows;
  for (int32_t step = 0; step < 30 && !in.empty(); ++step) {
    const int32_t what = in.in(0, 15);
    stamp_ns += (in.chance(250) ? in.in(1, 40) : in.in(100, 3000)) * int64_t(1'000'000);
    if (what < 11) {
      const int32_t sensor = what % story.sensor_count;
      cloud.draw(in, in.in(0, 100), small.sensors[std::size_t(sensor)]);
      const ovt_points points = cloud.points(sensor, stamp_ns);
      OVT_FUZZ_REQUIRE(ovt_push_scan(detector, &points) == OVT_OK);
    } else if (what < 13) {
      const ovt_ego_pose pose = draw_ego(in, stamp_ns);
      ovt_push_ego_pose(detector, &pose);
    } else if (what == 13) {
      const ovt_external_detections d = rows.draw(in, stamp_ns);
      ovt_push_detections(detector, &d);
    } else if (what == 14) {
      ovt_advance(detector, stamp_ns);
    } else {
      ovt_flush(detector);
    }
  }
  OVT_FUZZ_REQUIRE(ovt_flush(detector) == OVT_OK);
  const ovt_stats stats = stats_of(detector);
  OVT_FUZZ_REQUIRE(stats.frames == int64_t(story.hashes.size()) && stats.exceptions == 0);
  ovt_destroy_detector(detector);
  return story.hashes;
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, std::size_t size) {
  Bytes in(data, size);
  const int32_t workers = in.in(2, 4);
  const std::vector<uint64_t> alone = tell(in, 1), graph = tell(in, workers);
  OVT_FUZZ_REQUIRE(alone == graph);
  return 0;
}
