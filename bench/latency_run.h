// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// The run itself. Open loop: scans arrive by an absolute clock, whether or not the library is ready, each pushed by a
// thread of its own; a frame's latency counts from the time its last scan was *scheduled* for, so a late wake-up of the
// driver's thread, or a frame that waits for the one before it, is in it. Closed loop: the next frame is pushed when
// the last one is published; latency counts from before the first push.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "bench/latency_input.h"
#include "bench/noise_floor.h"

namespace overtake::bench {

struct LatencyRunDef {
  bool closed_loop = false;
  int32_t frames = 1000, warmup = 50;  // warm-up frames come first and are not among `frames`
  double rate_hz = 0;                  // of each sensor; 0: as the input was recorded
  int32_t stagger_us = 0;              // sensor s arrives s times this after sensor 0
  std::vector<int32_t> cpus;           // everything runs there; empty: anywhere
  int32_t workers = 0;                 // as ovt_detector_def.worker_count
  int32_t fifo_priority = 0, spin_us = 0;
  int32_t memory = 0;  // OVT_MEMORY_... bits
  int64_t deadline_ns = 0;
  std::string isa;           // empty: the best
  bool cold = false;         // caches emptied between frames
  bool keep_images = false;  // as ovt_detector_def.keep_images
  int64_t noise_window_ns = 1'000'000;
};

// Times by the steady clock.
struct FrameSample {
  int64_t due_ns = 0;        // last scan's scheduled arrival; closed loop: start of the first push
  int64_t published_ns = 0;  // start of on_frame; 0: never, its scans were replaced
  int64_t sequence = -1;
  uint32_t expected_mask = 0, sensor_mask = 0, flags = 0;
  int32_t parts = 0;  // 2: a late scan became a frame of its own; the last one counts
};

struct LatencyRun {
  std::vector<FrameSample> frames;  // warm-up first
  std::vector<ovt_span> spans;      // [frame][sensor, then the whole frame's][stage]
  std::vector<NoiseSample> noise;   // per frame
  int32_t sensor_count = 0;
  int64_t wall_ns = 0;  // of the frames behind the warm-up
  double rate_hz = 0;
  std::string isa;             // taken
  ovt_runtime_info runtime{};  // isa: see above
  ovt_stats stats{};
  int32_t measuring_threads = 0, measuring_fifo = 0;  // ours, besides the library's: all, SCHED_FIFO
  std::size_t evicted_bytes = 0;                      // walked by each CPU between frames

  // sensor -1: the whole frame's.
  const ovt_span& span(std::size_t frame, int32_t sensor, ovt_stage stage) const {
    const auto row = std::size_t(sensor < 0 ? sensor_count : sensor);
    return spans[(frame * (std::size_t(sensor_count) + 1) + row) * OVT_STAGE_COUNT + std::size_t(stage)];
  }
};

// Throws io::Error with the library's own sentence when it refuses the def or a push.
LatencyRun run_latency(const LatencyInput& input, const LatencyRunDef& def);

}  // namespace overtake::bench
