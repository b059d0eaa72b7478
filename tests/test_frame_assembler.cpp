// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// Scans become frames by their stamps alone.
#include "tests/support/assembler_bench.h"

#include <algorithm>
#include <vector>

using namespace overtake;
using namespace overtake::test;

TEST_CASE("frame_assembler: scans within the tolerance form one frame, closed by the last sensor, in any order") {
  for (const std::vector<int32_t>& order :
       {std::vector<int32_t>{0, 1, 2}, {0, 2, 1}, {1, 0, 2}, {1, 2, 0}, {2, 0, 1}, {2, 1, 0}}) {
    AssemblerBench bench;
    for (int64_t k = 0; k < 4; ++k) bench.sweep(50 * k, order);
    REQUIRE(bench.count() == 4);
    for (std::size_t k = 0; k < 4; ++k) {
      const ClosedFrame& c = bench.runner.closed[k];
      CHECK(c.sequence == int64_t(k));
      CHECK(c.mask == 7);
      CHECK(c.flags == 0);
      CHECK(c.segments == 3);
      CHECK(c.first_ms == int64_t(50 * k));
      CHECK(c.last_ms == int64_t(50 * k + 2));
    }
  }
}

TEST_CASE("frame_assembler: the tolerance counts from the frame's first stamp and is inclusive") {
  AssemblerBench bench;
  bench.scan(0, 100);
  CHECK(bench.scan(1, 125) == IntakeResult::kUsed);
  CHECK(bench.count() == 0);
  CHECK(bench.scan_ns(2, 125 * kMs + 1) == IntakeResult::kUsed);  // a new frame closes the first
  REQUIRE(bench.count() == 1);
  CHECK(bench.last().mask == 3);
  CHECK(bench.last().flags == OVT_FLAG_SENSOR_MISSING);
}

TEST_CASE("frame_assembler: a second scan of a sensor opens the next frame, however near its stamp") {
  AssemblerBench bench;
  bench.scan(0, 100);
  bench.scan(0, 110);
  REQUIRE(bench.count() == 1);
  CHECK(bench.last().mask == 1);
}

TEST_CASE("frame_assembler: a frame waits for a missing sensor until the next scan, and not for a silent one") {
  AssemblerBench bench;
  bench.sweep(0);
  for (int64_t k = 1; k < 6; ++k) {
    bench.sweep(50 * k, {0, 1});
    // Its last scan was at 2 ms: from the frame at 100 ms on it is silent for more than 75 ms.
    CHECK(bench.count() == std::size_t(k < 2 ? k : k + 1));
  }
  CHECK(bench.runner.closed[1].flags == OVT_FLAG_SENSOR_MISSING);
  for (std::size_t k = 2; k < 6; ++k) {
    CHECK(bench.runner.closed[k].mask == 3);
    CHECK(bench.runner.closed[k].flags == (OVT_FLAG_SENSOR_MISSING | OVT_FLAG_SENSOR_STALE));
  }
}

TEST_CASE("frame_assembler: a returning sensor's first scan is used, and frames wait for the sensor again") {
  AssemblerBench bench;
  bench.sweep(0);
  for (int64_t k = 1; k < 6; ++k) bench.sweep(50 * k, {0, 1});
  bench.scan(2, 300);
  bench.scan(0, 300);
  const std::size_t before = bench.count();
  bench.scan(1, 301);
  REQUIRE(bench.count() == before + 1);
  CHECK(bench.last().mask == 7);
  CHECK(bench.last().flags == 0);
  bench.scan(0, 350);
  bench.scan(1, 350);
  CHECK(bench.count() == before + 1);  // waits for sensor 2
  bench.scan(2, 350);
  CHECK(bench.count() == before + 2);
}

TEST_CASE("frame_assembler: a frame waits only 75 ms for a sensor that never sent a scan") {
  AssemblerBench bench;
  for (int64_t k = 0; k < 5; ++k) bench.sweep(50 * k, {0, 1});
  CHECK(bench.count() == 5);
  for (std::size_t k = 0; k < bench.count(); ++k) CHECK(bench.runner.closed[k].mask == 3);
}

