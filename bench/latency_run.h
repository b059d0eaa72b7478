// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// The run itself. Open loop: scans arrive by an absolute clock, whether or not the library is ready; one thread per
// sensor pushes them. A frame's latency starts at the *scheduled* time of its last scan, so it includes a late wake-up
// of the driver's thread, and the wait for an earlier frame. Closed loop: the next frame is pushed when the last one is
// published; its latency starts before the first push. With `pieces` the points of a scan come evenly over the time
// before its arrival, which is that of its last piece.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "bench/latency_input.h"
#include "bench/noise_floor.h"

namespace overtake::bench {

struct LatencyRunDef {
  bool closed_loop = false;
  int32_t frames = 1000, warmup = 50;  // warm-up frames come first and are not part of `frames`
  double rate_hz = 0;                  // per sensor; 0: the rate of the input
  int32_t stagger_us = 0;              // sensor s arrives s times this after sensor 0
  int32_t pieces = 0;                  // open loop: of each scan; 0: scans are pushed whole
  std::string preset;                  // empty: the library's default
  std::vector<int32_t> cpus;           // CPUs for all threads; empty: any
  int32_t workers = 0;                 // ovt_detector_def.worker_count
  int32_t parts = 0;                   // ovt_params.segment_parts; 0: the library's default
  int32_t fifo_priority = 0, spin_us = 0;
  int32_t memory = 0;  // OVT_MEMORY_... bits
  int64_t deadline_ns = 0;
  std::string isa;           // empty: the best
  bool cold = false;         // evict the caches between frames
  bool keep_images = false;  // ovt_detector_def.keep_images
  int64_t noise_window_ns = 1'000'000;
};

// Times of the steady clock.
struct FrameSample {
  int64_t due_ns = 0;        // scheduled arrival of the last scan; closed loop: start of the first push
  int64_t published_ns = 0;  // start of on_frame; 0: its scans were replaced
  int64_t sequence = -1;
  uint32_t expected_mask = 0, sensor_mask = 0, flags = 0;
  int32_t parts = 0;  // 2: a late scan became a separate frame; the last one counts
};

struct LatencyRun {
  std::vector<FrameSample> frames;  // warm-up frames first
  std::vector<ovt_span> spans;      // [frame][sensor, then the whole frame's][stage]
  std::vector<NoiseSample> noise;   // per frame
  std::vector<int64_t> floor_ns;    // open loop: segment_floor, one per frame
  int32_t sensor_count = 0;
  int64_t wall_ns = 0;  // duration of the frames after the warm-up
  double rate_hz = 0;
  std::string isa;             // the ISA that the library chose
  ovt_runtime_info runtime{};  // without its isa
  ovt_stats stats{};
  int32_t measuring_threads = 0, measuring_fifo = 0;  // our own threads: all; with SCHED_FIFO
  std::size_t evicted_bytes = 0;                      // memory that each CPU touches between frames

  // sensor -1: the stages of the whole frame.
  const ovt_span& span(std::size_t frame, int32_t sensor, ovt_stage stage) const {
    const auto row = std::size_t(sensor < 0 ? sensor_count : sensor);
    return spans[(frame * (std::size_t(sensor_count) + 1) + row) * OVT_STAGE_COUNT + std::size_t(stage)];
  }
};

// Throws io::Error with the library's message if it refuses the def or a push.
LatencyRun run_latency(const LatencyInput& input, const LatencyRunDef& def);

}  // namespace overtake::bench
