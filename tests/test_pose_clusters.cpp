// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// Poses fitted after each sensor's segmentation, before the frame is complete: they must not change the results.
#include <doctest/doctest.h>

#include <atomic>

#include "pipeline/detector.h"
#include "tests/support/detector_bench.h"

namespace {

using namespace overtake;
using namespace overtake::test;

struct Watch {
  bool forgets = false;            // discard the early fits
  bool lies = false;               // or replace them by wrong ones
  std::atomic<int32_t> fitted{0};  // clusters, over all frames; detections run in parallel
  int32_t used = 0;                // detections of single clusters that were fitted early
  int32_t joined = 0;              // detections of clusters of several sensors
  int32_t fitted_joined = 0;       // whose parts were fitted early

  static void look(void* user, HookPoint body, Frame& frame, int32_t) {
    auto& watch = *static_cast<Watch*>(user);
    if (body == HookPoint::kDetect)
      for (SensorPart& part : frame.sensors) {
        for (int32_t i = 0; i < part.fits.count; ++i) watch.fitted += part.fits.fitted[i];
        if (watch.forgets) part.fits.count = 0;
        for (int32_t i = 0; watch.lies && i < part.fits.count; ++i) part.fits.fit[i].extent_width_m += 1.0f;
      }
    if (body != HookPoint::kTrack) return;
    for (int32_t i = 0; i < frame.detections.count; ++i) {
      const int32_t first = frame.merged.first_member[frame.detections.cluster[i]];
      const bool there = frame.sensors[frame.members.sensor[first]].fits.find(frame.members.cluster[first]) != nullptr;
      const bool alone = frame.members.next_member[first] < 0;
      watch.used += alone && there;
      watch.joined += !alone;
      watch.fitted_joined += !alone && there;
    }
  }
};

// Frames in which the opponent passes, across two seams.
std::vector<FrameRecord> run(Watch& watch, int32_t workers, bool map, int32_t candidates, int32_t clusters = 1024) {
  DetectorBench bench({.workers = workers, .map = map});
  bench.def.candidate_capacity = candidates;
  bench.def.cluster_capacity = clusters;
  bench.create();
  reinterpret_cast<Detector*>(bench.detector)->set_hook({&Watch::look, &watch});
  for (std::size_t k = 62; k < 74; ++k) bench.push_frame(k, {0, 1, 2});
  bench.flush();
  return bench.records;
}

TEST_CASE("pose_clusters: early fits equal those of the whole frame, joined clusters included") {
  for (const int32_t workers : {1, 3}) {
    Watch ahead, whole;
    whole.forgets = true;
    const std::vector<FrameRecord> with = run(ahead, workers, false, 256), without = run(whole, workers, false, 256);
    REQUIRE(with.size() == 12);
    CHECK(with == without);
    CHECK(ahead.used > 50);
    CHECK(whole.used == 0);
    CHECK(ahead.joined > 0);
    CHECK(ahead.fitted_joined > 0);  // these fits must not be used
    CHECK(ahead.joined == whole.joined);
  }
}

TEST_CASE("pose_clusters: a sensor with more candidates than a frame can hold fits none early") {
  Watch all, few, whole;
  whole.forgets = true;
  run(all, 1, false, 256);
  const std::vector<FrameRecord> with = run(few, 1, false, 2), without = run(whole, 1, false, 2);
  CHECK(with == without);
  CHECK(few.fitted < all.fitted);
}

TEST_CASE("pose_clusters: detections use the early fits") {
  Watch honest, liar;
  liar.lies = true;
  CHECK_FALSE(run(honest, 1, false, 256) == run(liar, 1, false, 256));
}

TEST_CASE("pose_clusters: there is room for the whole rounded cluster table") {
  Watch ahead, whole;
  whole.forgets = true;
  CHECK(run(ahead, 1, false, 256, 1) == run(whole, 1, false, 256, 1));
  CHECK(ahead.fitted > 12 * 3);  // more than one per scan
}

TEST_CASE("pose_clusters: with a map, where the heading depends on the ego pose, nothing is fitted early") {
  Watch watch;
  CHECK(run(watch, 1, true, 256).size() == 12);
  CHECK(watch.fitted == 0);
}

}  // namespace
