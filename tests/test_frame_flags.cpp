// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// Flags that follow from a finished frame's numbers. test_detector and test_all_clear test the counters.
#include "pipeline/frame_flags.h"

#include <doctest/doctest.h>

#include <memory>
#include <vector>

namespace overtake {
namespace {

constexpr int64_t kNoDeadline = 0;

// Two sensors of 100 good points each.
std::unique_ptr<Frame> make_frame() {
  auto frame = std::make_unique<Frame>();
  for (int32_t s = 0; s < 2; ++s) {
    frame->sensors[s].present = true;
    frame->sensors[s].kept.points.count = 100;
  }
  return frame;
}

uint32_t ask(const Frame& frame, bool tracks_overflowed = false, int64_t deadline_ns = kNoDeadline) {
  return flags_of(frame, 2, tracks_overflowed, deadline_ns);
}

int32_t& count_of(Frame& frame, int32_t sensor, Reason reason) {
  return frame.sensors[sensor].reason_count[int32_t(reason)];
}

TEST_CASE("flags_of: a good frame has none, and flags of the stages are neither read nor repeated") {
  auto frame = make_frame();
  CHECK(ask(*frame) == 0);
  frame->flags = OVT_FLAG_NO_EGO | OVT_FLAG_OVERFLOW;
  CHECK(ask(*frame) == 0);
}

TEST_CASE("flags_of: a cloud is degraded if more than half of a sensor's points are unusable") {
  auto frame = make_frame();
  count_of(*frame, 1, Reason::kNotFinite) = 20;
  count_of(*frame, 1, Reason::kLayerDropped) = 30;
  CHECK(ask(*frame) == 0);
  count_of(*frame, 1, Reason::kZeroRange) = 1;
  CHECK(ask(*frame) == OVT_FLAG_CLOUD_DEGRADED);
  count_of(*frame, 1, Reason::kZeroRange) = 0;
  count_of(*frame, 1, Reason::kDust) = 25;  // usable, but farther or nearer than the pixel's point
  count_of(*frame, 1, Reason::kSecondReturn) = 25;
  CHECK(ask(*frame) == 0);
  count_of(*frame, 1, Reason::kZeroRange) = 1;
  CHECK(ask(*frame) == OVT_FLAG_CLOUD_DEGRADED);
  frame->sensors[1].present = false;
  CHECK(ask(*frame) == 0);
}

TEST_CASE("flags_of: a cloud is degraded if most of a sensor's points lose their pixel, or if it has none") {
  auto frame = make_frame();
  count_of(*frame, 0, Reason::kDust) = 40;
  count_of(*frame, 0, Reason::kSecondReturn) = 35;
  CHECK(ask(*frame) == 0);
  count_of(*frame, 0, Reason::kSecondReturn) = 36;
  CHECK(ask(*frame) == OVT_FLAG_CLOUD_DEGRADED);
  count_of(*frame, 0, Reason::kSecondReturn) = 35;
  frame->sensors[1].kept.points.count = 0;
  CHECK(ask(*frame) == OVT_FLAG_CLOUD_DEGRADED);
}

TEST_CASE("flags_of: no ground if hardly a point of a scan of many is ground, where heights over it are known") {
  auto frame = make_frame();
  std::vector<float> heights(1);
  SensorPart& part = frame->sensors[1];
  const auto ask_of = [&](int32_t points, int32_t in_clusters, int32_t of_own_body) {
    part.kept.points.count = points;
    part.cluster_points.count = in_clusters;
    count_of(*frame, 1, Reason::kOwnBody) = of_own_body;
    count_of(*frame, 1, Reason::kLabelled) = points - of_own_body;
    return ask(*frame);
  };
  CHECK(ask_of(1000, 990, 0) == 0);  // no heights: another method
  part.kept.images.height_m.data = heights.data();
  CHECK(ask_of(1000, 981, 0) == OVT_FLAG_NO_GROUND);
  CHECK(ask_of(1000, 980, 0) == 0);
  CHECK(ask_of(1000, 980, 500) == 0);
  CHECK(ask_of(1000, 981, 500) == OVT_FLAG_NO_GROUND);
  CHECK(ask_of(999, 999, 0) == 0);  // too few points to tell
  CHECK(ask_of(30000, 29500, 0) == OVT_FLAG_NO_GROUND);
  float nearest_m[] = {2.9f, 3.1f};  // a car beside this one, and another object
  int32_t point_count[] = {29001, 10};
  part.clusters.nearest_m = nearest_m, part.clusters.point_count = point_count, part.clusters.count = 2;
  CHECK(ask(*frame) == 0);
  point_count[0] = 29000;
  CHECK(ask_of(30000, 29981, 0) == OVT_FLAG_NO_GROUND);
  part.present = false;
  CHECK(ask(*frame) == 0);
}

TEST_CASE("flags_of: no data if no scan has a usable point; never for pushed detections and predictions") {
  auto frame = make_frame();
  count_of(*frame, 0, Reason::kRangeLimit) = 100;
  count_of(*frame, 1, Reason::kRangeLimit) = 99;
  CHECK(ask(*frame) == OVT_FLAG_CLOUD_DEGRADED);
  count_of(*frame, 1, Reason::kRangeLimit) = 100;
  CHECK(ask(*frame) == (OVT_FLAG_CLOUD_DEGRADED | OVT_FLAG_NO_DATA));
  for (SensorPart& part : frame->sensors) part.present = false;
  CHECK(ask(*frame) == OVT_FLAG_NO_DATA);
  for (const FrameKind kind : {FrameKind::kExternal, FrameKind::kPrediction}) {
    frame->kind = kind;
    CHECK(ask(*frame) == 0);
  }
}

TEST_CASE("flags_of: overflow if any table was too small") {
  for (int32_t table = 0; table < 4; ++table) {
    CAPTURE(table);
    auto frame = make_frame();
    if (table == 0) frame->sensors[1].cluster_overflow = 1;
    if (table == 1) frame->merged_overflow = 1;
    if (table == 2) frame->candidate_overflow = 1;
    CHECK(ask(*frame, table == 3) == OVT_FLAG_OVERFLOW);
  }
}

TEST_CASE("flags_of: deadline missed if the latency is above it, and never without a deadline") {
  auto frame = make_frame();
  frame->latency_ns = 1000;
  CHECK(ask(*frame, false, 1000) == 0);
  CHECK(ask(*frame, false, 999) == OVT_FLAG_DEADLINE_MISSED);
  CHECK(ask(*frame) == 0);
  frame->latency_ns = -1;  // no scan
  CHECK(ask(*frame, false, 1) == 0);
}

}  // namespace
}  // namespace overtake
