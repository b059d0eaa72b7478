// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// The worst-case cost of candidate_capacity and track_capacity: as many detections as fit, all in each other's gates,
// frame after frame, and then one late frame. Only the tracker, through the C API; CPU time of the call.
//
//   bench_capacity [--side METRES] [--late SECONDS] [--limit STEPS] [--frames N] [CAPACITY...]
#include <time.h>

#include <algorithm>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <random>
#include <vector>

#include "pipeline/overtake.h"

namespace {

struct Options {
  double side_m = 6.0, late_s = 0.4, limit = 0;
  int32_t frames = 30;
};

double cpu_ms() {
  timespec t;
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &t);
  return double(t.tv_sec) * 1e3 + double(t.tv_nsec) * 1e-6;
}

void measure(int32_t capacity, const Options& options) {
  ovt_params params = ovt_default_params();
  if (options.limit > 0) params.tracker_work_limit = options.limit;
  ovt_detector_def def = ovt_default_detector_def();
  def.params = &params;
  def.candidate_capacity = def.track_capacity = capacity;
  ovt_detector* detector = nullptr;
  if (ovt_create_detector(&def, &detector) != OVT_OK) {
    std::printf("| %d | no memory |\n", capacity);
    return;
  }
  std::mt19937_64 random(1);
  std::uniform_real_distribution<double> place(-options.side_m / 2, options.side_m / 2);
  std::vector<double> x(static_cast<std::size_t>(capacity)), y(x.size());
  const auto push = [&](double time_s) {
    for (std::size_t i = 0; i < x.size(); ++i) x[i] = place(random), y[i] = place(random);
    ovt_external_detections d;
    ovt_external_detections_init(&d, sizeof d);
    d.stamp_ns = int64_t(time_s * 1e9);
    d.count = capacity;
    d.reference = OVT_REFERENCE_MAP;
    d.x_m = x.data();
    d.y_m = y.data();
    const double start = cpu_ms();
    ovt_push_detections(detector, &d);
    return cpu_ms() - start;
  };
  double sum = 0, worst = 0;
  for (int32_t k = 0; k < options.frames; ++k) {
    const double ms = push(0.05 * k);
    if (k < 10) continue;  // until the tracks have settled
    sum += ms;
    worst = std::max(worst, ms);
  }
  ovt_stats before = ovt_default_stats(), after = before;
  ovt_read_stats(detector, &before);
  const double late = push(0.05 * (options.frames - 1) - options.late_s + 1e-3);
  ovt_read_stats(detector, &after);
  std::printf("| %d | %.2f | %.2f | %lld of %d | %.2f | %s |\n", capacity, sum / std::max(options.frames - 10, 1),
              worst, static_cast<long long>(before.work_limited), options.frames, late,
              after.refiltered > before.refiltered ? "taken in" : "refused");
  ovt_destroy_detector(detector);
}

}  // namespace

int main(int argc, char** argv) {
  Options options;
  std::vector<int32_t> capacities;
  for (int i = 1; i < argc; ++i) {
    const auto value = [&] { return i + 1 < argc ? std::atof(argv[++i]) : 0.0; };
    if (!std::strcmp(argv[i], "--side"))
      options.side_m = value();
    else if (!std::strcmp(argv[i], "--late"))
      options.late_s = value();
    else if (!std::strcmp(argv[i], "--limit"))
      options.limit = value();
    else if (!std::strcmp(argv[i], "--frames"))
      options.frames = std::max(int32_t(value()), 11);
    else
      capacities.push_back(std::atoi(argv[i]));
  }
  if (capacities.empty()) capacities = {64, 128, 256, 512, 1024, 2048, 4096};
  std::printf(
      "| capacity | mean ms | worst ms | frames at the limit | one late frame ms | |\n| --- | --- | --- | --- | --- | "
      "--- |\n");
  for (const int32_t capacity : capacities) measure(capacity, options);
  return 0;
}
