// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// A FrameAssembler with a fake runner that records the closed frames.
#pragma once

#include <doctest/doctest.h>

#include <vector>

#include "pipeline/frame_assembler.h"

namespace overtake::test {

inline constexpr int64_t kMs = 1'000'000;
inline constexpr int32_t kSensors = 3, kCapacity = 16, kSlots = 4;

struct ClosedFrame {
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
  std::vector<ClosedFrame> closed;
  std::vector<Frame*> kept;
  int32_t segments = 0;
  bool keep = false;

 private:
  FramePool& pool_;
};

class AssemblerBench {
 public:
  explicit AssemblerBench(int32_t sensor_count = kSensors, int64_t period_ns = 50 * kMs)
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
  const ClosedFrame& last() const { return runner.closed.back(); }
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

}  // namespace overtake::test