TEST_CASE("frame_assembler: a scan older than a closed frame becomes a separate frame, out of sequence") {
  AssemblerBench bench;
  bench.sweep(100);
  CHECK(bench.scan(1, 50) == IntakeResult::kUsed);
  REQUIRE(bench.count() == 2);
  CHECK(bench.last().sequence == 1);
  CHECK(bench.last().mask == 2);
  CHECK(bench.last().last_ms == 50);
  CHECK((bench.last().flags & OVT_FLAG_OUT_OF_SEQUENCE) != 0);
  CHECK((bench.runner.closed[0].flags & OVT_FLAG_OUT_OF_SEQUENCE) == 0);

  CHECK(bench.scan(0, 150) == IntakeResult::kUsed);
  CHECK(bench.scan(1, 140) == IntakeResult::kUsed);  // older than the first, within the tolerance
  CHECK(bench.count() == 2);
  CHECK(bench.scan(2, 104) ==
        IntakeResult::kUsed);  // between the closed and the open frame; the open one keeps waiting
  REQUIRE(bench.count() == 3);
  CHECK(bench.last().first_ms == 104);
  CHECK((bench.last().flags & OVT_FLAG_OUT_OF_SEQUENCE) == 0);
  CHECK(bench.scan(2, 141) == IntakeResult::kUsed);
  REQUIRE(bench.count() == 4);
  CHECK(bench.last().sequence == 3);
  CHECK(bench.last().first_ms == 140);
  CHECK(bench.last().last_ms == 150);
  CHECK(bench.last().mask == 7);
}

TEST_CASE("frame_assembler: flush closes the open frame once") {
  AssemblerBench bench;
  bench.assembler.flush();
  CHECK(bench.count() == 0);
  bench.scan(1, 100);
  bench.assembler.flush();
  bench.assembler.flush();
  REQUIRE(bench.count() == 1);
  CHECK(bench.last().mask == 2);
  CHECK(bench.scan(0, 100) == IntakeResult::kUsed);  // a separate frame: its first frame is closed
  CHECK(bench.scan(0, 101) == IntakeResult::kUsed);
  bench.assembler.flush();
  CHECK(bench.count() == 3);
  CHECK(bench.assembler.closed_count() == 3);
}

TEST_CASE("frame_assembler: advance closes a frame after 75 ms and predicts when no frame came for as long") {
  AssemblerBench bench;
  CHECK(bench.assembler.advance(0));
  CHECK(bench.count() == 0);  // no frame yet: nothing to predict from
  bench.scan(0, 100);
  CHECK(bench.assembler.advance(174 * kMs));
  CHECK(bench.count() == 0);
  CHECK(bench.assembler.advance(175 * kMs));
  REQUIRE(bench.count() == 1);
  CHECK(bench.last().kind == FrameKind::kScans);
  CHECK(bench.assembler.advance(INT64_MIN));
  CHECK(bench.assembler.advance(174 * kMs));
  CHECK(bench.count() == 1);
  CHECK(bench.assembler.advance(180 * kMs));
  REQUIRE(bench.count() == 2);
  CHECK(bench.last().kind == FrameKind::kPrediction);
  CHECK(bench.last().last_ms == 180);
  CHECK(bench.last().mask == 0);
  CHECK(bench.scan(0, 150) == IntakeResult::kUsed);  // a prediction makes no scan late
  CHECK(bench.assembler.advance(INT64_MAX));
  CHECK(bench.count() == 3);
}

TEST_CASE("frame_assembler: a prediction uses the poses that were pushed before the time was reported") {
  for (const int64_t pose_count : {int64_t(1), INT64_MAX}) {
    AssemblerBench bench;
    const auto push_pose = [&](int64_t ms) {
      EgoPose pose;
      pose.stamp_ns = ms * kMs;
      CHECK(bench.ego.push(pose) == OVT_OK);
    };
    push_pose(100);
    bench.scan(0, 100);
    CHECK(bench.assembler.advance(175 * kMs));
    push_pose(110);
    bench.runner.keep = true;
    CHECK(bench.assembler.advance(190 * kMs, pose_count));
    REQUIRE(bench.last().kind == FrameKind::kPrediction);
    CHECK(bench.runner.kept[0]->ego.count == std::min<int64_t>(pose_count, 2));
    bench.runner.finish_kept();
  }
}

TEST_CASE("frame_assembler: pushed detections are a separate frame, in the order of stamps") {
  AssemblerBench bench;
  CHECK(bench.external(90) == IntakeResult::kUsed);
  REQUIRE(bench.count() == 1);
  CHECK(bench.last().kind == FrameKind::kExternal);
  CHECK(bench.last().flags == OVT_FLAG_EXTERNAL);
  CHECK(bench.last().external_count == 2);
  bench.scan(0, 100);
  CHECK(bench.external(95) == IntakeResult::kUsed);  // before the open frame, which keeps waiting
  REQUIRE(bench.count() == 2);
  CHECK((bench.last().flags & OVT_FLAG_OUT_OF_SEQUENCE) == 0);
  bench.scan(1, 110);
  CHECK(bench.external(105) == IntakeResult::kUsed);  // between the stamps of the open frame, which then is late itself
  CHECK(bench.count() == 3);
  CHECK(bench.external(174) == IntakeResult::kUsed);  // a radar is faster than the scans of the same time
  CHECK(bench.count() == 4);
  // No sensor goes on: after 24 pushes the detections are the clock, and the open frame ends.
  for (int64_t k = 1; k < 30; ++k) bench.external(174 + 14 * k);
  std::size_t scans = 0;
  for (const ClosedFrame& frame : bench.runner.closed) {
    if (frame.kind != FrameKind::kScans) continue;
    ++scans;
    CHECK(frame.mask == 3);
    CHECK(frame.last_ms == 110);
    CHECK((frame.flags & OVT_FLAG_OUT_OF_SEQUENCE) != 0);
  }
  CHECK(scans == 1);
  CHECK(bench.external(109) == IntakeResult::kUsed);
  CHECK(bench.last().flags == (OVT_FLAG_EXTERNAL | OVT_FLAG_OUT_OF_SEQUENCE));
  CHECK(bench.external(109) == IntakeResult::kDuplicate);
}

