// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// Scans become frames by their stamps alone: a fake runner records the calls.
#include "pipeline/frame_assembler.h"

#include <doctest/doctest.h>

#include <algorithm>
#include <array>
#include <random>
#include <string>
#include <vector>

using namespace overtake;

namespace {

constexpr int64_t kMs = 1'000'000;
constexpr int32_t kSensors = 3, kCapacity = 16, kSlots = 4;

struct Closed {
  int64_t sequence, first_ms, last_ms;
  uint32_t mask, flags;
  FrameKind kind;
  int32_t segments, external_count;
};

// Finishes every frame at once, or keeps it in flight.
class FakeRunner final : public FrameRunner {
 public:
  explicit FakeRunner(FramePool& pool) : pool_(pool) {}
  void start_segment(Frame& frame, int32_t sensor) override {
    CHECK(frame.sensors[sensor].present);
    ++segments;
  }
  void close(Frame& frame) override {
    closed.push_back({frame.sequence, frame.first_stamp_ns / kMs, frame.stamp_ns / kMs, frame.sensor_mask, frame.flags,
                      frame.kind, segments, frame.external.count});
    segments = 0;
    if (keep) {
      kept.push_back(&frame);
    } else {
      pool_.publish(&frame);
    }
  }
  void finish_kept() {
    for (Frame* frame : kept) pool_.publish(frame);
    kept.clear();
  }
  std::vector<Closed> closed;
  std::vector<Frame*> kept;
  int32_t segments = 0;
  bool keep = false;

 private:
  FramePool& pool_;
};

class Bench {
 public:
  explicit Bench(int32_t sensor_count = kSensors, int64_t period_ns = 50 * kMs)
      : ego(16), runner(pool), assembler(params(sensor_count, period_ns), pool, ego, runner) {
    FrameSizes sizes;
    SensorModel model = make_sensor_model(4, 8, 1, -1, false, 0.5, 100);
    const SensorModel models[kSensors] = {model, model, model};
    const int32_t capacity[kSensors] = {kCapacity, kCapacity, kCapacity};
    sizes.sensors = models;
    sizes.point_capacity = capacity;
    sizes.sensor_count = kSensors;
    sizes.cluster_capacity = sizes.candidate_capacity = sizes.track_capacity = sizes.external_capacity = kCapacity;
    REQUIRE(pool.build(kSlots, kSlots, sizes, default_allocator()));
    REQUIRE(arena_.build(default_allocator(), [&](Carver& carver) {
      carve_table(carver, scan_.table, kCapacity);
      carve_table(carver, rows_.table, kCapacity);
    }));
    REQUIRE(assembler.build(capacity, kCapacity, default_allocator()));
  }
  IntakeResult scan(int32_t sensor, int64_t ms) { return scan_ns(sensor, ms * kMs); }
  IntakeResult scan_ns(int32_t sensor, int64_t ns) {
    scan_.stamp_ns = ns;
    scan_.table.count = 1;
    scan_.ego = ego.range();
    return assembler.take_scan(sensor, scan_);
  }
  IntakeResult external(int64_t ms, int32_t count = 2) { return external_ns(ms * kMs, count); }
  IntakeResult external_ns(int64_t ns, int32_t count = 2) {
    rows_.table.count = count;
    for (int32_t i = 0; i < count; ++i) rows_.table.x_m[i] = double(i);
    rows_.stamp_ns = ns;
    rows_.ego = ego.range();
    return assembler.take_external(rows_);
  }
  void sweep(int64_t ms, std::vector<int32_t> sensors = {0, 1, 2}) {
    for (const int32_t s : sensors) CHECK(scan(s, ms + s) == IntakeResult::kUsed);
  }
  // The first scans after a gap are held until more of them come.
  void sweep_after_gap(int64_t ms, const std::vector<int32_t>& sensors) {
    for (const int32_t s : sensors) {
      const IntakeResult result = scan(s, ms + s);
      CHECK((result == IntakeResult::kUsed || result == IntakeResult::kHeld));
    }
  }
  const Closed& last() const { return runner.closed.back(); }
  std::size_t count() const { return runner.closed.size(); }

  FramePool pool;
  EgoBuffer ego;
  FakeRunner runner;
  FrameAssembler assembler;

 private:
  static AssemblerParams params(int32_t sensor_count, int64_t period_ns) {
    AssemblerParams p;
    p.sensor_count = sensor_count;
    p.period_ns = period_ns;
    p.tolerance_ns = period_ns / 2;
    return p;
  }
  Arena arena_;
  Scan scan_;
  ExternalScan rows_;
};

}  // namespace

