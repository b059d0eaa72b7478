// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// Result of a run: histograms end to end, per stage and of the machine's noise; as text and as JSON.
#pragma once

#include <string>
#include <vector>

#include "bench/environment.h"
#include "bench/histogram.h"
#include "bench/latency_run.h"

namespace overtake::bench {

// One interval of the latency, in the order of time. Stages of a sensor count once per scan.
struct StageHistogram {
  std::string name;  // ovt_stage_name, or wake_driver, last_piece, hand_over, gather, publish (see the .cpp)
  Histogram histogram;
};

struct LatencyReport {
  Histogram end_to_end, warmup, floor;
  int64_t warmup_first_ns = 0;  // latency of the very first frame; 0: no warm-up
  int64_t missing = 0;          // frames after the warm-up whose scans were all replaced: in no histogram
  int64_t incomplete = 0;       // ... published without one of their scans, or in parts
  int64_t deadline_missed = 0;
  std::vector<StageHistogram> stages;
  Histogram late, stolen, noise;  // see noise_floor.h
};

LatencyReport make_report(const LatencyRun& run, const LatencyRunDef& def);

std::string format_text(const LatencyReport& report, const LatencyRun& run, const LatencyRunDef& def,
                        const std::string& source, const EnvironmentSheet& environment);
// JSON: end_to_end.p50_us p90_us p99_us p999_us max_us min_us mean_us count; the same for warmup, segment_floor,
// stages.NAME and noise.NAME; end_to_end.p50_floors (open loop); frames, options, runtime, environment.
std::string format_json(const LatencyReport& report, const LatencyRun& run, const LatencyRunDef& def,
                        const std::string& source, const EnvironmentSheet& environment);

}  // namespace overtake::bench