TEST_CASE("frame_assembler: a radar that is faster than the scans of the same time splits no frame") {
  AssemblerBench bench;
  for (int64_t k = 0; k < 40; ++k) {
    // It delivers the rows of 25 and 50 ms from now before the scans of now, or between them.
    CHECK(bench.external(50 * k + 25) == IntakeResult::kUsed);
    bench.scan(0, 50 * k);
    CHECK(bench.external(50 * k + 49) == IntakeResult::kUsed);
    bench.scan(1, 50 * k + 1);
    bench.scan(2, 50 * k + 2);
    REQUIRE(bench.count() == 3 * (k + 1));
    CHECK(bench.last().mask == 7);
    CHECK((bench.last().flags & OVT_FLAG_OUT_OF_SEQUENCE) != 0);
  }
}

TEST_CASE("frame_assembler: pushed detections and scans with one stamp are both used, in either order") {
  AssemblerBench bench;
  bench.sweep(0);
  CHECK(bench.external(2) == IntakeResult::kUsed);
  CHECK(bench.external(50) == IntakeResult::kUsed);
  bench.sweep(50);
  REQUIRE(bench.count() == 4);
  CHECK(bench.last().mask == 7);
  CHECK(bench.last().last_ms == 52);
}

TEST_CASE("frame_assembler: without a free slot nothing is used and the sequence gets no gap") {
  AssemblerBench bench;
  bench.runner.keep = true;
  for (int64_t k = 0; k < kSlots; ++k) bench.sweep(50 * k);
  CHECK(bench.scan(0, 200) == IntakeResult::kNoSlot);
  CHECK(bench.external(201) == IntakeResult::kNoSlot);
  CHECK_FALSE(bench.assembler.advance(1000 * kMs));
  CHECK(bench.assembler.closed_count() == kSlots);
  bench.runner.finish_kept();
  bench.runner.keep = false;
  bench.sweep(200);
  CHECK(bench.external(203) == IntakeResult::kUsed);
  CHECK(bench.assembler.advance(1000 * kMs));
  REQUIRE(bench.count() == kSlots + 3);
  for (std::size_t k = 0; k < bench.count(); ++k) CHECK(bench.runner.closed[k].sequence == int64_t(k));
}

TEST_CASE("frame_assembler: which scans share a frame does not depend on free slots") {
  for (const bool is_full : {false, true}) {
    CAPTURE(is_full);
    AssemblerBench bench;
    bench.runner.keep = is_full;
    for (int64_t k = 0; k + 1 < kSlots; ++k) bench.sweep(50 * k);
    const int64_t now = 50 * (kSlots - 1);
    CHECK(bench.scan(0, now) == IntakeResult::kUsed);
    CHECK(bench.scan(1, now + 10) == IntakeResult::kUsed);
    // The next one of sensor 0 closes the frame, although it is older than the frame's newest scan.
    if (is_full) {
      for (int32_t i = 0; i < 2; ++i) CHECK(bench.scan(0, now + 5) == IntakeResult::kNoSlot);
      bench.runner.finish_kept();
      bench.runner.keep = false;
    }
    CHECK(bench.scan(0, now + 5) == IntakeResult::kUsed);
    CHECK(bench.scan(1, now + 15) == IntakeResult::kUsed);
    CHECK(bench.scan(2, now + 16) == IntakeResult::kUsed);
    CHECK(bench.count() == std::size_t(kSlots) + 1);
    CHECK(bench.last().mask == 7);
  }
}

TEST_CASE("frame_assembler: a frame sees the ego poses pushed before its last scan") {
  AssemblerBench bench;
  const auto push = [&](int64_t ms) {
    EgoPose pose;
    pose.stamp_ns = ms * kMs;
    REQUIRE(bench.ego.push(pose) == OVT_OK);
  };
  bench.runner.keep = true;
  push(90);
  bench.scan(0, 100);
  push(100);
  bench.scan(1, 101);
  push(110);
  bench.assembler.flush();
  REQUIRE(bench.runner.kept.size() == 1);
  CHECK(bench.runner.kept[0]->ego.count == 2);
}