TEST_CASE("frame_assembler: scans within the tolerance form one frame, closed by the last sensor, in any order") {
  for (const std::vector<int32_t>& order :
       {std::vector<int32_t>{0, 1, 2}, {0, 2, 1}, {1, 0, 2}, {1, 2, 0}, {2, 0, 1}, {2, 1, 0}}) {
    Bench bench;
    for (int64_t k = 0; k < 4; ++k) bench.sweep(50 * k, order);
    REQUIRE(bench.count() == 4);
    for (std::size_t k = 0; k < 4; ++k) {
      const Closed& c = bench.runner.closed[k];
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
  Bench bench;
  bench.scan(0, 100);
  CHECK(bench.scan(1, 125) == IntakeResult::kUsed);
  CHECK(bench.count() == 0);
  CHECK(bench.scan_ns(2, 125 * kMs + 1) == IntakeResult::kUsed);  // a new frame closes the first
  REQUIRE(bench.count() == 1);
  CHECK(bench.last().mask == 3);
  CHECK(bench.last().flags == OVT_FLAG_SENSOR_MISSING);
}

TEST_CASE("frame_assembler: a second scan of a sensor opens the next frame, however near its stamp") {
  Bench bench;
  bench.scan(0, 100);
  bench.scan(0, 110);
  REQUIRE(bench.count() == 1);
  CHECK(bench.last().mask == 1);
}

TEST_CASE("frame_assembler: a frame waits for a missing sensor until the next scan, and not for a silent one") {
  Bench bench;
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
  Bench bench;
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
  Bench bench;
  for (int64_t k = 0; k < 5; ++k) bench.sweep(50 * k, {0, 1});
  CHECK(bench.count() == 5);
  for (std::size_t k = 0; k < bench.count(); ++k) CHECK(bench.runner.closed[k].mask == 3);
}

TEST_CASE("frame_assembler: a scan older than a closed frame becomes a separate frame, out of sequence") {
  Bench bench;
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

TEST_CASE("frame_assembler: a scan that is more than half a second old is late") {
  Bench bench;
  bench.sweep(1000);                                 // 1000, 1001, 1002 ms
  CHECK(bench.scan(0, 502) == IntakeResult::kUsed);  // exactly at the limit
  CHECK(bench.scan(0, 501) == IntakeResult::kLate);
  CHECK(bench.scan_ns(1, 502 * kMs - 1) == IntakeResult::kLate);
  CHECK(bench.count() == 2);
}

TEST_CASE("frame_assembler: pushed detections ahead of the sensors make no scan late") {
  Bench bench;
  bench.sweep(1000);                                   // 1000, 1001, 1002 ms
  CHECK(bench.external(1072) == IntakeResult::kUsed);  // as near as the next scans may be
  CHECK(bench.scan(0, 502) == IntakeResult::kUsed);    // half a second before the sensors' newest stamp
  CHECK((bench.last().flags & OVT_FLAG_OUT_OF_SEQUENCE) != 0);
  CHECK(bench.scan(0, 501) == IntakeResult::kLate);
}

TEST_CASE("frame_assembler: a repeated stamp of a sensor is a duplicate, also out of sequence") {
  Bench bench;
  for (int64_t k = 0; k < 5; ++k) bench.sweep(50 * k);
  CHECK(bench.scan(0, 100) == IntakeResult::kDuplicate);
  CHECK(bench.scan(1, 151) == IntakeResult::kDuplicate);
  CHECK(bench.scan(0, 101) == IntakeResult::kUsed);  // another sensor's stamp
  CHECK(bench.scan(0, 101) == IntakeResult::kDuplicate);
  CHECK(bench.count() == 6);
}

TEST_CASE("frame_assembler: repeated stamps of half a second are duplicates, also at 1 kHz and in any order") {
  for (const int64_t period_ms : {50, 10, 2, 1}) {
    for (const bool pushed : {false, true}) {
      CAPTURE(period_ms);
      CAPTURE(pushed);
      Bench bench(pushed ? 0 : 1, period_ms * kMs);
      const auto offer = [&](int64_t ms) { return pushed ? bench.external(ms) : bench.scan(0, ms); };
      int32_t used = 0, again = 0;
      for (int64_t ms = 0; ms < 3000; ms += 2 * period_ms) {  // each second one is out of sequence
        used += offer(ms + period_ms) == IntakeResult::kUsed;
        used += offer(ms) == IntakeResult::kUsed;
      }
      CHECK(used == 3000 / period_ms);
      const int64_t newest_ms = 3000 - period_ms;
      for (int64_t ms = newest_ms; ms >= newest_ms - 500; ms -= period_ms)
        again += offer(ms) != IntakeResult::kDuplicate;
      CHECK(again == 0);
    }
  }
}

TEST_CASE("frame_assembler: of more stamps than half a second has at 1 kHz, the last used ones are duplicates") {
  Bench bench(0);
  for (int64_t k = 0; k < 3000; ++k) REQUIRE(bench.external_ns(k * kMs / 4) == IntakeResult::kUsed);
  for (int64_t k = 2999; k > 2999 - 500; --k) REQUIRE(bench.external_ns(k * kMs / 4) == IntakeResult::kDuplicate);
  CHECK(bench.external_ns(1001 * kMs / 4) == IntakeResult::kUsed);
}

TEST_CASE("frame_assembler: a clock that goes back by whole periods restarts at its third stamp, a used one") {
  for (const int64_t back : {20, 30}) {  // periods: 1 and 1.5 s
    CAPTURE(back);
    Bench bench;
    for (int64_t k = 0; k < 100; ++k) bench.sweep(50 * k);
    for (int64_t k = 100 - back; k < 102 - back; ++k)
      for (const int32_t s : {0, 1, 2}) CHECK(bench.scan(s, 50 * k + s) == IntakeResult::kLate);
    CHECK(bench.count() == 100);
    bench.sweep(50 * (102 - back));
    REQUIRE(bench.count() == 101);
    CHECK(bench.last().mask == 7);
    CHECK((bench.last().flags & OVT_FLAG_CLOCK_JUMP) != 0);
    CHECK(bench.assembler.clock_jumps() == 1);
  }
}

TEST_CASE("frame_assembler: the last stamp of a sensor is a duplicate, however old it is; earlier ones are late then") {
  Bench bench;
  for (int64_t k = 0; k < 4; ++k) bench.sweep(50 * k);
  for (int64_t k = 4; k < 20; ++k) bench.sweep(50 * k, {0, 1});  // the driver of sensor 2 repeats its last scan
  for (int64_t k = 20; k < 40; ++k) {
    CHECK(bench.scan(2, 152) == IntakeResult::kDuplicate);
    bench.sweep(50 * k, {0, 1});
  }
  CHECK(bench.scan(2, 102) == IntakeResult::kLate);
  CHECK(bench.assembler.clock_jumps() == 0);
}

TEST_CASE("frame_assembler: after a gap of all sensors the first frame has them all, in any order of arrival") {
  for (const std::vector<int32_t>& order : {std::vector<int32_t>{0, 1, 2}, {2, 1, 0}, {1, 2, 0}}) {
    Bench bench;
    for (int64_t k = 0; k < 4; ++k) bench.sweep(50 * k);
    bench.sweep_after_gap(350, order);  // 200 ms after the last one
    REQUIRE(bench.count() == 5);
    CHECK(bench.last().mask == 7);
    CHECK(bench.last().flags == 0);
    for (int64_t k = 0; k < 5; ++k) bench.sweep_after_gap(450 + 100 * k, order);  // slower than frame.period_s
    REQUIRE(bench.count() == 10);
    for (std::size_t k = 5; k < 10; ++k) CHECK(bench.runner.closed[k].mask == 7);
  }
}

TEST_CASE("frame_assembler: after a gap of all sensors a frame does not wait for one that was silent before") {
  Bench bench;
  for (int64_t k = 0; k < 4; ++k) bench.sweep(50 * k);
  for (int64_t k = 4; k < 8; ++k) bench.sweep(50 * k, {0, 1});
  CHECK(bench.count() == 8);
  bench.sweep_after_gap(600, {1, 0});
  REQUIRE(bench.count() == 9);
  CHECK(bench.last().mask == 3);
  CHECK(bench.scan(2, 601) == IntakeResult::kUsed);  // a frame of its own: the next one has it
  bench.sweep(650, {0, 1, 2});
  CHECK(bench.last().mask == 7);
  // One that does not come back after the gap is waited for once.
  bench.sweep_after_gap(900, {0, 1});
  const std::size_t before = bench.count();
  bench.sweep(950, {0, 1});
  CHECK(bench.count() == before + 2);
  bench.sweep(1000, {0, 1});
  CHECK(bench.count() == before + 3);
}

TEST_CASE("frame_assembler: after a gap of over a second the third consistent stamp restarts the clock") {
  Bench bench;
  for (int64_t k = 0; k < 3; ++k) bench.sweep(50 * k);
  for (int64_t k = 0; k < 2; ++k)
    for (const int32_t s : {0, 1, 2}) CHECK(bench.scan(s, 5000 + 50 * k + s) == IntakeResult::kLate);
  CHECK(bench.count() == 3);
  bench.sweep(5100);
  REQUIRE(bench.count() == 4);
  CHECK(bench.last().mask == 7);
  CHECK((bench.last().flags & OVT_FLAG_CLOCK_JUMP) != 0);
  CHECK(bench.assembler.clock_jumps() == 1);
  CHECK(bench.assembler.take_settled().late_before_jump == 6);  // they belong to the new clock
  bench.sweep(5150);
  CHECK((bench.last().flags & OVT_FLAG_CLOCK_JUMP) == 0);
}

TEST_CASE("frame_assembler: a source alone may be slower than 1 Hz: after one restart of the clock all is used") {
  for (const bool pushed : {false, true}) {
    for (const int64_t interval_ms : {950, 1100, 2000, 5000}) {
      CAPTURE(pushed);
      CAPTURE(interval_ms);
      Bench bench(pushed ? 0 : 1);
      int64_t ms = 0;
      const auto offer = [&](int64_t step_ms) {
        ms += step_ms;
        return pushed ? bench.external(ms) : bench.scan(0, ms);
      };
      int32_t refused = 0;
      for (int64_t k = 0; k < 20; ++k) refused += offer(interval_ms + 20 * (k % 3)) != IntakeResult::kUsed;
      CHECK(refused == (interval_ms > 1000 ? 2 : 0));
      CHECK(bench.assembler.clock_jumps() == (interval_ms > 1000 ? 1 : 0));
      CHECK(bench.assembler.take_settled().late_before_jump == (pushed ? 0 : refused));
      if (interval_ms < 1000) continue;
      CHECK(offer(2 * interval_ms) == IntakeResult::kUsed);  // one was lost
      CHECK(offer(4 * interval_ms) == IntakeResult::kLate);
    }
  }
}

TEST_CASE("frame_assembler: a source alone whose intervals are longer than 10 s, or of any length, is not its clock") {
  for (const std::vector<int64_t>& steps : {std::vector<int64_t>{11'000}, {1100, 2300}, {3000, 9000, 1200}}) {
    Bench bench(0);
    CHECK(bench.external(0) == IntakeResult::kUsed);
    int64_t ms = 0;
    for (std::size_t k = 0; k < 20; ++k) CHECK(bench.external(ms += steps[k % steps.size()]) == IntakeResult::kLate);
    CHECK(bench.assembler.clock_jumps() == 0);
  }
}

TEST_CASE("frame_assembler: held scans that belong to the new clock after a jump count as dropped") {
  Bench bench;
  for (int64_t k = 0; k < 3; ++k) bench.sweep(50 * k);
  CHECK(bench.scan(0, 1000) == IntakeResult::kHeld);  // less than a second ahead: the others may follow
  CHECK(bench.scan(0, 1050) == IntakeResult::kHeld);
  CHECK(bench.scan(0, 1150) == IntakeResult::kUsed);  // the third that agrees, and no other sensor was heard meanwhile
  CHECK(bench.assembler.clock_jumps() == 1);
  const Settled settled = bench.assembler.take_settled();
  CHECK(settled.late == 2);
  CHECK(settled.late_before_jump == 2);
  CHECK(settled.used == 0);
}

TEST_CASE(
    "frame_assembler: a clock that went back is accepted at the third stamp; the two before it count as dropped") {
  Bench bench;
  bench.sweep(100'000);
  for (int64_t k = 0; k < 2; ++k)
    for (const int32_t s : {0, 1, 2}) CHECK(bench.scan(s, 50 * k + s) == IntakeResult::kLate);
  bench.sweep(100);
  CHECK((bench.last().flags & OVT_FLAG_CLOCK_JUMP) != 0);
  CHECK((bench.last().flags & OVT_FLAG_OUT_OF_SEQUENCE) == 0);
  CHECK(bench.assembler.take_settled().late_before_jump == 6);
  CHECK(bench.assembler.take_settled().late_before_jump == 0);
}

TEST_CASE("frame_assembler: one sensor's bad clock cannot move the others, two of three can") {
  Bench bench;
  bench.sweep(0);
  for (int64_t k = 1; k < 10; ++k) {
    CHECK(bench.scan(0, 50 * k) == IntakeResult::kUsed);
    CHECK(bench.scan(1, 50 * k + 1) == IntakeResult::kUsed);
    CHECK(bench.scan(2, 60'000 + 50 * k) == IntakeResult::kLate);
  }
  CHECK(bench.assembler.clock_jumps() == 0);
  for (int64_t k = 0; k < 3; ++k) {
    CHECK(bench.scan(0, 500 + 50 * k) == IntakeResult::kUsed);
    const IntakeResult before = k < 2 ? IntakeResult::kLate : IntakeResult::kUsed;
    const IntakeResult first = bench.scan(1, 60'500 + 50 * k);
    CHECK(first == before);
    if (k < 2) CHECK(bench.scan(2, 60'500 + 50 * k) == IntakeResult::kLate);
  }
  CHECK(bench.assembler.clock_jumps() == 1);
}

TEST_CASE("frame_assembler: inconsistent stamps do not change the clock") {
  Bench bench;
  bench.sweep(100'000);
  for (const int64_t ms : {10'000, 20'000, 30'000, 29'000, 28'000, 50'000, 52'000, 54'000})
    CHECK(bench.scan(0, ms) == IntakeResult::kLate);
  for (const int64_t ms : {200'000, 300'000, 400'000}) CHECK(bench.scan(0, ms) == IntakeResult::kLate);
  CHECK(bench.assembler.clock_jumps() == 0);
}

TEST_CASE("frame_assembler: flush closes the open frame once") {
  Bench bench;
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
  Bench bench;
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
    Bench bench;
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
  Bench bench;
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
  for (int64_t k = 1; k < 8; ++k) bench.external(150 + 50 * k);  // no sensor goes on: the open frame ends
  std::size_t scans = 0;
  for (const Closed& frame : bench.runner.closed) {
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
  Bench bench;
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
  Bench bench;
  bench.sweep(0);
  CHECK(bench.external(2) == IntakeResult::kUsed);
  CHECK(bench.external(50) == IntakeResult::kUsed);
  bench.sweep(50);
  REQUIRE(bench.count() == 4);
  CHECK(bench.last().mask == 7);
  CHECK(bench.last().last_ms == 52);
}

TEST_CASE("frame_assembler: without a free slot nothing is used and the sequence gets no gap") {
  Bench bench;
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
    Bench bench;
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

TEST_CASE("frame_assembler: a clock that is known to be wrong is not believed in a short gap of the others") {
  for (const int64_t ahead_ms : {200, 300, 490, 520, 700, 990, 1500})
    for (const int64_t lost : {1, 2, 4, 8})
      for (const bool is_radar : {false, true}) {
        CAPTURE(ahead_ms);
        CAPTURE(lost);
        CAPTURE(is_radar);
        Bench bench;
        for (int64_t k = 0; k < 60; ++k) {
          const bool is_gap = k >= 40 && k < 40 + lost;
          const int64_t wrong_ms = 50 * k + 1 + (k >= 20 ? ahead_ms : 0);
          if (is_radar)
            bench.external(wrong_ms);
          else
            bench.scan(1, wrong_ms);
          if (is_gap) continue;
          CHECK(bench.scan(0, 50 * k) == (k == 40 + lost ? IntakeResult::kHeld : IntakeResult::kUsed));
          CHECK(bench.scan(2, 50 * k + 2) == IntakeResult::kUsed);
        }
        CHECK(bench.assembler.take_settled().used == 1);  // the scan that was held after the gap
        CHECK(bench.assembler.clock_jumps() == 0);
        CHECK((bench.last().flags & OVT_FLAG_OUT_OF_SEQUENCE) == 0);
        CHECK((bench.last().mask & 5u) == 5u);
      }
}

TEST_CASE("frame_assembler: a clock that steps ahead by little more than allowed does not divide the others' frames") {
  for (const int64_t ahead_ms : {78, 90, 100, 110, 125, 150}) {
    std::array<int32_t, 3> order = {0, 1, 2};
    do {
      CAPTURE(ahead_ms);
      CAPTURE(order);
      Bench bench;
      int32_t refused = 0;
      for (int64_t k = 0; k < 60; ++k)
        for (const int32_t s : order) {
          const bool is_wrong = s == 1 && k >= 20;
          const IntakeResult result = bench.scan(s, 50 * k + (is_wrong ? ahead_ms : 0));
          CHECK((is_wrong || result == IntakeResult::kUsed));
          refused += is_wrong && result != IntakeResult::kUsed;
        }
      bench.assembler.flush();
      const auto together = std::count_if(bench.runner.closed.begin(), bench.runner.closed.end(),
                                          [](const Closed& frame) { return (frame.mask & 5u) == 5u; });
      CHECK(together == 60);
      CHECK(refused == 40);
      CHECK(bench.assembler.take_settled().used == 0);
    } while (std::next_permutation(order.begin(), order.end()));
  }
}

TEST_CASE("frame_assembler: after a gap of all sensors a sensor of another phase loses nothing, in any order") {
  for (const int64_t phase_ms : {10, 40, 49})
    for (const int64_t gap_ms : {100, 300, 900}) {
      std::array<int32_t, 3> order = {0, 1, 2};
      do {
        CAPTURE(phase_ms);
        CAPTURE(gap_ms);
        CAPTURE(order);
        Bench bench;
        int64_t used = 0;
        for (int64_t k = 0; k < 40; ++k)
          for (const int32_t s : order) {
            const int64_t ms = 50 * k + (k >= 20 ? gap_ms : 0) + (s == 1 ? phase_ms : 0);
            used += bench.scan(s, ms) == IntakeResult::kUsed;
          }
        bench.assembler.flush();
        CHECK(used + bench.assembler.take_settled().used == 120);
      } while (std::next_permutation(order.begin(), order.end()));
    }
}

TEST_CASE("frame_assembler: a sensor that is faster than the others by over a period loses nothing after a gap") {
  struct Arrival {
    int64_t ms;
    int32_t sensor;
    int64_t stamp_ms;
  };
  for (const int64_t faster_ms : {30, 60, 90})
    for (const int64_t lost : {1, 2, 7, 60}) {
      CAPTURE(faster_ms);
      CAPTURE(lost);
      std::vector<Arrival> arrivals;
      for (int64_t k = 0; k < 200; ++k)
        for (const int32_t s : {0, 1, 2}) {
          if (s == 1 && k >= 40 && k < 40 + lost) continue;
          arrivals.push_back({50 * k + (s == 1 ? 0 : faster_ms + s), s, 50 * k + s});
        }
      std::sort(arrivals.begin(), arrivals.end(), [](const Arrival& a, const Arrival& b) { return a.ms < b.ms; });
      Bench bench;
      int64_t used = 0;
      for (const Arrival& a : arrivals) used += bench.scan(a.sensor, a.stamp_ms) == IntakeResult::kUsed;
      bench.assembler.flush();
      const auto settled = bench.assembler.take_settled();
      used += settled.used;
      // The flush refuses what is still held.
      CHECK(int64_t(arrivals.size()) - used == settled.late);
      CHECK(settled.late <= 1);
    }
}

namespace {

// Sensors with a period each, in the order of their stamps, or each stamp's sensors in the opposite order.
struct Rates {
  std::vector<int64_t> period_ms, phase_ms;
  int64_t jitter_ms = 0;
  bool slow_first = false;
  std::vector<int32_t> lost_percent = {0, 0, 0};
  int64_t stops_ms = INT64_MAX;  // the last sensor
  int64_t end_ms = 6000;
};

struct Arrival {
  int64_t due_ms, stamp_ms;
  int32_t sensor;
  int32_t group;  // scans of one group arrive in either order
};

std::vector<Arrival> arrivals_of(const Rates& rates, uint32_t seed) {
  std::mt19937 random(seed);
  std::vector<Arrival> all;
  for (std::size_t s = 0; s < rates.period_ms.size(); ++s)
    for (int64_t t = 0; t < rates.end_ms; t += rates.period_ms[s]) {
      const int64_t jitter_ms =
          rates.jitter_ms ? int64_t(random() % uint32_t(2 * rates.jitter_ms + 1)) - rates.jitter_ms : 0;
      const bool lost = int32_t(random() % 100) < rates.lost_percent[s];
      const bool stopped = s + 1 == rates.period_ms.size() && t >= rates.stops_ms;
      if (!lost && !stopped) all.push_back({t, 1000 + t + rates.phase_ms[s] + jitter_ms, int32_t(s), int32_t(t / 50)});
    }
  std::sort(all.begin(), all.end(), [&](const Arrival& a, const Arrival& b) {
    if (a.group != b.group) return a.group < b.group;
    return rates.slow_first ? a.sensor > b.sensor : a.sensor < b.sensor;
  });
  return all;
}

constexpr int64_t kLearnedMs = 1000 + 2500;  // until then the stamps teach the intervals

uint32_t sensors_at(const std::vector<Arrival>& all, int32_t group) {
  uint32_t mask = 0;
  for (const Arrival& a : all)
    if (a.group == group) mask |= 1u << a.sensor;
  return mask;
}

}  // namespace

TEST_CASE("frame_assembler: of sensors of two rates, no frame waits for one that is not due, and none is silent") {
  for (const Rates& rates :
       {Rates{{50, 100}, {0, 0}}, Rates{{50, 100}, {0, 15}}, Rates{{50, 100}, {15, 0}}, Rates{{50, 50, 100}, {0, 3, 7}},
        Rates{{50, 100, 100}, {0, 5, 10}}, Rates{{50, 100, 150}, {0, 5, 10}}, Rates{{50, 50, 200}, {0, 0, 0}}})
    for (const int64_t jitter_ms : {0, 2})
      for (const bool slow_first : {false, true}) {
        Rates changed = rates;
        changed.jitter_ms = jitter_ms;
        changed.slow_first = slow_first;
        CAPTURE(rates.period_ms.size());
        CAPTURE(rates.period_ms.back());
        CAPTURE(jitter_ms);
        CAPTURE(slow_first);
        Bench bench(int32_t(rates.period_ms.size()));
        const std::vector<Arrival> all = arrivals_of(changed, 1);
        for (std::size_t i = 0; i < all.size(); ++i) {
          CHECK(bench.scan(all[i].sensor, all[i].stamp_ms) == IntakeResult::kUsed);
          if (all[i].stamp_ms < kLearnedMs) continue;
          // The frame closes with its last scan, not before and not later.
          const bool is_last = i + 1 == all.size() || all[i + 1].group != all[i].group;
          CHECK(bench.assembler.has_open() == !is_last);
          if (!is_last) continue;
          CHECK(bench.last().mask == sensors_at(all, all[i].group));
          CHECK((bench.last().flags & ~OVT_FLAG_SENSOR_MISSING) == 0);
        }
      }
}

TEST_CASE("frame_assembler: a slower sensor that stops is silent after 1.5 of its own intervals") {
  Bench bench(2);
  Rates rates{{50, 100}, {0, 5}};
  rates.stops_ms = 4050;  // its last scan: 5005 ms
  for (const Arrival& a : arrivals_of(rates, 1)) bench.scan(a.sensor, a.stamp_ms);
  for (const Closed& c : bench.runner.closed)
    if (c.first_ms >= kLearnedMs) {
      CAPTURE(c.first_ms);
      CHECK(((c.flags & OVT_FLAG_SENSOR_STALE) != 0) == (c.last_ms > 5005 + 150));
    }
  CHECK(bench.assembler.has_open() == false);  // nobody waits for it
}

TEST_CASE("frame_assembler: lost scans make no sensor slow, unless eight steps in a row are long") {
  for (uint32_t seed = 1; seed <= 20; ++seed) {
    CAPTURE(seed);
    Rates rates{{50, 50}, {0, 5}};
    rates.lost_percent = {0, 30};
    Bench bench(2);
    std::vector<int64_t> seen_ms;  // of the lossy sensor
    for (const Arrival& a : arrivals_of(rates, seed)) {
      bench.scan(a.sensor, a.stamp_ms);
      if (a.sensor == 1) seen_ms.push_back(a.stamp_ms);
    }
    // As without any rhythm: silent after 75 ms.
    for (const Closed& c : bench.runner.closed) {
      const auto next = std::upper_bound(seen_ms.begin(), seen_ms.end(), c.last_ms);
      if (next == seen_ms.begin()) continue;
      CHECK(((c.flags & OVT_FLAG_SENSOR_STALE) != 0) == (c.last_ms - *(next - 1) > 75));
    }
  }
}

TEST_CASE("frame_assembler: a slower sensor that loses scans is waited for again from its next scan on") {
  for (uint32_t seed = 1; seed <= 20; ++seed) {
    CAPTURE(seed);
    Rates rates{{50, 50, 100}, {0, 3, 7}};
    rates.lost_percent = {0, 0, 30};
    Bench bench;
    const std::vector<Arrival> all = arrivals_of(rates, seed);
    for (const Arrival& a : all) CHECK(bench.scan(a.sensor, a.stamp_ms) == IntakeResult::kUsed);
    int64_t last_ms = 0;
    for (const Arrival& a : all) {
      if (a.sensor != 2) continue;
      const bool follows = a.stamp_ms - last_ms == 100;
      last_ms = a.stamp_ms;
      if (!follows || a.stamp_ms < kLearnedMs) continue;
      const auto has_it = [&](const Closed& c) { return c.last_ms == a.stamp_ms && c.mask == 7; };
      CAPTURE(a.stamp_ms);
      CHECK(std::any_of(bench.runner.closed.begin(), bench.runner.closed.end(), has_it));
    }
  }
}

TEST_CASE("frame_assembler: a sensor that delivers at the full rate again is waited for at once") {
  Bench bench;
  for (int64_t k = 0; k < 40; ++k)
    bench.sweep(50 * k, k % 2 ? std::vector<int32_t>{0, 1} : std::vector<int32_t>{2, 0, 1});
  CHECK(bench.count() == 40);
  bench.sweep(2000);
  bench.sweep(2050, {2, 0, 1});  // half of its interval
  CHECK(bench.count() == 42);
  bench.sweep(2100, {0, 1});
  CHECK(bench.assembler.has_open());
  CHECK(bench.scan(2, 2102) == IntakeResult::kUsed);
  CHECK(bench.count() == 43);
  CHECK(bench.last().mask == 7);
}

TEST_CASE("frame_assembler: a sensor of less than a quarter of the rate counts as silent in between") {
  Bench bench;
  for (int64_t k = 0; k < 200; ++k)
    bench.sweep(50 * k, k % 5 ? std::vector<int32_t>{0, 1} : std::vector<int32_t>{2, 0, 1});
  for (const Closed& c : bench.runner.closed) {
    CAPTURE(c.first_ms);
    CHECK(((c.flags & OVT_FLAG_SENSOR_STALE) != 0) == (c.first_ms % 250 >= 100));
  }
}

TEST_CASE("frame_assembler: after a jump of the clock the intervals are those before it") {
  for (const int64_t to_ms : {60'000, 1'000}) {
    CAPTURE(to_ms);
    Bench bench(2);
    int64_t k = 0;
    for (; k < 40; ++k) bench.sweep(20'000 + 50 * k, k % 2 ? std::vector<int32_t>{0} : std::vector<int32_t>{0, 1});
    for (k = 0; k < 40; ++k)
      for (const int32_t s : {0, 1})
        if (s == 0 || k % 2 == 0) bench.scan(s, to_ms + 50 * k + s);
    CHECK(bench.assembler.clock_jumps() == 1);
    bool after = false;
    for (const Closed& c : bench.runner.closed) {
      after |= (c.flags & OVT_FLAG_CLOCK_JUMP) != 0;
      if (!after) continue;
      CAPTURE(c.first_ms);
      CHECK((c.flags & OVT_FLAG_SENSOR_STALE) == 0);
      CHECK(c.mask == ((c.first_ms - to_ms) % 100 == 0 ? 3u : 1u));
    }
    CHECK(after);
  }
}

TEST_CASE("frame_assembler: stamps at both ends of int64 work") {
  Bench bench;
  CHECK(bench.scan_ns(0, INT64_MIN) == IntakeResult::kUsed);
  CHECK(bench.scan_ns(1, INT64_MAX) == IntakeResult::kHeld);  // one against one at the very start
  CHECK(bench.scan_ns(2, 0) == IntakeResult::kHeld);
  CHECK(bench.scan_ns(1, INT64_MIN) == IntakeResult::kUsed);
  CHECK(bench.scan_ns(2, INT64_MIN) == IntakeResult::kUsed);
  CHECK(bench.assembler.take_settled().late == 2);
  for (const int64_t back : {2, 1}) CHECK(bench.scan_ns(0, INT64_MAX - back * kMs) == IntakeResult::kLate);
  CHECK(bench.scan_ns(0, INT64_MAX) ==
        IntakeResult::kUsed);  // the third that agrees, and no other sensor was heard meanwhile
  CHECK(bench.assembler.clock_jumps() == 1);
  CHECK(bench.scan_ns(2, INT64_MIN) == IntakeResult::kHeld);
  CHECK(bench.scan_ns(2, INT64_MAX) == IntakeResult::kUsed);
  CHECK(bench.assembler.advance(INT64_MIN));
  CHECK(bench.assembler.advance(INT64_MAX));
  bench.assembler.flush();
}

TEST_CASE("frame_assembler: a frame sees the ego poses pushed before its last scan") {
  Bench bench;
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
